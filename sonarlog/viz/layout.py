"""How an inspection is laid out, in plain values: views, what each shows, and how they stand together.

Must not know: Rerun, the algorithm.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from sonarlog.log import Floats
from sonarlog.picture import UNKNOWN
from sonarlog.viz.blocks import BLOCK_PATHS

HERE = "map/here/view"
"""The entity whose frame goes with the robot, upright."""

OVERVIEW, BLOCKS, NUMBERS = "Overview", "Blocks A to I, sweep by sweep", "Numbers over sweeps"


@dataclass(frozen=True)
class Plane:
    """A view of the map from above: what it shows (entity paths, `-` before what it leaves out), from `low` to `high`.

    Corners (x, y) m in the frame of `origin`, y upwards; None: as much as there is.
    """

    title: str
    contents: tuple[str, ...]
    origin: str = ""
    low: tuple[float, float] | None = None
    high: tuple[float, float] | None = None


@dataclass(frozen=True)
class Plot:
    """Numbers over sweeps: all below `origin`."""

    title: str
    origin: str
    legend_below: bool = False


@dataclass(frozen=True)
class Page:
    """A text, or with `events` a list of events."""

    title: str
    origin: str
    events: bool = False


@dataclass(frozen=True)
class Group:
    """Parts beside one another, one above the other, in a grid, or one at a time."""

    kind: Literal["row", "column", "grid", "tabs"]
    parts: "Sequence[Part]"
    shares: tuple[float, ...] = ()
    columns: int = 3
    title: str = ""
    active: int = 0


Part = Plane | Plot | Page | Group


@dataclass(frozen=True)
class Layout:
    """Everything that is to be seen, and the timeline it is seen along, of which a part may be marked."""

    whole: Part
    timeline: str
    following: bool = False
    selection: tuple[int, int] | None = None
    background: int = UNKNOWN


def replay_layout(low: Floats, high: Floats, reach_m: float, *, truth: bool, following: bool, tab: int = 0) -> Layout:
    """The layout of a replay: an overview, a view a block, all numbers; the map lies from `low` to `high`."""
    corner = (reach_m, reach_m)
    opposite = (-reach_m, -reach_m)
    the_map = Plane(
        "Map · green corrected path, grey raw odometry, dashed red true; a colour a chain; orange frontier",
        (
            "/map/**",
            *_without("ABCDEFG"),
            *LOOPS,
            "- /map/H_extension/patch",
            "- /map/chains/names",
            "- /map/I_decision/names",
        ),
        low=(float(low[0]), float(low[1])),
        high=(float(high[0]), float(high[1])),
    )
    near = Plane(
        "This sweep · readings ● in an RCD, + near one, × in none; walls found",
        ("/map/**", *_without("ABEFGI"), "- /map/chains/names", "- /map/C_reliability/names"),
        HERE, opposite, corner,
    )  # fmt: skip
    text = Page("What each block made of it", "blocks")
    errors = [
        Plot("Distance from the truth", "plots/error"),
        Plot("Heading off the truth", "plots/heading_error", True),
    ]
    plots = [
        Plot("B: rotation scale", "plots/calibration"),
        Plot("E: walls that joined, and new ones", "plots/walls"),
        Plot("F: turn found", "plots/turn"),
        Plot("F: shift found", "plots/shift"),
        Plot("F: mean distance to the roots", "plots/d1"),
        *(errors if truth else []),
    ]
    few = [plots[4], errors[0]] if truth else [plots[2], plots[4]]
    top = Group("row", (the_map, near), (5, 3))
    overview = Group("column", (top, Group("row", (text, *few), (4, 3, 3))), (3, 2), title=OVERVIEW)
    blocks = Group("grid", [_block(letter, opposite, corner) for letter in BLOCK_PATHS], title="")
    inside = Group("row", (blocks, text), (4, 1), title=BLOCKS)
    return Layout(
        Group("tabs", (overview, inside, Group("grid", plots, title=NUMBERS)), active=tab), "sweep", following
    )


TITLES = {
    "A": "A sensing · echoes by sonar, by raw odometry",
    "B": "B calibration · grey raw → blue calibrated",
    "C": "C reliability · ● in an RCD, + near, × alone",
    "D": "D features · walls thick, corners ◇, narrow thin",
    "E": "E association · arrow to the member joined",
    "F": "F localisation · dashed before, solid after; arrow ×10",
    "G": "G recomputed · grey before, blue after",
    "H": "H map · blue raised, chequered orange lowered",
    "I": "I decision · dots frontier, ◇ regions, × goal",
}
LOOPS = tuple(f"+ /map/F_localisation/{name}" for name in ("moved_x10", "loops", "loop_names"))
MAP, CHAINS = ("/map/H_extension/grid/**",), ("/map/chains/walls/**", "/map/chains/roots/**")
ALSO = {"E": (*MAP, *CHAINS), "F": MAP, "G": MAP, "H": ("/map/robot/corrected",), "I": (*MAP, "/map/path/corrected/**")}


def _block(letter: str, low: tuple[float, float], high: tuple[float, float]) -> Plane:
    return Plane(TITLES[letter], (f"/{BLOCK_PATHS[letter]}/**", *ALSO.get(letter, ())), HERE, low, high)


def _without(letters: str) -> tuple[str, ...]:
    return tuple(f"- /{BLOCK_PATHS[letter]}/**" for letter in letters)


def exploring_layout() -> Layout:
    """The layout of an exploration while it goes on."""
    events, volts = Page("Events", "events", events=True), Plot("Battery, V", "plots/battery")
    side = Group("column", (Page("What it decided, and why", "decision"), events, volts), (4, 3, 2))
    plane = Plane("The map as it grows · purple stations, orange frontier, × goal, red way, ◇ next scan", ("/map/**",))
    return Layout(Group("row", (plane, side), (5, 2)), "time", following=True)


def live_layout() -> Layout:
    """The layout of a recording while it is made."""
    side = Group("column", (Page("Events", "events", events=True), Plot("Battery, V", "plots/battery")))
    plane = Plane("Echoes where odometry puts them", ("/map/**",))
    return Layout(Group("row", (plane, side), (3, 1)), "time", following=True)
