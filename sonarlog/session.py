"""A session with the robot: handshake, keeping it open, awake and sonar on, and leaving it stopped and closed.

Packets in, bytes to send out. Must not know: the port, the clock (times come in), where the robot is to drive.
"""

from dataclasses import dataclass
from enum import Enum

from sonarlog.errors import SonarlogError
from sonarlog.log import Event
from sonarlog.protocol.commands import SYNC0, Command, encode_command
from sonarlog.protocol.packets import MOTORS, ConfigPacket, Packet, Reset, SimStat, Sip, Sync
from sonarlog.safety import Guard

SECOND = 1_000_000_000
PULSE_EVERY_NS = SECOND // 2  # the robot's watchdog stops it after 2 s
REPEAT_NS = SECOND // 2  # commands are never acknowledged: what shows no effect is said again
TRIES = 6
LOST_AFTER = 5  # so many times its patience without a SIP, and the robot is given up
OURS = "sonarlog-sim"
"""The NAME our own simulator answers with (then the world's); only it is asked for the truth."""
SIMULATORS = (OURS, "MobileSim", "AMRISim", "Stage")


class NoAnswer(SonarlogError):
    """Nobody at the port takes part in the handshake."""

    def __init__(self, heard: int, synced: bool) -> None:
        what = "nothing came back; is the robot on, the cable in and the baud rate right?"
        if synced:
            what = "it took part in the handshake, but sends nothing since; switch it off and on"
        elif heard:
            what = f"{heard} packets came back, but no handshake; is another program talking to it?"
        super().__init__(f"no robot answers at this port: {what}")


class RobotSilent(SonarlogError):
    """The robot was there, and stopped answering."""

    def __init__(self, silence_s: float) -> None:
        super().__init__(f"the robot has sent nothing for {silence_s:.0f} s; check cable and battery")


@dataclass(frozen=True)
class Identity:
    """Who answered: the three strings of the handshake."""

    name: str
    robot_class: str
    subclass: str

    @property
    def world(self) -> str | None:
        """The world, where it is our own simulator."""
        return self.name.partition("/")[2] or None if self.simulated else None

    @property
    def simulated(self) -> bool:
        """It is our own simulator."""
        return self.name.startswith(OURS)

    @property
    def any_simulator(self) -> bool:
        """It is a simulator, ours or another known one."""
        return self.name.startswith(SIMULATORS)


class Stage(Enum):
    """How far the session is; SYNC0 to SYNC2 carry their command number."""

    SYNC0 = 0
    SYNC1 = 1
    SYNC2 = 2
    CLEARING = "closing what a client before left open"
    OPENING = "waiting for the first SIP"
    OPEN = "SIPs flow"


class Session:
    """Says when to send what.

    `drive` asks for the motors. `patience_ns`: how long to wait for an answer, in robot time; so long without a SIP
    the robot is told to stop, and five times so long it is given up. `halted` says why it may drive no more;
    whoever drives and `recovers` from stalls and bumps by itself gets some seconds for that.
    """

    def __init__(self, *, drive: bool, patience_ns: int = SECOND, recovers: bool = False) -> None:
        self.halted = ""
        self._drive = drive
        self._patience_ns = patience_ns
        self._recovers = recovers
        self._told: set[str] = set()
        self._events: list[Event] = []
        self.restart(0)

    def restart(self, now_ns: int, tries: int = TRIES) -> None:
        """Begin with the handshake again: another line, or another baud rate. What was told once stays told."""
        self.identity: Identity | None = None
        self.config: ConfigPacket | None = None
        self.motors = False
        self.stage = Stage.SYNC0
        self._guard = Guard(recovers=self._recovers)
        self._most_tries = tries
        self._tries = 0  # of one step of the handshake
        self._cleared = 0  # how often a robot still open was closed
        self._heard = 0  # packets
        self._next_ns = now_ns  # when to try again
        self._asked_ns = now_ns  # when `send` was called last
        self._drained_ns = now_ns  # SIPs before are from a session just closed
        self._due_ns = dict.fromkeys(("pulse", "config", "sonar", "enable", "truth"), 0)
        self._asked_config = 0
        self._sip_ns = 0  # when the last SIP came
        self._sonar_ns = 0  # when a SIP with readings came last
        self._silent = False

    @property
    def heard_ns(self) -> int:
        """When the last SIP came."""
        return self._sip_ns

    @property
    def cleared(self) -> bool:
        """A robot still open was closed; it may have gone back to its own baud rate with that."""
        return self._cleared > 0

    @property
    def open(self) -> bool:
        """SIPs flow."""
        return self.stage is Stage.OPEN

    @property
    def ready(self) -> bool:
        """The robot can be driven: SIPs flow and its motors are on."""
        return self.open and self.motors and not self._silent and not self.halted

    def take_events(self) -> list[Event]:
        """What happened since this was asked last."""
        events, self._events = self._events, []
        return events

    def receive(self, t_ns: int, packet: Packet) -> None:
        """Take note of a packet that came at t_ns."""
        self._heard += 1
        if isinstance(packet, Sip):
            self._on_sip(t_ns, packet)
        elif isinstance(packet, Sync):
            self._on_sync(t_ns, packet)
        elif isinstance(packet, ConfigPacket):
            self.config = packet
        elif isinstance(packet, SimStat):
            self._due_ns["truth"] = t_ns + SECOND
        elif isinstance(packet, Reset):
            if self.stage in (Stage.OPENING, Stage.OPEN):
                self._event(t_ns, "error", "the robot's controller was reset: connecting again")
                self._tries = 0
            self.stage = Stage.SYNC0
            self._next_ns = t_ns + self._patience_ns // 4

    def send(self, now_ns: int) -> bytes:
        """What has to be sent by now, often nothing. Raises NoAnswer, RobotSilent."""
        if self.stage is Stage.OPEN:
            return self.wake(now_ns) + self._keep_up(now_ns)
        self._asked_ns = now_ns
        if now_ns < self._next_ns:
            return b""
        if self._tries >= self._most_tries or self._cleared >= TRIES:
            raise NoAnswer(self._heard, self.stage is Stage.OPENING)
        self._tries += 1
        self._next_ns = now_ns + self._patience_ns
        if self.stage is Stage.OPENING:
            return encode_command(Command.OPEN, 1)
        if self.stage is Stage.CLEARING:
            self.stage = Stage.SYNC0
            self._tries = 0
            self._cleared += 1
            self._next_ns = self._drained_ns = now_ns + self._patience_ns // 2
            return encode_command(Command.STOP) + encode_command(Command.CLOSE)
        if self._tries in (3, 5):  # it may be deaf to SYNC: open already, or half way through another handshake
            self.stage = Stage.SYNC0
            return encode_command(Command.CLOSE) + encode_command(SYNC0)
        return encode_command(int(self.stage.value))

    def leave(self) -> bytes:
        """What leaves the robot standing, motors off and closed; nothing where it was never opened."""
        if self.stage not in (Stage.OPENING, Stage.OPEN):
            return b""
        motors_off = encode_command(Command.ENABLE, 0) if self._drive else b""
        return encode_command(Command.STOP) + motors_off + encode_command(Command.CLOSE, 1)

    def _on_sync(self, t_ns: int, packet: Sync) -> None:
        if packet.number != self.stage.value:
            return
        self._tries = 0
        self._next_ns = t_ns
        if packet.number < 2:
            self.stage = Stage(packet.number + 1)
            return
        name, robot_class, subclass = (*packet.strings, "", "", "")[:3]
        self.identity = Identity(name, robot_class, subclass)
        self.stage = Stage.OPENING
        self._event(t_ns, "info", f"connected to {name or 'a nameless robot'}, {robot_class} {subclass}".rstrip())

    def _on_sip(self, t_ns: int, sip: Sip) -> None:
        if self.stage in (Stage.SYNC0, Stage.SYNC1, Stage.SYNC2):
            if t_ns >= self._drained_ns:
                self._event_once(t_ns, "warn", "the robot was still open from another session: closing it first")
                self.stage = Stage.CLEARING
                self._next_ns = t_ns
            return
        if self.stage is Stage.OPENING:
            self.stage = Stage.OPEN
            self._sonar_ns = t_ns
            self._guard = Guard(recovers=self._recovers)  # a robot just opened has its motors off
        if self._silent:
            self._silent = False
            self._event(t_ns, "warn", "the robot is heard again")
        self._sip_ns = t_ns
        self._note_motors(t_ns, sip)
        if sip.sonar:
            self._sonar_ns = t_ns

    def _note_motors(self, t_ns: int, sip: Sip) -> None:
        if self._drive and not self.halted and (why := self._guard.halts(sip)):
            self.halted = why
            self._event(t_ns, "error", f"the route is halted: {why}")
        self.motors = bool(sip.flags & MOTORS)

    def wake(self, now_ns: int) -> bytes:
        """STOP, where this program itself did not run for so long that the robot's watchdog has stopped it; to be sent
        before anything else is.
        """
        pause_ns, self._asked_ns = now_ns - self._asked_ns, now_ns
        if pause_ns <= self._patience_ns or self.stage is not Stage.OPEN:
            return b""
        self._event(
            now_ns, "warn", f"the recorder was held up for {pause_ns / SECOND:.1f} s: the robot is told to stop"
        )
        return encode_command(Command.STOP)

    def _keep_up(self, now_ns: int) -> bytes:
        silence_ns = now_ns - self._sip_ns
        if silence_ns > LOST_AFTER * self._patience_ns:
            raise RobotSilent(silence_ns / SECOND)
        if silence_ns > self._patience_ns and not self._silent:
            self._silent = True
            self._event(now_ns, "warn", "no SIP any more: the robot is told to stop")
        out = b""
        if self._due("pulse", now_ns, PULSE_EVERY_NS):
            # After a silence a mere PULSE would let the robot resume what it was told before.
            out += encode_command(Command.STOP if self._silent else Command.PULSE)
        if self.config is None and self._asked_config < 3 and self._due("config", now_ns, REPEAT_NS):
            self._asked_config += 1
            out += encode_command(Command.CONFIG, 1)
        elif self.config is None and self._asked_config == 3 and now_ns >= self._due_ns["config"]:
            self._event_once(now_ns, "warn", "no CONFIG packet passed its checksum: going on without one")
        if self._sip_ns - self._sonar_ns > SECOND // 2 and self._due("sonar", now_ns, REPEAT_NS):
            self._event_once(now_ns, "warn", "the sonars are off: switching them on")
            out += encode_command(Command.SONAR, 1)
        if self._drive and not self.halted and not self.motors and self._due("enable", now_ns, REPEAT_NS):
            out += encode_command(Command.STOP) + encode_command(Command.ENABLE, 1)
        if self.identity is not None and self.identity.simulated and self._due("truth", now_ns, SECOND):
            out += encode_command(Command.SIM_STAT, 2)
        return out

    def _due(self, what: str, now_ns: int, every_ns: int) -> bool:
        if now_ns < self._due_ns[what]:
            return False
        self._due_ns[what] = now_ns + every_ns
        return True

    def _event(self, t_ns: int, level: str, text: str) -> None:
        self._events.append(Event(t_ns, level, text))

    def _event_once(self, t_ns: int, level: str, text: str) -> None:
        if text not in self._told:
            self._told.add(text)
            self._event(t_ns, level, text)
