"""How near to the truth each algorithm comes: worlds × seeds × algorithms, medians as ratios to raw odometry.

    python -m benchmarks.accuracy                      # corridor and bend, seeds 1 to 5
    python -m benchmarks.accuracy --worlds loop,office --seeds 20

Recordings of the embedded robot are made in a temporary folder; office and clutter are driven by their tours.
"""

import argparse
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from slam.algorithms import ALGORITHMS, algorithm
from sonarlog.replay import replay
from sonarlog.runs import read_run
from sonarlog.scores import score, wall_straightness
from sonarlog.sim.world import load_world

BY_TOUR = ("office", "clutter")
"""Places that `follow` alone does not see all of."""


@dataclass(frozen=True)
class Result:
    """One replay: errors in metres and degrees, the largest bend of a long wall in metres, shares of the map."""

    world: str
    seed: int
    algorithm: str
    ate_m: float
    ate_ratio: float
    heading_deg: float
    heading_ratio: float
    bent_m: float
    occupied_true: float
    surface_mapped: float
    free_true: float


def one(job: tuple[str, int]) -> list[Result]:
    """Record one world with one seed, replay it with every algorithm."""
    world, seed = job
    with tempfile.TemporaryDirectory() as folder:
        recording = Path(folder) / "recording.mcap"
        route = ["--route", load_world(world).tour] if world in BY_TOUR else []
        port = f"sim://{world}?seed={seed}"
        command = [sys.executable, "-m", "cli", "record", "--port", port, "--lean", "-q", "-o", str(recording), *route]
        subprocess.run(command, check=True, capture_output=True)
        return [_replayed(recording, world, seed, name) for name in ALGORITHMS]


def _replayed(recording: Path, world: str, seed: int, name: str) -> Result:
    output = recording.with_name(f"{name}.run.mcap")
    replay(recording, algorithm(name), output)
    run = read_run(output)
    scores = score(run)
    if scores is None or scores.map is None:
        raise SystemExit(f"{recording} has no truth to be judged by")
    path, raw, quality = scores.path, scores.odometry, scores.map
    return Result(
        world=world,
        seed=seed,
        algorithm=name,
        ate_m=path.ate_m,
        ate_ratio=path.ate_m / raw.ate_m,
        heading_deg=path.heading_rmse_deg,
        heading_ratio=path.heading_rmse_deg / raw.heading_rmse_deg,
        bent_m=max((wall.deviation_m for wall in wall_straightness(run)), default=0.0),
        occupied_true=quality.occupied_true or 0.0,
        surface_mapped=quality.surface_mapped or 0.0,
        free_true=quality.free_true or 0.0,
    )


def table(results: Sequence[Result], seeds: int) -> str:
    """Medians by world and algorithm, as a Markdown table; ratios with their worst seed."""
    lines = [
        f"Medians over {seeds} seeds; ratios are to raw odometry of the same recording, the worst in parentheses.\n",
        "| world | algorithm | ATE | ratio | heading RMSE | ratio | longest walls bent by | occupied true "
        "| surface mapped | free true |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for world in dict.fromkeys(result.world for result in results):
        for name in ALGORITHMS:
            rows = [r for r in results if (r.world, r.algorithm) == (world, name)]

            def middle(attribute: str, rows: list[Result] = rows) -> float:
                return float(statistics.median(getattr(row, attribute) for row in rows))

            lines.append(
                f"| {world} | {name} | {middle('ate_m'):.2f} m "
                f"| {middle('ate_ratio'):.2f} ({max(r.ate_ratio for r in rows):.2f}) "
                f"| {middle('heading_deg'):.2f}° "
                f"| {middle('heading_ratio'):.2f} ({max(r.heading_ratio for r in rows):.2f}) "
                f"| {100 * middle('bent_m'):.0f} cm | {100 * middle('occupied_true'):.0f} % "
                f"| {100 * middle('surface_mapped'):.0f} % | {100 * middle('free_true'):.0f} % |"
            )
    return "\n".join(lines)


def main() -> None:
    """Run the jobs on all processors and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--worlds", default="corridor,bend")
    parser.add_argument("--seeds", type=int, default=5)
    options = parser.parse_args()
    jobs = [(world, seed) for world in options.worlds.split(",") for seed in range(1, options.seeds + 1)]
    results: list[Result] = []
    with ProcessPoolExecutor() as pool:
        for job, found in zip(jobs, pool.map(one, jobs), strict=True):
            print(f"{job[0]}, seed {job[1]}", file=sys.stderr)
            results += found
    print(table(results, options.seeds))


if __name__ == "__main__":
    main()
