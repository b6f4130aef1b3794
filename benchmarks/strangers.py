"""Places and robots that nothing was chosen by: ways of other widths, bends of any angle, pillars, glass, furniture.

`python -m benchmarks.strangers FOLDER [--places hall,bend] [--seeds 1-5] [--algorithms paper,graph] [--jobs 2]` draws
them from the parameters below as world files, and runs the bench over them; the table is that of docs/accuracy.md.
What FOLDER has already is not done again. `--places` takes beginnings of names. Must not know: how a bench is run.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from slam.algorithms import ALGORITHMS
from sonarlog.bench.conduct import Bench
from sonarlog.bench.plan import Contender, Plan, numbers_of
from sonarlog.bench.results import Group, Results
from sonarlog.sim.outline import Leg, Outline, box, closed, laid, niche, pane, ring, strip
from sonarlog.sim.random_tour import Tour, Visit

MATERIALS = """[materials]
plaster = { half_beam_deg = 14.0 }
wood = { half_beam_deg = 13.0 }
post = { half_beam_deg = 9.0, echo = 0.9 }
glass = { half_beam_deg = 5.0, echo = 0.8 }
pane = { half_beam_deg = 12.5, echo = 0.3 }
"""
ROUND = "repeat 2 (repeat 9 (scan; go 0.8); turn 90; repeat 3 (scan; go 0.8); turn 90); scan"
"""A tour of a hall, 7.2 by 2.4 m."""
SHOWN = {"occupied_true": "occupied true, %", "surface_mapped": "surface mapped, %", "free_true": "free true, %"}
CAP_M = 1.0
"""Behind the robot at the start, and before it at the end."""


@dataclass(frozen=True)
class Place:
    """Outlines, round pillars (x, y, radius), and the tour."""

    tour: str
    outlines: Sequence[Outline]
    poles: Sequence[tuple[float, float, float]] = ()

    def toml(self) -> str:
        """The world file."""
        edges = [edge for outline in self.outlines for edge in outline]
        walls = [f'[[walls]]\nmaterial = "{e.material}"\npoints = {[[*e.start], [*e.end]]}\n' for e in edges]
        poles = [f'[[poles]]\nx = {x}\ny = {y}\nradius = {r}\nmaterial = "post"\n' for x, y, r in self.poles]
        return "\n".join([f'tour = "{self.tour}"\n', MATERIALS, *walls, *poles])


def way(width: float, *turns: float, leg_m: float = 9.0, arm: bool = False, sort: str = "") -> Place:
    """A way with these bends; with an arm 5 m long to its left, or with panes of that sort in its longest walls."""
    half = width / 2
    stretches = laid([Leg(leg_m, half, half, turn) for turn in (*turns, 0.0)], CAP_M)
    visits = (Visit(leg_m / 2, 1, 3.6),) if arm else ()
    tour = Tour()
    for n, stretch in enumerate(stretches):
        last = stretch is stretches[-1]
        tour.along(stretch, 0.0 if n else CAP_M, leg_m - (CAP_M if last else 0.0), visits)
        if not last:
            tour.turn(stretch.leg.turn)
    outline = strip(stretches, "plaster")
    if arm:
        n = max(range(len(outline)), key=lambda k: outline[k].start[1] + outline[k].end[1])
        outline[n : n + 1] = niche(outline[n], leg_m / 2 - half, width, 5.0, "plaster")
    if sort:  # in the middle of every long wall, a third of it
        outline = [p for e in outline for p in (pane(e, e.length / 3, e.length / 3, sort) if e.length > 3.0 else [e])]
    return Place(f"{tour.text}; scan", [outline])


def hall(*squares: Outline, poles: Sequence[tuple[float, float, float]] = (), sort: str = "plaster") -> Place:
    """10 by 7 m; all walls but one of that sort."""
    walls = closed([(-1.0, -3.0), (9.0, -3.0), (9.0, 4.0), (-1.0, 4.0)], sort)
    return Place(ROUND, [[replace(walls[0], material="plaster"), *walls[1:]], *squares], poles)


def round_block(width: float, side_m: float, corners: int) -> Place:
    """Round a block with so many corners, and 3 m more."""
    half, turn = width / 2, 360 / corners
    stretches = laid([Leg(side_m, half, half, turn)] * corners, CAP_M + half)
    tour = Tour()
    for n, stretch in enumerate(stretches):
        tour.along(stretch, 0.0 if n else CAP_M + half, side_m)
        tour.turn(turn)
    tour.along(stretches[0], 0.0, 3.0)
    return Place(f"{tour.text}; scan", ring(stretches, "plaster"))


def room() -> Place:
    """6 by 5 m: a cupboard, a sofa, a table askew and its chair, a shelf, two lamps."""
    walls = closed([(-1.0, -1.0), (5.0, -1.0), (5.0, 4.0), (-1.0, 4.0)], "plaster")
    sizes = [(-0.7, 2.6, 0.5, 1.2, 0.0), (2.2, 3.65, 1.8, 0.6, 0.0), (2.0, 1.5, 1.2, 0.7, 20.0)]
    sizes += [(4.8, 1.0, 0.3, 1.4, 0.0), (2.9, 2.1, 0.4, 0.4, 55.0)]
    furniture = [box(x, y, (a, b), turned, "wood") for x, y, a, b, turned in sizes]
    tour = "repeat 2 (repeat 5 (scan; go 0.8); turn 90; repeat 3 (scan; go 0.9); turn 90); scan"
    return Place(tour, [walls, *furniture], [(4.7, 3.7, 0.05), (0.9, 2.2, 0.04)])


ROUND_PILLARS = [(x, y, 0.18) for x in (0.8, 3.2, 5.6) for y in (-1.4, 0.9, 3.1)]
SQUARE_PILLARS = [box(x, y, (0.4, 0.4), 15.0 * x, "plaster") for x in (0.8, 3.2, 5.6) for y in (-1.4, 1.1)]
PLACES = {
    **{f"way-{width:g}m": way(width, leg_m=18.0) for width in (1.2, 2.0, 3.0, 4.0)},
    **{f"bend-{abs(a):g}-{width:g}m": way(width, a) for a, width in ((30, 1.4), (-60, 1.8), (120, 2.4), (-90, 4))},
    "s-75-2m": way(2.0, 75.0, -75.0, leg_m=7.0),
    "t-2m": way(2.0, leg_m=13.0, arm=True),
    "block-of-4-1.4m": round_block(1.4, 6.0, 4),
    "block-of-3-3m": round_block(3.0, 10.0, 3),
    "hall-round": hall(poles=ROUND_PILLARS),
    "hall-square": hall(*SQUARE_PILLARS),
    "hall-glass": hall(poles=ROUND_PILLARS[:4], sort="glass"),
    "glass-40-2.4m": way(2.4, 40.0, sort="glass"),
    "panes-70-1.8m": way(1.8, -70.0, sort="pane"),
    "room": room(),
}  # fmt: skip
ROBOTS = {"bend-45-2m": way(2.0, 45.0), "hall-both": hall(*SQUARE_PILLARS[:3], poles=ROUND_PILLARS[5:])}
"""For other robots."""
OTHERS = ("robot-ring8", "robot-ring16", "robot-front8", "mounting-2")


def main() -> None:
    """Run them and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--places", default="")
    parser.add_argument("--seeds", default="1-3")
    parser.add_argument("--algorithms", default="paper,graph")
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    if not any(name.startswith(tuple(given.places.split(","))) for name in PLACES | ROBOTS):
        parser.error(f"no place begins like {given.places!r}; there are {', '.join(PLACES | ROBOTS)}")
    if unknown := [name for name in given.algorithms.split(",") if name not in ALGORITHMS]:
        parser.error(f"no algorithm {unknown[0]!r}; there are {', '.join(ALGORITHMS)}")
    (given.folder / "worlds").mkdir(parents=True, exist_ok=True)
    contenders = tuple(Contender(name, name) for name in given.algorithms.split(","))
    paths = " | ".join(f"`{each.label}`: of raw odometry | cm" for each in contenders)
    print(f"| place | {paths} | {' | '.join(SHOWN.values())} |\n|---{'|---:' * (2 * len(contenders) + 3)}|")
    for places, conditions in ((PLACES, ("plain",)), (ROBOTS, OTHERS)):
        names = [name for name in places if name.startswith(tuple(given.places.split(",")))]
        worlds = {name: str(given.folder / "worlds" / f"{name}.toml") for name in names}
        for name, world in worlds.items():
            Path(world).write_text(places[name].toml(), encoding="utf-8")
        plan = Plan(tuple(worlds.values()), numbers_of("seeds", given.seeds), conditions, contenders)
        results = Bench(plan, given.folder, given.jobs).results(lambda done, total: None)
        for name, world in worlds.items():
            for condition in conditions:
                print(line(name, world, condition, results), flush=True)


def line(name: str, world: str, condition: str, results: Results) -> str:
    """A place under a condition: each algorithm's path, and the last one's map; medians (and the worst)."""
    groups = [group for label in results.labels if (group := results.group(world, condition, label))]
    paths = [f"{_of(group, 'ate_m_ratio', 1, 2)} | {_of(group, 'ate_m', 100, 1)}" for group in groups]
    shares = [_of(groups[-1], name, 100, 0) for name in SHOWN]
    return f"| {name if condition == 'plain' else f'{name}, {condition}'} | {' | '.join(paths + shares)} |"


def _of(group: Group, name: str, factor: int, digits: int) -> str:
    spread = group.spreads.get(name)
    failed = f", {group.failed} failed" if group.failed else ""
    return f"{factor * spread.median:.{digits}f} ({factor * spread.worst:.{digits}f}{failed})" if spread else "–"


if __name__ == "__main__":
    main()
