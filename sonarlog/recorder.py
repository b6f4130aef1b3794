"""The recorder: the loop that owns the clock, between the line to the robot and the file.

Every byte goes to `/wire` before anything is made of it. On every way out the robot is stopped and closed.
Must not know: ports, terminals, signals (a function says when to stop).
"""

from collections.abc import Callable
from dataclasses import dataclass

from sonarlog.decode import Sample, WireDecoder, true_pose
from sonarlog.drive import Driver
from sonarlog.errors import SonarlogError
from sonarlog.log import Event
from sonarlog.protocol.packets import ConfigPacket, SimStat, Sip, Sync
from sonarlog.recording import RecordingWriter
from sonarlog.robot import Robot, built_in, load_robot
from sonarlog.route import Route
from sonarlog.session import Identity, Session
from sonarlog.transport import Link

SECOND = 1_000_000_000
POLL_S = 0.05  # how long a read may wait before it is looked whether anything else is due
DEFAULT_ROBOT = "amigo-sh"


@dataclass(frozen=True)
class Status:
    """How the recording is going: counts since the start, SIPs a second since the status before (robot time)."""

    t_ns: int
    sips: int
    sips_per_s: float
    sweeps: int
    readings: int
    bad_packets: int
    battery_volts: float | None


@dataclass(frozen=True)
class Plan:
    """What to record. `route` None: without moving. `robot` None: the one the robot says it is.

    `rate`: how much faster than real time a simulator at the port runs; 1 for everything real.
    """

    route: Route | None = None
    robot: Robot | None = None
    speed_mm_s: float = 300.0
    limit_ns: int | None = None
    rate: float = 1.0

    @property
    def patience_ns(self) -> int:
        """A second of real time, in robot time: how long an answer may take."""
        return int(SECOND * max(1.0, self.rate))


class Recorder:
    """One recording: `run` connects, drives, records and leaves the robot closed."""

    def __init__(
        self,
        link: Link,
        writer: RecordingWriter,
        plan: Plan,
        *,
        wall_ns: Callable[[], int],
        report: Callable[[Status], None] = lambda _status: None,
        tell: Callable[[Event], None] = lambda _event: None,
    ) -> None:
        """`wall_ns`: a monotonic clock of real time, for flushing; `report` hears the status ten times a second of it,
        `tell` every event at once.
        """
        self._link = link
        self._writer = writer
        self._plan = plan
        self._wall_ns = wall_ns
        self._report = report
        self._tell = tell
        self._robot = plan.robot or load_robot(DEFAULT_ROBOT)
        self._decoder = WireDecoder(self._robot)
        self._session = Session(drive=plan.route is not None, patience_ns=plan.patience_ns)
        self._driver: Driver | None = None
        self._identified: Identity | None = None
        self._bad_told = 0
        self._volts: float | None = None
        self._reported = (0, 0)  # robot time and SIPs at the last status

    @property
    def heard(self) -> bool:
        """Whether any byte came back."""
        return self._decoder.counts.total() > 0

    def run(self, stop: Callable[[], bool]) -> Status:
        """Record until the route is done, the limit is reached or `stop` says so; the last status.

        Raises NoAnswer, RobotSilent, LinkLost, CannotWrite; the robot is stopped first wherever it can be reached.
        """
        try:
            self._loop(stop)
        finally:
            self._leave()
        return self.status()

    def status(self) -> Status:
        """How it is going."""
        now_ns, counts = self._link.now_ns(), self._decoder.counts
        before_ns, sips_before = self._reported
        rate = (counts["sips"] - sips_before) * SECOND / max(1, now_ns - before_ns)
        sweeps = self._driver.sweeps if self._driver else 0
        return Status(now_ns, counts["sips"], rate, sweeps, counts["readings"], counts["bad_packets"], self._volts)

    def _loop(self, stop: Callable[[], bool]) -> None:
        flushed_ns = reported_ns = self._wall_ns()
        while not stop() and not (self._driver and self._driver.finished):
            self._receive()
            now_ns = self._link.now_ns()
            if self._plan.limit_ns is not None and now_ns >= self._plan.limit_ns:
                self._event(Event(now_ns, "info", "the time is up"))
                return
            self._transmit(self._session.send(now_ns))
            self._pass_on(self._session.take_events())
            wall_ns = self._wall_ns()
            if wall_ns - flushed_ns >= SECOND:
                # A disk takes some 20 ms to be sure: nothing to a robot, a second to a simulator at 50 times its speed.
                self._writer.flush(fsync=self._plan.rate <= 1)
                flushed_ns = wall_ns
            if wall_ns - reported_ns >= SECOND // 10:
                status = self.status()
                self._report(status)
                self._reported, reported_ns = (status.t_ns, status.sips), wall_ns

    def _receive(self) -> None:
        data = self._link.read(POLL_S)
        if not data:
            return
        t_ns = self._link.now_ns()
        self._writer.wire(t_ns, "rx", data)
        for sample in self._decoder.feed(t_ns, data):
            self._take(sample)
        bad = self._decoder.counts["bad_packets"]
        if bad > self._bad_told:
            self._bad_told = bad
            self._event(Event(t_ns, "warn", f"sync lost: {bad} bad packets so far"))

    def _take(self, sample: Sample) -> None:
        self._session.receive(sample.t_ns, sample.packet)
        if sample.note:
            self._event(Event(sample.t_ns, "warn", sample.note))
        if isinstance(sample.packet, Sync | ConfigPacket):
            self._identify(sample.t_ns)
        elif isinstance(sample.packet, SimStat):
            self._writer.truth(sample.t_ns, *true_pose(sample.packet))
        elif isinstance(sample.packet, Sip) and self._identified:
            self._record_sip(sample, sample.packet)
            if self._driver and self._session.ready:
                self._transmit(self._driver.step(sample))
                self._pass_on(self._driver.take_events())

    def _record_sip(self, sample: Sample, sip: Sip) -> None:
        assert sample.pose is not None
        wheels = self._robot.velocity_mm_s_per_unit
        turn_rate = sip.extra("turn_rate")
        self._writer.odometry(
            sample.t_ns,
            *sample.pose,
            (sip.left + sip.right) / 2 * wheels,
            (turn_rate or 0) / 10 * 0.017453292519943295,
        )
        for reading in sample.readings:
            self._writer.reading(reading.t_ns, reading.sonar, reading.range_mm)
        if sample.readings:
            self._writer.points(sample.t_ns, sample.readings)
        tenths = sip.extra("battery_x10")
        self._volts = (tenths if tenths else sip.battery) / 10
        self._writer.battery(sample.t_ns, self._volts)

    def _identify(self, t_ns: int) -> None:
        """Write down who the robot is, once its name is known, and again with what its CONFIG packet adds."""
        identity = self._session.identity
        if identity is None:
            return
        known = {"name": identity.name, "class": identity.robot_class, "subclass": identity.subclass}
        if identity != self._identified:
            self._choose_robot(t_ns, identity)
            self._surfaces(identity)
        elif self._session.config is None:
            return
        if self._session.config is not None:
            known |= {key: str(self._session.config.get(key) or "") for key in ("serial", "version")}
        self._writer.identity(known, self._robot)
        self._identified = identity

    def _choose_robot(self, t_ns: int, identity: Identity) -> None:
        if self._plan.robot is None and identity.subclass.lower() in built_in():
            self._robot = load_robot(identity.subclass)
        elif self._plan.robot is None:
            text = f"robot type {identity.subclass!r} is not known: taken for {DEFAULT_ROBOT} (name yours with --robot)"
            self._event(Event(t_ns, "warn", text))
        self._decoder.robot = self._robot
        if self._plan.route is not None and self._driver is None:
            self._driver = Driver(self._plan.route, self._robot, speed_mm_s=self._plan.speed_mm_s)

    def _surfaces(self, identity: Identity) -> None:
        """The true surfaces, where our own simulator says that it is in a world we have."""
        if identity.world is not None:
            from sonarlog.sim import world

            if identity.world in world.built_in():
                self._writer.surfaces(world.load_world(identity.world).surfaces())

    def _transmit(self, data: bytes) -> None:
        if data:
            t_ns = self._link.now_ns()
            self._link.write(data)
            self._writer.wire(t_ns, "tx", data)

    def _pass_on(self, events: list[Event]) -> None:
        for event in events:
            self._event(event)

    def _event(self, event: Event) -> None:
        self._writer.event(event.t_ns, event.level, event.text)
        self._tell(event)

    def _leave(self) -> None:
        """Stop and close the robot, whatever the file says; keep what it still sends if the file takes it."""
        goodbye = self._session.leave()
        try:
            self._link.write(goodbye)
            t_ns = self._link.now_ns()
            if goodbye:
                self._writer.wire(t_ns, "tx", goodbye)
                self._writer.event(t_ns, "info", "the robot is stopped and closed")
            while self._link.now_ns() - t_ns < self._plan.patience_ns // 5:
                if data := self._link.read(POLL_S):
                    self._writer.wire(self._link.now_ns(), "rx", data)
        except (SonarlogError, ValueError):
            pass  # the line is gone, or the file has failed, and refuses everything from then on
        finally:
            self._link.close()
