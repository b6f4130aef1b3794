"""How a recording of the bench is made, and the name that says so: same name, same bytes.

Must not know: what is done with the recording.
"""

import hashlib
import os
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from urllib.parse import quote

import sonarlog
from sonarlog.bench.conditions import Condition
from sonarlog.bench.routes import respaced, without_scans
from sonarlog.digest import digest
from sonarlog.recorder import SECOND, Plan, Recorder
from sonarlog.recording import RecordingWriter
from sonarlog.robot import DEFAULT_ROBOT, Robot, load_robot
from sonarlog.route import Route, default_route, parse_route
from sonarlog.sim.link import open_sim, parse_url
from sonarlog.sim.world import World

FOLLOWED = ("corridor", "bend", "loop")
"""Worlds that `follow` alone sees all of: recorded without a route, as `sonarlog record` does."""
SPACING_M, STATIONS = 0.8, 40
_LONGEST_NS = 4 * 3600 * SECOND
_MAKERS = (
    "sim/amigobot.py", "sim/body.py", "sim/corners.py", "sim/drive.py", "sim/faults.py", "sim/link.py",
    "sim/odometry.py", "sim/physics.py", "sim/reports.py", "sim/rng.py", "sim/sonars.py", "drive.py",
    "surroundings.py", "session.py",
)  # fmt: skip
"""Sources that a recording's bytes hang on, beside world, route and robot, whose content stands in the name itself."""


@dataclass(frozen=True)
class Recipe:
    """A port, a route, and the robot's file if it is none of the built-in ones."""

    world: World
    seed: int
    url: str
    route: Route
    robot: str | None

    @classmethod
    def of(cls, world: World, seed: int, condition: Condition) -> "Recipe":
        """For that world and seed under that condition."""
        robot = condition.robot_file()
        settings = {"seed": str(seed), **condition.settings_of(seed), **({"robot": robot} if robot else {})}
        query = "&".join(f"{key}={quote(value, safe='=,:/')}" for key, value in settings.items())
        return cls(world, seed, f"sim://{quote(world.name, safe=':/')}?{query}", _route(world, condition), robot)

    def name(self) -> str:
        """`corridor-7-` and a digest of all that its bytes hang on."""
        # The robot by what its file says, not by where that is; usual settings count the same, named or not.
        simulation = replace(parse_url(self.url), world=repr(self.world), robot=_robot_text(self.robot))
        made_of = (repr(simulation), repr(self.route), makers_digest())
        world = Path(self.world.name).stem.replace(":", "-")
        return f"{world}-{self.seed}-{digest(made_of)[:16]}"

    def make(self, path: Path) -> None:
        """Write the recording there, whole or not at all. Raises what recording raises."""
        part = path.with_name(f"{path.stem}.{os.getpid()}.part.mcap")
        plan = Plan(self.route, self._robot(), limit_ns=_LONGEST_NS)
        try:
            with RecordingWriter(
                part, started_wall_ns=0, command_line="sonarlog bench", config={"port": self.url}, lean=True, force=True
            ) as writer:
                # No clock: nothing in the recording hangs on how fast this machine is.
                Recorder(open_sim(self.url), writer, plan, wall_ns=lambda: 0).run(lambda: False)
            part.replace(path)
        finally:
            part.unlink(missing_ok=True)

    def _robot(self) -> Robot | None:
        return load_robot(self.robot) if self.robot else None


@cache
def makers_digest() -> str:
    """Digest of the sources that make a recording."""
    home = Path(sonarlog.__file__).parent
    files = [home / name for name in _MAKERS] + [home.parent / "slam" / "dmath.py"]
    state = hashlib.blake2b(digest_size=16)
    for file in files:
        state.update(file.read_bytes())
    return state.hexdigest()


def _robot_text(robot: str | None) -> str:
    file = Path(robot) if robot else Path(sonarlog.__file__).parent / "robots" / f"{DEFAULT_ROBOT}.toml"
    return file.read_text(encoding="utf-8")


def _route(world: World, condition: Condition) -> Route:
    if not condition.scans and world.tour:
        return without_scans(parse_route(world.tour))
    if world.name in FOLLOWED or not world.tour:
        spacing = condition.spacing or SPACING_M
        return default_route(spacing, round(STATIONS * SPACING_M / spacing))
    tour = parse_route(world.tour)
    return tour if condition.spacing in (None, SPACING_M) else respaced(tour, condition.spacing)
