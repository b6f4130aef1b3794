"""Explorations of small places by the embedded robot, whose packets a test may spoil on the way."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from slam.algorithms import algorithm
from sonarlog.check import check
from sonarlog.connection import Again
from sonarlog.exploring.explorer import Explorer, Limits
from sonarlog.log import Log
from sonarlog.plan import SECOND, Plan
from sonarlog.protocol.packets import Packet, Sip
from sonarlog.recorder import Recorder
from sonarlog.recording import RecordingWriter, read_log
from sonarlog.replay import replay
from sonarlog.robot import Robot
from sonarlog.sim.body import Body
from sonarlog.sim.link import SimLink, open_sim
from sonarlog.sim.physics import Acoustics, Physics
from sonarlog.sim.world import Wall, World, load_world
from sonarlog.transport import Link
from tests.test_recorder_line import Bench, Change

CHAMBER, HALL = (Path(__file__).parent / "data" / f"{name}.toml" for name in ("chamber", "hall"))
GRAPH = algorithm("graph")
QUICK = Limits(scan_deg_s=24.0)


def url(place: Path = HALL) -> str:
    return f"sim://{place}?seed=1"


def explore(
    path: Path, link: Link, limits: Limits = QUICK, place: Path = HALL, stop: Callable[[], bool] = lambda: False
) -> tuple[Explorer, Log]:
    made: list[Explorer] = []

    def explorer(robot: Robot) -> Explorer:
        made.append(Explorer(robot, GRAPH, limits))
        return made[0]

    with RecordingWriter(path, started_wall_ns=SECOND, command_line="test", config={}, force=True) as writer:
        plan = Plan(mover=explorer, recovers=True, rate=1.0001)
        again = Again(lambda: link, lambda _s: None)
        Recorder(link, writer, plan, wall_ns=link.now_ns, again=again).run(stop)
    return made[0], replace(read_log(path), surfaces=load_world(str(place)).surfaces())


def bench(change: Change = lambda packet: packet, place: Path = HALL) -> Bench:
    """The robot there, on a line that changes packets; a line that is closed can be opened again."""
    made = Bench(change=change)
    made._sim = open_sim(url(place))
    made.now_ns = made._sim.now_ns
    return made


def on_the_way(fault: Callable[[int, Sip], Packet | None]) -> Change:
    """From when the robot first drives at 10 cm/s on, what the fault makes of each SIP and its number since."""
    since = -1

    def change(packet: Packet) -> Packet | None:
        nonlocal since
        if not isinstance(packet, Sip) or (since < 0 and packet.left + packet.right <= 200):
            return packet
        since += 1
        return fault(since, packet)

    return change


def put(link: SimLink, wall: Wall) -> None:
    """It stands there from now on."""
    robot, world = link.robot, link.robot.world
    new = World(world.name, "", "", (*world.walls, wall), world.poles)
    body = robot._body
    other = Body(new, body._floor, body._radius)
    body._walls, body._poles, body._room = other._walls, other._poles, 0.0
    robot._sonars._physics = Physics(new, Acoustics(), 1)


def unsound(path: Path) -> str:
    """What is wrong with a recording: bytes that are not accounted for, decisions that a replay takes otherwise."""
    received, reproduced = check(path).received, replay(path, GRAPH, None).reproduced
    if received is None or not received.complete:
        return "bytes unaccounted for"
    return reproduced.told() if reproduced and not reproduced.same else "" if reproduced else "no decisions"


def texts(log: Log) -> list[str]:
    return [event.text for event in log.events]
