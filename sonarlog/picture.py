"""Pictures of maps, one panel a run, as in the paper's Fig. 12: unknown grey, free white, occupied black.

Every panel has the same scale and shows the same part of the plane, so that what differs stands out. Must not know:
runs, recordings, algorithms.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from slam.geometry import ORIGIN, Pose, Segment
from slam.grid import Cells, Grid
from sonarlog.changes import CHANGES, A, B, change_pixels
from sonarlog.errors import SonarlogError
from sonarlog.legend import ROW_PX, Sign, draw_legend, in_rows
from sonarlog.log import Floats, Surfaces

# Colours that people who see no red or no green can tell apart (Okabe and Ito, 2008).
GREEN, BLUE, ORANGE, VERMILLION, PURPLE = (0, 158, 115), (0, 114, 178), (230, 159, 0), (213, 94, 0), (204, 121, 167)
UNKNOWN, FREE, OCCUPIED, INK, FAINT = 205, 255, 0, (30, 30, 30), (110, 110, 110)

WIDTH_PX, HEIGHT_PX = 1800, 1300
SMOOTH = 3
"""Lines are drawn so many times larger and scaled down."""
LARGEST_CELL_PX = 12
MARGIN_M = 0.3
TITLE_PX, GAP_PX, DOTS_PX, DASH_PX = 34, 14, 7, 8

Pixels = NDArray[np.uint8]
Colour = tuple[int, int, int]


class CannotDraw(SonarlogError):
    """A picture that cannot be made or written."""


@dataclass(frozen=True)
class Panel:
    """One map with what was known and found there, all in the map's frame, metres.

    `path` and `odometry` are (n, 2); `surfaces` the true ones, `walls` pieces of wall with the number of their chain.
    `lay` puts the map's frame on the picture's. With a map `before`, what changed since then is drawn.
    """

    title: str
    grid: Grid
    path: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    odometry: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    surfaces: Surfaces | None = None
    walls: Sequence[tuple[int, Segment]] = ()
    lay: Pose = ORIGIN
    before: "Panel | None" = None


@dataclass(frozen=True)
class Window:
    """The rectangle of the plane that is shown: turned by `angle` rad, its corner (x, y) m there, and its scale."""

    angle: float
    left: float
    bottom: float
    width: float
    height: float
    pixels_per_m: float

    @property
    def size(self) -> tuple[int, int]:
        """Pixels of a panel without its title."""
        return round(self.width * self.pixels_per_m), round(self.height * self.pixels_per_m)

    def pixels(self, points: Floats) -> list[tuple[float, float]]:
        """Points (n, 2) m of the map as pixels of the smooth layer, y down."""
        turned = _turned(points, -self.angle)
        scale = self.pixels_per_m * SMOOTH
        x, y = (turned[:, 0] - self.left) * scale, (self.bottom + self.height - turned[:, 1]) * scale
        return list(zip(x.tolist(), y.tolist(), strict=True))

    def cells(self, grid: Grid, lay: Pose = ORIGIN) -> Cells:
        """The log-odds under each pixel, (height, width), of a grid that `lay` puts on the picture's frame."""
        width, height = self.size
        x = self.left + (np.arange(width) + 0.5) / self.pixels_per_m
        y = self.bottom + self.height - (np.arange(height) + 0.5) / self.pixels_per_m
        places = _turned(np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2), self.angle)
        at = np.floor(lay.step_to(ORIGIN).points(places) / grid.cell_m)
        cells, left, bottom = grid.dense()
        padded = np.pad(cells, 1)  # beyond the grid all is unknown
        column = np.clip(at[:, 0] - left + 1, 0, padded.shape[1] - 1).astype(np.int64)
        row = np.clip(at[:, 1] - bottom + 1, 0, padded.shape[0] - 1).astype(np.int64)
        return np.asarray(padded[row, column].reshape(height, width))


def _turned(points: Floats, angle: float) -> Floats:
    sine, cosine = np.sin(angle), np.cos(angle)
    return np.asarray(points @ np.array([[cosine, sine], [-sine, cosine]]))


def states(grid: Grid, cells: Cells) -> Pixels:
    """Unknown, free and occupied as 0, 1 and 2, rows as they came."""
    return np.where(grid.occupied(cells), 2, np.where(grid.free(cells), 1, 0)).astype(np.uint8)


def shades(grid: Grid, cells: Cells) -> Pixels:
    """Unknown, free and occupied as grey levels, rows as they came."""
    return np.where(grid.occupied(cells), OCCUPIED, np.where(grid.free(cells), FREE, UNKNOWN)).astype(np.uint8)


def check_free(path: Path | str, *, force: bool) -> None:
    """Raise CannotDraw if a picture there would overwrite something and `force` is not given."""
    if Path(path).exists() and not force:
        raise CannotDraw(f"{path} exists and is not overwritten: name another file, or give --force")


def draw_maps(panels: Sequence[Panel], path: Path | str, *, force: bool = False) -> tuple[int, int]:
    """Write the panels side by side, or one above the other where that fills the picture better.

    Returns the picture's size in pixels. Raises CannotDraw if there is nothing to draw, if the file exists and `force`
    is not given, or if it cannot be written.
    """
    check_free(path, force=force)
    columns, window = _layout(panels)
    drawn = [_draw(panel, window) for panel in panels]
    rows = -(-len(drawn) // columns)
    width, height = drawn[0].size
    below = rows * (height + GAP_PX) + GAP_PX
    whole = columns * (width + GAP_PX) + GAP_PX
    legend = in_rows(_signs(panels), whole - GAP_PX)
    sheet = Image.new("RGB", (whole, below + ROW_PX * len(legend)), "white")
    for k, panel in enumerate(drawn):
        sheet.paste(panel, (GAP_PX + k % columns * (width + GAP_PX), GAP_PX + k // columns * (height + GAP_PX)))
    draw_legend(sheet, legend, GAP_PX, below)
    try:
        sheet.save(path, format="PNG")
    except OSError as error:
        raise CannotDraw(f"cannot write the picture {path}: {error.strerror or error}") from None
    return sheet.size


def _layout(panels: Sequence[Panel]) -> tuple[int, Window]:
    """How many panels stand side by side, and the window that all share: the layout with the largest scale wins."""
    if not panels:
        raise CannotDraw("there is no map to draw")
    points = np.concatenate([_extent(panel) for panel in panels])
    if len(points) == 0:
        raise CannotDraw("the maps are empty: there is nothing to draw")
    angle = _upright(panels)
    turned = _turned(points, -angle)
    low, high = turned.min(axis=0) - MARGIN_M, turned.max(axis=0) + MARGIN_M
    width, height = (high - low).tolist()
    best = (0.0, 1)
    for columns in range(1, len(panels) + 1):
        rows = -(-len(panels) // columns)
        fit = min(WIDTH_PX / (columns * width), (HEIGHT_PX - rows * TITLE_PX) / (rows * height))
        best = max(best, (fit, columns))
    scale = min(best[0], LARGEST_CELL_PX / min(panel.grid.cell_m for panel in panels))
    return best[1], Window(angle, float(low[0]), float(low[1]), width, height, scale)


def _upright(panels: Sequence[Panel]) -> float:
    """The direction that lies level: by the true surfaces where they are known, else by what is occupied."""
    known = [panel.surfaces.segments.reshape(-1, 2) for panel in panels if panel.surfaces is not None]
    points = known[0] if known else np.concatenate([_cells_of(panel, free=False) for panel in panels])
    return level(points, panels[0].path)


def level(points: Floats, path: Floats) -> float:
    """The direction (rad) that lies level in a picture: that of the tightest box around `points` (n, 2).

    The `path` (m, 2) leads to the right.
    """
    if len(points) < 2:
        return 0.0
    angles = np.radians(np.arange(0.0, 180.0, 0.5))
    boxes = [np.ptp(_turned(points, -angle), axis=0) for angle in angles]
    best = min(range(len(angles)), key=lambda k: (round(float(boxes[k][0] * boxes[k][1]), 3), -float(boxes[k][0])))
    backwards = len(path) > 1 and float(_turned(path[-1:] - path[:1], -float(angles[best]))[0, 0]) < 0
    return float(angles[best]) + (np.pi if backwards else 0.0)


def _extent(panel: Panel) -> Floats:
    """Points (n, 2) that a picture has to show."""
    true = panel.surfaces.segments.reshape(-1, 2) if panel.surfaces else np.zeros((0, 2))
    seen = np.concatenate([_cells_of(panel, free=True), panel.path, panel.odometry])
    return np.concatenate([panel.lay.points(seen), true])


def _cells_of(panel: Panel, *, free: bool) -> Floats:
    """Centres (n, 2) m of the occupied cells, and of the free ones too."""
    cells, left, bottom = panel.grid.dense()
    chosen = panel.grid.occupied(cells) | (panel.grid.free(cells) & free)
    rows, columns = np.nonzero(chosen)
    return np.column_stack([columns + left + 0.5, rows + bottom + 0.5]) * panel.grid.cell_m


def _draw(panel: Panel, window: Window) -> Image.Image:
    body = _body(panel, window)
    layer = Image.new("RGBA", (body.width * SMOOTH, body.height * SMOOTH), (0, 0, 0, 0))
    pen = ImageDraw.Draw(layer)
    for chain, wall in panel.walls:
        _line(pen, window.pixels(panel.lay.points(np.array([wall.start, wall.end]))), chain_colour(chain), 4)
    if panel.surfaces is not None:
        _dotted(pen, panel.surfaces, window)
    _line(pen, window.pixels(panel.lay.points(panel.odometry)), FAINT, 1.5)
    path = window.pixels(panel.lay.points(panel.path))
    if panel.before is not None:
        _dashes(pen, window.pixels(panel.before.lay.points(panel.before.path)), A, 2.5)
    _line(pen, path, GREEN if panel.before is None else B, 2.5)
    for point in path[:1]:
        _dot(pen, point, GREEN if panel.before is None else B, 5)
    small = layer.reduce(SMOOTH)
    body.paste(small, (0, 0), small)
    _scale_bar(ImageDraw.Draw(body), window)
    titled = Image.new("RGB", (body.width, body.height + TITLE_PX), "white")
    titled.paste(body, (0, TITLE_PX))
    ImageDraw.Draw(titled).text((2, 4), panel.title, fill=INK, font=ImageFont.load_default(size=20))
    return titled


def _body(panel: Panel, window: Window) -> Image.Image:
    """The map's cells, or what changed in them since the map before."""
    cells = window.cells(panel.grid, panel.lay)
    if panel.before is None:
        return Image.fromarray(shades(panel.grid, cells)).convert("RGB")
    grid = panel.before.grid
    before = states(grid, window.cells(grid, panel.before.lay))
    return Image.fromarray(change_pixels(3 * before + states(panel.grid, cells)))


def chain_colour(chain: int) -> Colour:
    """A colour for a chain; neighbours in number differ most (Paul Tol's muted scheme)."""
    palette = ((51, 34, 136), (204, 102, 119), (17, 119, 51), (136, 204, 238), (136, 34, 85),
               (221, 204, 119), (68, 170, 153), (170, 68, 153), (153, 153, 51))  # fmt: skip
    return palette[chain % len(palette)]


def _line(pen: ImageDraw.ImageDraw, points: list[tuple[float, float]], colour: Colour, width: float) -> None:
    if len(points) > 1:
        pen.line(points, fill=(*colour, 255), width=round(width * SMOOTH), joint="curve")


def _dashes(pen: ImageDraw.ImageDraw, points: list[tuple[float, float]], colour: Colour, width: float) -> None:
    corners = np.array(points).reshape(-1, 2)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    for begin in np.arange(0.0, along[-1], 2 * DASH_PX * SMOOTH):
        ends = np.array([begin, min(begin + DASH_PX * SMOOTH, along[-1])])
        x, y = (np.interp(ends, along, corners[:, axis]) for axis in (0, 1))
        _line(pen, list(zip(x.tolist(), y.tolist(), strict=True)), colour, width)


def _dot(pen: ImageDraw.ImageDraw, point: tuple[float, float], colour: Colour, radius: float) -> None:
    (x, y), reach = point, radius * SMOOTH
    pen.ellipse((x - reach, y - reach, x + reach, y + reach), fill=(*colour, 255))


def _dotted(pen: ImageDraw.ImageDraw, surfaces: Surfaces, window: Window) -> None:
    """The true surfaces as dots of one size and distance."""
    for start, end in (np.array(window.pixels(wall.reshape(2, 2))) for wall in surfaces.segments):
        count = max(1, round(float(np.hypot(*(end - start))) / (DOTS_PX * SMOOTH)))
        for k in range(count + 1):
            x, y = (start + (end - start) * k / count).tolist()
            _dot(pen, (x, y), VERMILLION, 1.7)
    for x, y, size in surfaces.poles.tolist():
        ((px, py),) = window.pixels(np.array([[x, y]]))
        reach = size * window.pixels_per_m * SMOOTH
        pen.ellipse((px - reach, py - reach, px + reach, py + reach), outline=(*VERMILLION, 255), width=2 * SMOOTH)


def _scale_bar(pen: ImageDraw.ImageDraw, window: Window) -> None:
    """A bar of a round number of metres in the lower right corner."""
    width, height = window.size
    metres = max((m for m in (1, 2, 5, 10, 20, 50) if m * window.pixels_per_m <= width / 4), default=1)
    x1, y = width - 12, height - 12
    x0 = x1 - round(metres * window.pixels_per_m)
    pen.line([(x0, y - 5), (x0, y), (x1, y), (x1, y - 5)], fill=INK, width=2)
    pen.text(((x0 + x1) / 2, y - 4), f"{metres} m", fill=INK, font=ImageFont.load_default(size=16), anchor="mb")


def _signs(panels: Sequence[Panel]) -> list[Sign]:
    """What has to be explained, of what is there."""
    changes = any(panel.before for panel in panels)
    single = any(panel.before is None and len(panel.path) for panel in panels)
    told = (
        (single, Sign("path, from the dot on", GREEN)),
        (any(len(panel.odometry) for panel in panels), Sign("raw odometry", FAINT)),
        (any(panel.walls for panel in panels), Sign("walls, a colour a chain", chain_colour(0))),
        (any(panel.surfaces for panel in panels), Sign("true walls", VERMILLION, "dots")),
        (changes, Sign("path of A", A, "dashes")),
        (changes, Sign("path of B", B)),
        *((changes, Sign(change.name, change.ground, change=change)) for change in CHANGES),
    )
    return [sign for there, sign in told if there]
