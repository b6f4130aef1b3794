"""How a recording of the bench is made, and the name that says so: same name, same bytes.

Must not know: what is done with the recording.
"""

import hashlib
import os
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import cast
from urllib.parse import quote

import sonarlog
from slam.sweep import TURN
from sonarlog.bench import guide
from sonarlog.bench.conditions import Condition
from sonarlog.bench.guide import guided
from sonarlog.bench.routes import respaced, without_scans
from sonarlog.digest import digest
from sonarlog.plan import SECOND, Plan
from sonarlog.recorder import Recorder
from sonarlog.recording import RecordingWriter
from sonarlog.robot import DEFAULT_ROBOT, Robot, load_robot
from sonarlog.route import Route, default_route, parse_route
from sonarlog.sim.amigobot import AmigoBot
from sonarlog.sim.link import open_sim, parse_url
from sonarlog.sim.world import World, built_in

FOLLOWED = ("corridor", "bend", "loop")
"""Worlds that `follow` alone sees all of: recorded without a route, as `sonarlog record` does."""
SPACING_M, STATIONS = 0.8, 40
_LONGEST_NS = 4 * 3600 * SECOND
_MAKERS = (
    "sim/amigobot.py", "sim/body.py", "sim/corners.py", "sim/drive.py", "sim/faults.py", "sim/link.py",
    "sim/odometry.py", "sim/physics.py", "sim/reports.py", "sim/rng.py", "sim/sonars.py", "drive.py", "moves.py",
    "surroundings.py", "session.py",
)  # fmt: skip
"""Sources that a recording's bytes hang on, beside world, route and robot, whose content stands in the name itself."""


@dataclass(frozen=True)
class Recipe:
    """A port, a route, the robot's file if it is none of the built-in ones, and whether somebody guides it."""

    world: World
    seed: int
    url: str
    route: Route
    robot: str | None
    guided: bool

    @classmethod
    def of(cls, world: World, seed: int, condition: Condition, where: str = "") -> "Recipe":
        """For that world and seed under that condition; `where`: the path of a world that is a file."""
        robot = condition.robot_file()
        settings = {"seed": str(seed), **condition.settings_of(seed), **({"robot": robot} if robot else {})}
        query = "&".join(f"{key}={quote(value, safe='=,:/')}" for key, value in settings.items())
        url = f"sim://{quote(where or world.name, safe=':/')}?{query}"
        return cls(world, seed, url, _route(world, condition), robot, _is_guided(world, condition))

    def name(self) -> str:
        """`corridor-7-` and a digest of all that its bytes hang on."""
        # The robot by what its file says, not by where that is; usual settings count the same, named or not.
        simulation = replace(parse_url(self.url), world=repr(self.world), robot=_robot_text(self.robot))
        made_of = (repr(simulation), repr(self.route), makers_digest(), _guide_digest() if self.guided else "")
        world = Path(self.world.name).stem.replace(":", "-")
        return f"{world}-{self.seed}-{digest(made_of)[:16]}"

    def make(self, path: Path) -> None:
        """Write the recording there, whole or not at all. Raises what recording raises."""
        part = path.with_name(f"{path.stem}.{os.getpid()}.part.mcap")
        link = open_sim(self.url)
        # A guided route is made as it is driven: an iterator, which is all that a driver asks of a route.
        route = cast(Route, guided(self.route, partial(_where_is, link.robot))) if self.guided else self.route
        plan = Plan(route, self._robot(), limit_ns=_LONGEST_NS, surfaces=self.world.surfaces())
        try:
            with RecordingWriter(
                part, started_wall_ns=0, command_line="sonarlog bench", config={"port": self.url}, lean=True, force=True
            ) as writer:
                # No clock: nothing in the recording hangs on how fast this machine is.
                Recorder(link, writer, plan, wall_ns=lambda: 0).run(lambda: False)
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


def _where_is(robot: AmigoBot) -> tuple[float, float, float]:
    x_um, y_um, heading = robot.true_pose
    return x_um / 1e6, y_um / 1e6, heading * 360 / TURN


@cache
def _guide_digest() -> str:
    return hashlib.blake2b(Path(guide.__file__).read_bytes(), digest_size=16).hexdigest()


def _is_guided(world: World, condition: Condition) -> bool:
    """Where `follow` finds the way, nobody needs to; tours of other places than the built-in ones always come round."""
    by_tour = world.tour and (world.name not in FOLLOWED or not condition.scans)
    return bool(by_tour) and (condition.guided or world.name not in built_in())


def _route(world: World, condition: Condition) -> Route:
    if not condition.scans and world.tour:
        return without_scans(parse_route(world.tour))
    if world.name in FOLLOWED or not world.tour:
        spacing = condition.spacing or SPACING_M
        return default_route(spacing, round(STATIONS * SPACING_M / spacing))
    tour = parse_route(world.tour)
    return tour if condition.spacing in (None, SPACING_M) else respaced(tour, condition.spacing)
