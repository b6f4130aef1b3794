"""A world: walls, poles and what they are made of, read from a small TOML file, and the truth a map is judged by.

Metres and degrees; the robot starts at (0, 0, 0). Must not know: sonar, robots, time.
"""

import re
import tomllib
from collections import deque
from dataclasses import dataclass
from importlib import resources
from itertools import pairwise
from math import ceil, floor
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slam.dmath import hypot
from sonarlog.errors import SonarlogError
from sonarlog.log import Surfaces

UNKNOWN, FREE, OCCUPIED = 0, 1, 2
RANDOM = "random:"
"""Of names such as `random:7`: a place that a number makes (`sonarlog/sim/random_world.py`)."""


class BadWorld(SonarlogError):
    """A world that is neither built in nor a file that describes one."""


@dataclass(frozen=True)
class Material:
    """How a surface answers: up to `half_beam_deg` off a sonar's axis, to a share `echo` of the pings."""

    half_beam_deg: float
    echo: float = 1.0

    def __post_init__(self) -> None:
        if not 0 < self.half_beam_deg <= 45:
            raise ValueError(f"half_beam_deg is {self.half_beam_deg}; it lies between 0 and 45")
        if not 0 <= self.echo <= 1:
            raise ValueError(f"echo is {self.echo}; it is a share from 0 to 1")


@dataclass(frozen=True)
class Wall:
    """One straight piece from (x0, y0) to (x1, y1), seen from both sides."""

    x0: float
    y0: float
    x1: float
    y1: float
    material: Material

    def __post_init__(self) -> None:
        if not 0.001 <= self.length <= 1000:
            raise ValueError(f"the wall at ({self.x0}, {self.y0}) is not between a millimetre and a kilometre long")

    @property
    def length(self) -> float:
        """Metres."""
        return hypot(self.x1 - self.x0, self.y1 - self.y0)


@dataclass(frozen=True)
class Pole:
    """A round thing: centre and radius."""

    x: float
    y: float
    radius: float
    material: Material

    def __post_init__(self) -> None:
        if not 0 < self.radius <= 10:
            raise ValueError(f"the pole at ({self.x}, {self.y}) has radius {self.radius}; up to 10 m is round")


@dataclass(frozen=True)
class Raster:
    """The true map: `cells[row, column]` is UNKNOWN, FREE (reached from the start) or OCCUPIED (a surface runs in it).

    Cell (row, column) covers x from (left + column) · cell and y from (bottom + row) · cell, metres.
    """

    cell: float
    left: int
    bottom: int
    cells: NDArray[np.uint8]


@dataclass(frozen=True)
class World:
    """A place to drive in, named as `load_world` takes it; `tour` is the route that shows all of it."""

    name: str
    about: str
    tour: str
    walls: tuple[Wall, ...]
    poles: tuple[Pole, ...]

    def surfaces(self) -> Surfaces:
        """The truth a recording carries."""
        segments = np.array([(w.x0, w.y0, w.x1, w.y1) for w in self.walls], dtype=np.float64).reshape(-1, 4)
        poles = np.array([(p.x, p.y, p.radius) for p in self.poles], dtype=np.float64).reshape(-1, 3)
        return Surfaces(self.name, segments, poles)

    def raster(self, cell: float) -> Raster:
        """The true map in square cells of that many metres, one cell of margin around it."""
        points = [point for wall in self.walls for point in _along_wall(wall, cell / 8)]
        points += [point for pole in self.poles for point in _around_pole(pole, cell / 8)]
        occupied = {(floor(y / cell), floor(x / cell)) for x, y in points}
        rows, columns = [row for row, _ in occupied], [column for _, column in occupied]
        bottom, left = min(rows, default=0) - 1, min(columns, default=0) - 1
        shape = (max(rows, default=0) - bottom + 2, max(columns, default=0) - left + 2)
        cells = np.full(shape, UNKNOWN, dtype=np.uint8)
        for row, column in sorted(occupied):
            cells[row - bottom, column - left] = OCCUPIED
        _flood(cells, -bottom, -left)
        return Raster(cell, left, bottom, cells)


def _along_wall(wall: Wall, step: float) -> list[tuple[float, float]]:
    count = max(1, ceil(wall.length / step))
    return [
        (wall.x0 + (wall.x1 - wall.x0) * i / count, wall.y0 + (wall.y1 - wall.y0) * i / count) for i in range(count + 1)
    ]


def _around_pole(pole: Pole, step: float) -> list[tuple[float, float]]:
    """Points on its rim, by the rational parametrisation of a quarter circle, turned four times."""
    count = max(2, ceil(2 * pole.radius / step))
    quarter = [(i / count) for i in range(count)]
    rim = [((1 - t * t) / (1 + t * t) * pole.radius, 2 * t / (1 + t * t) * pole.radius) for t in quarter]
    turned = [p for x, y in rim for p in ((x, y), (-y, x), (-x, -y), (y, -x))]
    return [(pole.x + x, pole.y + y) for x, y in turned]


def _flood(cells: NDArray[np.uint8], row: int, column: int) -> None:
    """Mark FREE what is reached from that cell through sides, not corners (walls are drawn without diagonal gaps)."""
    queue = deque([(row, column)])
    while queue:
        r, c = queue.popleft()
        inside = 0 <= r < cells.shape[0] and 0 <= c < cells.shape[1]
        if inside and cells[r, c] == UNKNOWN:
            cells[r, c] = FREE
            queue.extend(((r + 1, c), (r - 1, c), (r, c + 1), (r, c - 1)))


def built_in() -> list[str]:
    """Names of the worlds that come with sonarlog."""
    folder = resources.files("sonarlog.sim") / "worlds"
    return sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml"))


def load_world(name: str) -> World:
    """A built-in world by name, a random one by `random:NUMBER`, or the one in the TOML file there. Raises BadWorld."""
    if name.startswith(RANDOM):
        return _random(name)
    if name in built_in():
        text = (resources.files("sonarlog.sim") / "worlds" / f"{name}.toml").read_text(encoding="utf-8")
    elif Path(name).suffix != ".toml":
        known = f"{', '.join(built_in())}, {RANDOM}NUMBER, or a file of yours, NAME.toml"
        raise BadWorld(f"there is no world {name!r}; known are {known}")
    else:
        try:
            text = Path(name).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise BadWorld(f"world file {name} cannot be read: {error}") from None
    return parse_world(Path(name).name, text)


def is_ours(name: str) -> bool:
    """Whether a world of that name is the same wherever sonarlog is."""
    return name in built_in() or re.fullmatch(f"{RANDOM}[0-9]{{1,9}}", name) is not None


def _random(name: str) -> World:
    from sonarlog.sim.random_world import random_world  # which is made of what stands here

    if not is_ours(name):
        raise BadWorld(f"there is no world {name!r}; a random one has a number, such as {RANDOM}7")
    return random_world(int(name.removeprefix(RANDOM)))


def parse_world(name: str, text: str) -> World:
    """The world that this TOML describes (docs/simulator.md). Raises BadWorld saying what is wrong."""
    try:
        data = tomllib.loads(text)
        materials = {key: Material(**value) for key, value in data.get("materials", {}).items()}
        walls = tuple(wall for entry in data.get("walls", []) for wall in _walls(entry, materials))
        poles = tuple(_pole(entry, materials) for entry in data.get("poles", []))
        world = World(name, str(data.get("about", "")), str(data.get("tour", "")), walls, poles)
    except KeyError as error:
        raise BadWorld(f"world {name}: there is no {error}") from None
    except (tomllib.TOMLDecodeError, TypeError, ValueError, AttributeError) as error:
        raise BadWorld(f"world {name}: {error}") from None
    unknown = set(data) - {"about", "tour", "materials", "walls", "poles"}
    if unknown:
        raise BadWorld(f"world {name}: unknown key {min(unknown)!r}; known are about, tour, materials, walls, poles")
    return world


def _walls(entry: dict[str, Any], materials: dict[str, Material]) -> list[Wall]:
    """The pieces of one polyline."""
    unknown = set(entry) - {"material", "points", "closed"}
    if unknown:
        raise ValueError(f"a wall has no {min(unknown)!r}; it has material, points, closed")
    points = [(float(x), float(y)) for x, y in entry["points"]]
    if entry.get("closed", False):
        points.append(points[0])
    if len(points) < 2:
        raise ValueError("a wall needs at least two points")
    material = materials[entry["material"]]
    return [Wall(*a, *b, material) for a, b in pairwise(points)]


def _pole(entry: dict[str, Any], materials: dict[str, Material]) -> Pole:
    known = {key: value for key, value in entry.items() if key != "material"}
    return Pole(**known, material=materials[entry["material"]])
