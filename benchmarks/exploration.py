"""Explorations of the embedded robot, measured: how much they map, how far they drive for it, what they touch.

`python -m benchmarks.exploration FOLDER [--worlds loop,office] [--seeds 1-10] [--jobs 2] [--tours]`: a line an
exploration, as JSON on stdout and in FOLDER, and a table on stderr: least, median and most over the seeds. With
`--tours` the fixed tour of each world and seed is measured the same way. What FOLDER has already of the same code is
not run again.
"""

import argparse
import json
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

import slam
import sonarlog
from slam.algorithms import DEFAULT, algorithm
from slam.geometry import ORIGIN
from sonarlog.exploring.coverage import mapped_share, reach_of, short_tour_m
from sonarlog.exploring.explorer import Explorer, Limits
from sonarlog.exploring.reproduction import Reproduction
from sonarlog.log import Log
from sonarlog.map_metrics import map_quality
from sonarlog.plan import Plan
from sonarlog.provenance import code_digest
from sonarlog.recorder import Recorder
from sonarlog.recording import RecordingWriter, read_log
from sonarlog.replay import replay_sweeps, sweeps_of, true_pose
from sonarlog.route import parse_route
from sonarlog.sim.world import load_world
from sonarlog.transport import open_link

WORLDS = "bend,loop,office,clutter"
LONGEST_NS = 7_200_000_000_000
TOUCH_M = 0.001
SHOWN = ("share", "metres", "of_bound", "scans", "clearance_m", "occupied_true", "surface_mapped", "free_true")


def main() -> None:
    """Run them and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="for recordings and results")
    parser.add_argument("--worlds", default=WORLDS)
    parser.add_argument("--seeds", default="1-3")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--tours", action="store_true")
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    first, _, last = given.seeds.partition("-")
    seeds = range(int(first), int(last or first) + 1)
    kinds = ("exploration", "tour") if given.tours else ("exploration",)
    asked = [(kind, world, seed) for world in given.worlds.split(",") for seed in seeds for kind in kinds]
    rows = []
    with ProcessPoolExecutor(given.jobs) as pool:
        for row in pool.map(partial(known_or_measured, given.folder), asked):
            rows.append(row)
            print(json.dumps(row), flush=True)
    table(rows)


def known_or_measured(folder: Path, asked: tuple[str, str, int]) -> dict[str, Any]:
    """What was measured before with the same code of `slam/` and `sonarlog/`, or now."""
    kind, world, seed = asked
    path = folder / f"{kind}-{world.replace(':', '-')}-{seed}.json"
    code = code_digest(slam) + code_digest(sonarlog)
    known = dict(json.loads(path.read_text())) if path.exists() else {}
    if known.get("code") != code:
        known = {**measured(folder, asked), "code": code}
        path.write_text(json.dumps(known))
    return known


def measured(folder: Path, asked: tuple[str, str, int]) -> dict[str, Any]:
    """One exploration, or one fixed tour, and all that is told of it."""
    kind, world, seed = asked
    path = folder / f"{kind}-{world.replace(':', '-')}-{seed}.mcap"
    began = time.monotonic()
    ended = _drive(path, kind, world, seed)
    took_s = time.monotonic() - began
    log = read_log(path)
    chosen = algorithm(DEFAULT)
    again = Reproduction(log.decisions, chosen)
    truth = []
    for step in replay_sweeps(log, sweeps_of(log, path), chosen):
        again.add(step)
        truth.append(true_pose(log.truth, int(step.sweep.t_ns[step.sweep.reference])))
    assert log.truth is not None
    assert log.surfaces is not None
    known = [pose for pose in truth if pose is not None]
    frame = known[0].compose(step.state.poses[0].step_to(ORIGIN))
    reach = reach_of(load_world(world), log.robot.radius_mm / 1000)
    bound_m = short_tour_m(reach)
    metres = float(np.hypot(*np.diff(log.truth.pose[:, :2], axis=0).T).sum())
    stations = np.array([(pose.x, pose.y) for pose in known])
    quality = map_quality(step.state.grid, log.surfaces, frame, stations)
    off = [np.hypot(a.x - b.x, a.y - b.y) for a, b in zip(map(frame.compose, step.state.poses), known, strict=True)]
    reproduced = again.result()
    clear_m = clearance_m(log)
    return {
        "kind": kind,
        "world": world,
        "seed": seed,
        "ended": ended,
        "share": round(mapped_share(step.state.grid, frame, reach), 4),
        "metres": round(metres, 1),
        "bound_m": round(bound_m, 1),
        "of_bound": round(metres / bound_m, 2),
        "scans": len(known),
        "robot_s": round(float(log.odometry.t_ns[-1]) / 1e9),
        "took_s": round(took_s, 1),
        "clearance_m": round(clear_m, 3),
        "touched": clear_m < log.robot.radius_mm / 1000 + TOUCH_M or any("stalled" in e.text for e in log.events),
        "ate_m": round(float(np.sqrt(np.mean(np.square(off)))), 3),
        "reproduced": reproduced is None or reproduced.other is None,
        **{name: value and round(value, 4) for name, value in vars(quality).items()},
    }


def _drive(path: Path, kind: str, world: str, seed: int) -> str:
    """Record it; why it ended."""
    made: list[Explorer] = []

    def explorer(robot: Any) -> Explorer:
        made.append(Explorer(robot, algorithm(DEFAULT), Limits()))
        return made[0]

    plan = Plan(mover=explorer, recovers=True) if kind == "exploration" else Plan(parse_route(load_world(world).tour))
    link = open_link(f"sim://{world}?seed={seed}", time.monotonic_ns)
    with RecordingWriter(path, started_wall_ns=0, command_line="", config={}, lean=True, force=True) as writer:
        Recorder(link, writer, plan, wall_ns=time.monotonic_ns).run(lambda: link.now_ns() > LONGEST_NS)
    return (made[0].ended or "it took too long") if made else "the tour is done"


def clearance_m(log: Log) -> float:
    """Nearest that the robot's centre came to a true surface."""
    assert log.truth is not None
    assert log.surfaces is not None
    nearest = np.inf
    begin, end = log.surfaces.segments[None, :, :2], log.surfaces.segments[None, :, 2:]
    along = end - begin
    for points in np.array_split(log.truth.pose[:, None, :2], 1 + len(log.truth.pose) // 5000):
        share = np.clip(((points - begin) * along).sum(-1) / (along**2).sum(-1), 0, 1)[..., None]
        nearest = min(nearest, float(np.hypot(*np.moveaxis(points - begin - share * along, -1, 0)).min()))
        if len(log.surfaces.poles):
            away = np.hypot(*np.moveaxis(points - log.surfaces.poles[None, :, :2], -1, 0)) - log.surfaces.poles[:, 2]
            nearest = min(nearest, float(away.min()))
    return nearest


def table(rows: list[dict[str, Any]]) -> None:
    """A line a world and kind: least / median / most over the seeds; how they ended, and how many touched something."""
    for world, kind in dict.fromkeys((row["world"], row["kind"]) for row in rows):
        mine = [row for row in rows if (row["world"], row["kind"]) == (world, kind)]
        words = [f"{world} {kind}: {len(mine)} runs, {sum(row['touched'] for row in mine)} touched something"]
        words += [f"{sum(not row['reproduced'] for row in mine)} not reproduced"]
        words += [f"{name} {_spread([row[name] for row in mine])}" for name in SHOWN]
        words += [f"{count} × {why}" for why, count in Counter(row["ended"] for row in mine).items()]
        print(", ".join(words), file=sys.stderr)


def _spread(values: list[float]) -> str:
    return " / ".join(f"{value:.3g}" for value in (min(values), median(values), max(values)))


if __name__ == "__main__":
    main()
