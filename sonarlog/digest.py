"""Digests: of any value, of what each block made of a sweep, chained into a run's, and of a map.

docs/determinism.md defines them so that another program can make them. Must not know: files, how values are shown.
"""

import hashlib
from typing import Any

from slam.grid import Cells, Grid
from slam.pipeline import Step
from sonarlog.canonical import canonical

BLOCKS = {
    "A": ("sensing", "sweep"),
    "B": ("self-calibration", "calibrated"),
    "C": ("data reliability analysis", "reliability"),
    "D": ("feature extraction", "features"),
    "E": ("feature association", "association"),
    "F": ("local localisation", "localisation"),
    "G": ("post-localisation calibration", "posed"),
    "H": ("map extension", "patch"),
    "I": ("decision making", "decision"),
}
"""The blocks of Fig. 5: letter, name, and the attribute of a Step that holds what the block made."""

MAP = "map"
"""Beside the blocks' letters: the key of the digest of the whole map after the sweep."""

SIZE = 16


def digest(value: Any) -> str:
    """Hex digest (BLAKE2b, 128 bits) of a value's canonical bytes."""
    return digest_of(canonical(value))


def digest_of(data: bytes) -> str:
    """Hex digest (BLAKE2b, 128 bits) of bytes."""
    return hashlib.blake2b(data, digest_size=SIZE).hexdigest()


def step_blocks(step: Step) -> dict[str, bytes]:
    """The canonical bytes of what each block of Fig. 5 made of the sweep, by the block's letter."""
    return {letter: canonical(getattr(step, attribute)) for letter, (_, attribute) in BLOCKS.items()}


class MapDigest:
    """The digest of a map that grows: only tiles that changed since the last call are hashed again."""

    def __init__(self) -> None:
        self._tiles: dict[tuple[int, int], tuple[Cells, str | None]] = {}

    def of(self, grid: Grid) -> str:
        """Digest of the whole map; tiles in which every cell is 0 do not count.

        A grid shares the tiles that it did not touch with the grid before, so a tile is known by being the same object.
        """
        tiles = {place: self._tile(place, tile) for place, tile in grid.tiles.items()}
        self._tiles = tiles
        known = {f"{i},{j}": made for (i, j), (_, made) in tiles.items() if made is not None}
        return digest((grid.cell_m, grid.occupied_from, grid.free_from, known))

    def _tile(self, place: tuple[int, int], tile: Cells) -> tuple[Cells, str | None]:
        before = self._tiles.get(place)
        if before is not None and before[0] is tile:
            return before
        return tile, digest(tile) if tile.any() else None


def grid_digest(grid: Grid) -> str:
    """Digest of a whole map."""
    return MapDigest().of(grid)


class RunDigest:
    """The digest of a run as it grows: of what was asked, of every block of every sweep, and of the map after each.

    `chain` is the digest of everything so far; `blocks` the canonical bytes of what each block made of the last sweep.
    """

    def __init__(self, asked: Any) -> None:
        self.chain = digest(asked)
        self.blocks: dict[str, bytes] = {}
        self._map = MapDigest()
        self._map_digest = digest(None)

    @classmethod
    def after(cls, chain: str, grid: Grid) -> "RunDigest":
        """Going on from a chain and the map at that moment."""
        made = cls(None)
        made.chain, made._map_digest = chain, made._map.of(grid)
        return made

    def add(self, step: Step) -> dict[str, str]:
        """Take one step in; the digests of its blocks by letter, and of the map."""
        self.blocks = step_blocks(step)
        self._map_digest = self._map.of(step.state.grid)
        digests = {letter: digest_of(data) for letter, data in self.blocks.items()} | {MAP: self._map_digest}
        self.chain = digest((self.chain, digests))
        return digests

    def map_digest(self) -> str:
        """Digest of the map so far."""
        return self._map_digest

    def result(self) -> str:
        """The run's digest."""
        return digest((self.chain, self._map_digest))
