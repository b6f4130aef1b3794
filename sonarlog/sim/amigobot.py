"""The firmware: an AmigoBot that takes bytes, lives through simulated time, and gives bytes.

It has the real robot's manners: motors off at first, a watchdog after which old goals resume, staggered discs,
15-bit positions, a session that SYNC and OPEN begin and CLOSE ends. Same seed, same world, same commands at the same
ticks: same bytes. Must not know: ports, wall clocks, what the client wants.
"""

from slam.dmath import DEGREE
from sonarlog.protocol.commands import SYNC0, SYNC2, Call, Command, parse_command, parse_set_pose
from sonarlog.protocol.framing import Frame, Framer, frame
from sonarlog.protocol.packets import Sync
from sonarlog.robot import Robot
from sonarlog.sim.body import Body
from sonarlog.sim.drive import TICK_NS, Drive
from sonarlog.sim.faults import Kick, SonarFaults
from sonarlog.sim.odometry import Floor, OdometryErrors
from sonarlog.sim.physics import Acoustics, Physics
from sonarlog.sim.reports import WATCHDOG_NS, config, encoders, sim_stat, sip
from sonarlog.sim.sonars import Sonars
from sonarlog.sim.world import World

_IO_PACKET = bytes((0xF0, 1, 0xFF, 1, 0xFF, 0))  # one byte of digital inputs, one of outputs, no analog ports


class AmigoBot:
    """One robot in one world. `now_ns` is its own time, which only `advance` and `tick` move."""

    def __init__(
        self,
        world: World,
        *,
        seed: int,
        robot: Robot,
        errors: OdometryErrors,
        acoustics: Acoustics | None = None,
        faults: SonarFaults | None = None,
        kick: Kick | None = None,
    ) -> None:
        self.now_ns = 0
        self.world = world
        self._robot = robot
        self._body = Body(world, Floor(errors, seed), robot.radius_mm / 1000, kick)
        self._drive = Drive(robot, self._body)
        physics = Physics(world, acoustics or Acoustics(), seed)
        self._sonars = Sonars(robot, self._body, physics, faults or SonarFaults())
        self._framer = Framer()
        self._out = bytearray()
        self._synced: int | None = None  # the last SYNC heard while closed
        self.is_open = False
        self._begin()

    @property
    def true_pose(self) -> tuple[int, int, int]:
        """x µm, y µm, heading in 1/2^20 of a turn: where it really is."""
        return self._body.true_pose

    @property
    def waiting(self) -> int:
        """Bytes that `read` would give."""
        return len(self._out)

    def write(self, data: bytes) -> None:
        """Bytes from the client; what they ask for is done before the next tick."""
        for piece in self._framer.feed(data, self.now_ns):
            if isinstance(piece, Frame):
                self._receive(piece.body)

    def read(self) -> bytes:
        """All bytes that have come out since the last call."""
        data = bytes(self._out)
        self._out.clear()
        return data

    def advance(self, to_ns: int) -> None:
        """Live until then, in ticks of 10 ms; the rest of a tick is left for the next call."""
        while self.now_ns + TICK_NS <= to_ns:
            self.tick()

    def tick(self) -> None:
        """Live for one tick: move, fire what is due, report what is due."""
        self.now_ns += TICK_NS
        self._drive.tick(halted=self.now_ns - self._heard_ns > WATCHDOG_NS)
        if self.is_open:
            self._sonars.tick(self.now_ns)
            if self.now_ns >= self._report_ns:
                self._report_ns += self._robot.sip_cycle_ms * 1_000_000
                self._report()

    def hang_up(self) -> None:
        """End the session as CLOSE does: motors and sonar off. What is still unread is gone."""
        self.is_open = False
        self._synced = None
        self._drive.switch_off()
        self._framer = Framer()
        self._out.clear()

    def _begin(self) -> None:
        """What OPEN finds: odometry at zero, sonar on, motors off, nothing streaming, the watchdog fed."""
        self._body.reset_odometry()
        self._drive.switch_off()
        self._sonars.reset(self.now_ns)
        self._heard_ns = self.now_ns
        self._report_ns = self.now_ns + self._robot.sip_cycle_ms * 1_000_000
        self._extras: dict[int, int] = {}  # command that asked for a packet beside the SIP: 1 once, more for ever

    def _receive(self, body: bytes) -> None:
        call = parse_command(body)
        if self.is_open:
            self._heard_ns = self.now_ns
            self._obey(call)
        elif call.number == Command.OPEN and self._synced == SYNC2:
            self.is_open = True
            self._begin()
        elif call.number <= SYNC2:
            self._handshake(call.number, body)

    def _handshake(self, number: int, body: bytes) -> None:
        """Echo SYNC0, 1, 2 in that order, again if asked again; a CLOSE out of the blue is no SYNC2."""
        if number == SYNC0 or (self._synced is not None and number - self._synced in (0, 1)):
            self._synced = number
            names = (f"sonarlog-sim/{self.world.name[:64]}", "Pioneer", self._robot.name[:64])
            self._say(body if number != SYNC2 else Sync(number, names).encode())

    def _obey(self, call: Call) -> None:
        number, argument = call
        if number == Command.CLOSE:
            self.hang_up()
        elif number == Command.SONAR and isinstance(argument, int):
            self._sonars.on = argument != 0
        elif number == Command.POLLING and isinstance(argument, bytes):
            self._sonars.poll(argument)
        elif number == Command.SONAR_CYCLE and isinstance(argument, int):
            self._sonars.set_cycle(argument)
        elif number == Command.CONFIG:
            self._say(config(self._robot))
        elif number in (Command.ENCODER, Command.IOREQUEST, Command.SIM_STAT):
            self._ask(number, argument if isinstance(argument, int) else 1)
        elif number == Command.SETO:
            self._body.reset_odometry()
        elif number == Command.SIM_RESET:
            self._body.place(0.0, 0.0, 0.0)
            self._body.reset_odometry()
        elif number == Command.SIM_SET_POSE and (pose := parse_set_pose(argument)):
            self._body.place(pose[0] / 1000, pose[1] / 1000, pose[2] % 360 * DEGREE)
        else:
            self._drive.obey(call)

    def _ask(self, number: int, times: int) -> None:
        """Send that packet with the next SIP (1), with every one (more), no more (0)."""
        if times > 0:
            self._extras[number] = times
        else:
            self._extras.pop(number, None)

    def _say(self, body: bytes) -> None:
        self._out += frame(body)

    def _report(self) -> None:
        """The SIP, and after it what was asked for beside it."""
        self._say(sip(self._robot, self._body, self._drive, self._sonars, self.now_ns))
        for number in self._extras:
            if number == Command.SIM_STAT:
                self._say(sim_stat(self._body))
            elif number == Command.ENCODER:
                self._say(encoders(self._body))
            else:
                self._say(_IO_PACKET)
        self._extras = {number: times for number, times in self._extras.items() if times > 1}
