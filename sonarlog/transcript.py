"""The transcript: what is written of each packet beside the wire, through the scribe.

Must not know: the line, the session, routes.
"""

from sonarlog.decode import Sample, true_pose
from sonarlog.log import Event, Surfaces
from sonarlog.moves import Decided
from sonarlog.protocol.packets import SimStat, Sip
from sonarlog.recording import RecordingWriter
from sonarlog.robot import Robot
from sonarlog.scribe import Scribe

RADIANS = 0.017453292519943295  # per degree


class Transcript:
    """One recording as the recorder dictates it. Everything raises what `Scribe.do` raises."""

    def __init__(self, writer: RecordingWriter, scribe: Scribe) -> None:
        self._writer = writer
        self._do = scribe.do
        self._robot: Robot | None = None
        self.volts: float | None = None

    def wire(self, t_ns: int, direction: str, data: bytes) -> None:
        """Bytes, as they came or went."""
        self._do(self._writer.wire, t_ns, direction, data)

    def event(self, event: Event) -> None:
        """Something that happened."""
        self._do(self._writer.event, event.t_ns, event.level, event.text)

    def decision(self, decided: Decided) -> None:
        """What was decided."""
        self._do(self._writer.decision, decided.t_ns, decided.json)

    def identity(self, known: dict[str, str], robot: Robot) -> None:
        """Who the robot is; from here on its SIPs are written."""
        self._robot = robot
        self._do(self._writer.identity, known, robot)

    def surfaces(self, surfaces: Surfaces) -> None:
        """The true surfaces of a simulator's world."""
        self._do(self._writer.surfaces, surfaces)

    def sample(self, sample: Sample) -> None:
        """What a packet means: poses, readings, battery, truth."""
        if isinstance(sample.packet, SimStat):
            self._do(self._writer.truth, sample.t_ns, *true_pose(sample.packet))
        elif isinstance(sample.packet, Sip) and self._robot is not None:
            self._sip(sample, sample.packet, self._robot)

    def _sip(self, sample: Sample, sip: Sip, robot: Robot) -> None:
        assert sample.pose is not None
        speed = (sip.left + sip.right) / 2 * robot.velocity_mm_s_per_unit
        turn_rate = sip.extra("turn_rate")
        self._do(self._writer.odometry, sample.t_ns, *sample.pose, speed, (turn_rate or 0) / 10 * RADIANS)
        for reading in sample.readings:
            self._do(self._writer.reading, reading.t_ns, reading.sonar, reading.range_mm)
        if sample.readings:
            self._do(self._writer.points, sample.t_ns, sample.readings)
        tenths = sip.extra("battery_x10")
        self.volts = (tenths if tenths else sip.battery) / 10
        self._do(self._writer.battery, sample.t_ns, self.volts)
