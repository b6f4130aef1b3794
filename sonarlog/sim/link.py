"""The embedded robot at the end of a line in this very process: `sim://corridor?seed=1&speed=10`.

Robot time moves only while somebody reads, so what is recorded depends on nothing but the URL and the commands.
Must not know: packets, who listens.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any
from urllib.parse import parse_qsl, unquote

from sonarlog.errors import SonarlogError
from sonarlog.robot import load_robot
from sonarlog.sim.amigobot import AmigoBot
from sonarlog.sim.faults import LARGEST_MOUNTING_DEG, parse_faults, parse_kick
from sonarlog.sim.odometry import parse_errors
from sonarlog.sim.physics import Acoustics
from sonarlog.sim.world import load_world

SCHEME = "sim://"
_RANGES = {
    "speed": (0.0, 1e6),
    "noise": (0.0, 1000.0),
    "outliers": (0.0, 1.0),
    "mounting": (0.0, LARGEST_MOUNTING_DEG),
}
_SETTINGS: dict[str, Callable[[str], Any]] = {
    "seed": int,
    "speed": float,
    "odometry": str,
    "noise": float,
    "outliers": float,
    "robot": str,
    "mounting": float,
    "dead": str,
    "stuck": str,
    "kick": str,
}


class BadSimulation(SonarlogError):
    """A setting that the simulator does not have, or a value it cannot take."""


@dataclass(frozen=True)
class Simulation:
    """What to simulate, as the URL and the command line say it.

    noise: standard deviation of a range, mm. outliers: share of wild readings. odometry: see `parse_errors`.
    speed: how much faster than the clock the robot lives; 0 as fast as it can. mounting: how many degrees the sonars
    look past where they ought to; dead, stuck: see `parse_faults`; kick: see `parse_kick`.
    """

    world: str
    seed: int = 1
    speed: float = 0.0
    odometry: str = "1"
    noise: float = 10.0
    outliers: float = 0.04
    robot: str = "amigo-sh"
    mounting: float = 0.0
    dead: str = ""
    stuck: str = ""
    kick: str = ""

    def __post_init__(self) -> None:
        for name, (low, high) in _RANGES.items():
            value = getattr(self, name)
            if not low <= value <= high:
                raise BadSimulation(f"the simulator's {name} cannot be {value:g}; it goes from {low:g} to {high:g}")

    def build(self) -> AmigoBot:
        """The robot in its world. Raises BadWorld, BadRobot, BadOdometry, BadFault."""
        world = load_world(self.world)
        robot = load_robot(self.robot)
        acoustics = Acoustics(noise_m=self.noise / 1000, outliers=self.outliers, max_range_m=robot.max_range_mm / 1000)
        errors = parse_errors(self.odometry, self.seed)
        faults = parse_faults(
            self.mounting,
            self.dead,
            self.stuck,
            seed=self.seed,
            sonars=len(robot.sonars),
            max_range_mm=robot.max_range_mm,
        )
        return AmigoBot(
            world,
            seed=self.seed,
            robot=robot,
            errors=errors,
            acoustics=acoustics,
            faults=faults,
            kick=parse_kick(self.kick),
        )


def parse_url(url: str) -> Simulation:
    """From `sim://WORLD?key=value&…`, WORLD a name or the path of a file. Raises BadSimulation."""
    world, _, query = url.removeprefix(SCHEME).partition("?")
    settings: dict[str, Any] = {}
    for key, value in parse_qsl(query, keep_blank_values=True):
        if key not in _SETTINGS:
            raise BadSimulation(f"{url}: the simulator has no {key!r}; known are {', '.join(_SETTINGS)}")
        try:
            settings[key] = _SETTINGS[key](value)
        except ValueError:
            raise BadSimulation(f"{url}: {key} cannot be {value!r}; it is a number") from None
    return Simulation(unquote(world), **settings)


class SimLink:
    """A line to the embedded robot: the methods of `sonarlog.transport.Link`."""

    waits = True
    baud = None

    def __init__(
        self,
        robot: AmigoBot,
        *,
        speed: float,
        clock_ns: Callable[[], int],
        sleep: Callable[[float], None],
    ) -> None:
        self.robot = robot
        self._speed = speed
        self._clock_ns = clock_ns
        self._sleep = sleep
        self._start_ns = clock_ns()

    def read(self, timeout_s: float) -> bytes:
        """Let robot time run, in whole ticks, until bytes are there or so much of it has passed."""
        robot = self.robot
        end_ns = robot.now_ns + round(timeout_s * 1e9)
        while not robot.waiting and robot.now_ns < end_ns:
            robot.tick()
            self._pace()
        return robot.read()

    def write(self, data: bytes) -> None:
        """Taken at once: the robot acts on it in its next tick."""
        self.robot.write(data)

    def set_baud(self, baud: int) -> None:
        """There is none to set."""

    def close(self) -> None:
        """The client is gone; a robot that was left open stops."""
        self.robot.hang_up()

    def now_ns(self) -> int:
        """Robot time since the line was opened."""
        return self.robot.now_ns

    def _pace(self) -> None:
        if self._speed > 0:
            due_ns = self._start_ns + int(self.robot.now_ns / self._speed)
            ahead_ns = due_ns - self._clock_ns()
            if ahead_ns > 0:
                self._sleep(ahead_ns / 1e9)


def open_sim(
    url: str, clock_ns: Callable[[], int] = time.monotonic_ns, sleep: Callable[[float], None] = time.sleep
) -> SimLink:
    """The robot at that URL. Clock and sleep only pace it, where `speed` asks for that; they change no byte.

    Raises BadSimulation, BadWorld, BadRobot, BadOdometry, BadFault.
    """
    simulation = parse_url(url)
    return SimLink(simulation.build(), speed=simulation.speed, clock_ns=clock_ns, sleep=sleep)
