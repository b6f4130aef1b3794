"""The recorder: the loop that owns the clock, between the line to the robot and the file.

Every byte goes to `/wire` before anything is made of it. On every way out the robot is stopped and closed.
Must not know: ports, terminals, signals (a function says when to stop), disks (the scribe does).
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from sonarlog.connection import Again, Connection
from sonarlog.decode import Sample, WireDecoder
from sonarlog.drive import Driver
from sonarlog.errors import SonarlogError
from sonarlog.log import Event
from sonarlog.moves import Mover
from sonarlog.plan import SECOND, Plan
from sonarlog.protocol.commands import Command, encode_command
from sonarlog.protocol.packets import ConfigPacket, Sync
from sonarlog.recording import RecordingWriter
from sonarlog.robot import DEFAULT_ROBOT, Robot, built_in, load_robot
from sonarlog.scribe import HUNG_NS, Scribe, WriterHangs
from sonarlog.session import Identity, NoAnswer, RobotSilent, Session
from sonarlog.transcript import Transcript
from sonarlog.transport import Link, LinkLost

POLL_S = 0.05  # how long a read may wait before it is looked whether anything else is due
HOLD_NS = 2 * SECOND  # a disk so far behind, and the robot stands until it has caught up


class RouteHalted(SonarlogError):
    """Someone or something has stopped the robot."""

    def __init__(self, why: str, t_ns: int) -> None:
        super().__init__(
            f"the route is halted after {t_ns / SECOND:.1f} s: {why}; what was recorded up to there is kept"
        )


class SimulatorAnswers(SonarlogError):
    """A simulator, where a robot was asked for."""

    def __init__(self, name: str) -> None:
        super().__init__(f"a simulator answers at this port ({name}), not a robot; if that is meant, say so with --sim")


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


class Recorder:
    """One recording: `run` connects, drives, records and leaves the robot closed."""

    def __init__(
        self,
        link: Link,
        writer: RecordingWriter,
        plan: Plan,
        *,
        wall_ns: Callable[[], int],
        again: Again | None = None,
        report: Callable[[Status], None] = lambda _status: None,
        tell: Callable[[Event], None] = lambda _event: None,
        show: Callable[[Sample, Robot], None] = lambda _sample, _robot: None,
    ) -> None:
        """`wall_ns`: a monotonic clock of real time; `again`: how to come back to a lost robot. `report` hears the
        status ten times a second, `tell` every event at once, `show` every packet of a known robot; none may wait.
        """
        self._plan = plan
        self._wall_ns = wall_ns
        self._report = report
        self._tell = tell
        self._show = show
        self._robot = plan.robot or load_robot(DEFAULT_ROBOT)
        self._decoder = WireDecoder(self._robot)
        self._session = Session(drive=plan.drives, patience_ns=plan.patience_ns, recovers=plan.recovers)
        self._connection = Connection(link, self._session, wall_ns, again)
        self._scribe = Scribe(writer, wall_ns, waits=link.waits)
        self._transcript = Transcript(writer, self._scribe)
        self._driver: Mover | None = None
        self._identified: Identity | None = None
        self._held = False
        self._bad_told = 0
        self._reported = (0, 0)  # robot time and SIPs at the last status

    @property
    def heard(self) -> bool:
        """Whether any byte came back."""
        return self._decoder.counts.total() > 0

    def run(self, stop: Callable[[], bool]) -> Status:
        """Record until the route is done, the limit is reached or `stop` says so; the last status.

        Raises NoAnswer, RobotSilent, LinkLost, RouteHalted, SimulatorAnswers, CannotWrite, WriterHangs; the robot is
        stopped first wherever it can be reached.
        """
        try:
            self._event(Event(self._now_ns(), "info", "the recording begins"))
            self._loop(stop)
        finally:
            self._leave()
        self._scribe.close()
        return self.status()

    def status(self) -> Status:
        """How it is going."""
        now_ns, counts = self._now_ns(), self._decoder.counts
        before_ns, sips_before = self._reported
        rate = (counts["sips"] - sips_before) * SECOND / max(1, now_ns - before_ns)
        done = (self._driver.sweeps if self._driver else 0, counts["readings"], counts["bad_packets"])
        return Status(now_ns, counts["sips"], rate, *done, self._transcript.volts)

    def _now_ns(self) -> int:
        return self._connection.link.now_ns()

    def _loop(self, stop: Callable[[], bool]) -> None:
        reported_ns = self._wall_ns()
        while not stop() and not (self._driver and self._driver.finished):
            if self._time_is_up():
                self._event(Event(self._now_ns(), "info", "the time is up"))
                return
            try:
                self._turn()
            except (LinkLost, RobotSilent, NoAnswer) as error:
                self._pass_on(self._connection.take_events())
                try:
                    self._connection.recover(error, lambda: stop() or self._time_is_up())
                finally:
                    self._pass_on(self._connection.take_events())
            self._watch_disk()
            wall_ns = self._wall_ns()
            if wall_ns - reported_ns >= SECOND // 10:
                status = self.status()
                self._report(status)
                self._reported, reported_ns = (status.t_ns, status.sips), wall_ns

    def _time_is_up(self) -> bool:
        return self._plan.limit_ns is not None and self._now_ns() >= self._plan.limit_ns

    def _turn(self) -> None:
        """Once round: what has come, then what has to go."""
        self._receive()
        self._connection.note_open()
        self._transmit(self._session.send(self._now_ns()))
        if sent := self._connection.change_baud(robot_is_real=self._plan.rate == 1):
            self._transcript.wire(self._now_ns(), "tx", sent)
        self._pass_on(self._connection.take_events())
        if self._session.halted:
            raise RouteHalted(self._session.halted, self._now_ns())

    def _watch_disk(self) -> None:
        """The robot stands while the disk is behind: what it would do meanwhile might be lost."""
        behind_ns = self._scribe.behind_ns()
        if behind_ns > HUNG_NS:
            raise WriterHangs(behind_ns / SECOND)
        if behind_ns > HOLD_NS and not self._held:
            self._held = True
            self._transmit(encode_command(Command.STOP))
            self._event(Event(self._now_ns(), "error", "the disk does not keep up: the robot stands until it does"))
        elif self._held and behind_ns < HOLD_NS // 4:
            self._held = False
            self._event(Event(self._now_ns(), "warn", "the disk has caught up"))

    def _receive(self) -> None:
        data = self._connection.link.read(POLL_S)
        t_ns = self._now_ns()
        self._transmit(self._session.wake(t_ns))
        if not data:
            return
        self._transcript.wire(t_ns, "rx", data)
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
        self._transcript.sample(sample)
        if self._identified:
            self._show(sample, self._robot)
        if self._driver:
            self._driver.hear(sample)
            if self._session.ready and not self._held and sample.pose is not None:
                self._transmit(self._driver.step(sample))
                self._pass_on(self._driver.take_events())
                for decided in self._driver.take_decisions():
                    self._transcript.decision(decided)

    def _identify(self, t_ns: int) -> None:
        """Write down who the robot is, once its name is known, and again with what its CONFIG packet adds."""
        identity = self._session.identity
        if identity is None:
            return
        config = self._session.config
        serial = str(config.get("serial") or "") if config else ""
        if self._plan.real and (identity.any_simulator or serial == "SIM"):
            raise SimulatorAnswers(identity.name or serial)
        known = {"name": identity.name, "class": identity.robot_class, "subclass": identity.subclass}
        if identity != self._identified:
            if self._identified is not None:
                self._event(Event(t_ns, "warn", f"another robot answers than before: {identity.name}"))
            self._choose_robot(t_ns, identity)
            self._surfaces(identity)
        elif config is None:
            return
        if config is not None:
            known |= {"serial": serial, "version": str(config.get("version") or "")}
        self._transcript.identity(known, self._robot)
        self._identified = identity

    def _choose_robot(self, t_ns: int, identity: Identity) -> None:
        if self._plan.robot is None and identity.subclass.lower() in built_in():
            self._robot = load_robot(identity.subclass)
        elif self._plan.robot is None:
            text = f"robot type {identity.subclass!r} is not known: taken for {DEFAULT_ROBOT} (name yours with --robot)"
            self._event(Event(t_ns, "warn", text))
        self._decoder.become(self._robot)
        if self._driver is None and self._plan.mover is not None:
            self._driver = self._plan.mover(self._robot)
        elif self._driver is None and self._plan.route is not None:
            self._driver = Driver(self._plan.route, self._robot, speed_mm_s=self._plan.speed_mm_s)

    def _surfaces(self, identity: Identity) -> None:
        """The true surfaces, where they are known or our own simulator says that it is in a world we have."""
        if identity.world is not None and self._identified is None:
            from sonarlog.sim import world

            surfaces = self._plan.surfaces
            if surfaces is None and world.is_ours(identity.world):
                surfaces = world.load_world(identity.world).surfaces()
            if surfaces is not None:
                self._transcript.surfaces(surfaces)

    def _transmit(self, data: bytes) -> None:
        if data:
            t_ns = self._now_ns()
            self._connection.link.write(data)
            self._transcript.wire(t_ns, "tx", data)

    def _pass_on(self, events: list[Event]) -> None:
        for event in events:
            self._event(event)

    def _event(self, event: Event) -> None:
        self._transcript.event(event)
        self._tell(event)

    def _leave(self) -> None:
        """Stop and close the robot, whatever the file says; keep what it still sends if the file takes it."""
        link, goodbye = self._connection.link, self._session.leave()
        try:
            if goodbye:
                self._transmit(goodbye)
                self._transcript.event(Event(link.now_ns(), "info", "the robot is stopped and closed"))
            self._listen_out(goodbye)
        except SonarlogError:
            pass  # the line is gone, or the file has failed, and refuses everything from then on
        finally:
            link.close()
            with suppress(SonarlogError):  # after an error it is the error that counts
                self._scribe.close()

    def _listen_out(self, goodbye: bytes) -> None:
        """Until nothing comes any more; a robot that goes on talking has not heard the goodbye."""
        link, patience_ns = self._connection.link, self._plan.patience_ns
        begin_ns = heard_ns = said_ns = link.now_ns()
        while (now_ns := link.now_ns()) - heard_ns < patience_ns // 5 and now_ns - begin_ns < 2 * patience_ns:
            if data := link.read(POLL_S):
                heard_ns = link.now_ns()
                self._transcript.wire(heard_ns, "rx", data)
            if goodbye and heard_ns - said_ns > patience_ns // 2:
                said_ns = heard_ns
                self._transmit(goodbye)
