"""The decoder: wire bytes with their times to odometry and readings, the same live and in every replay.

Must not know: where the bytes come from, files, commands, what sweeps are. Integers only: its output is replayed.
"""

from array import array
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from slam.sweep import TURN
from sonarlog.calibration.correction import reckoning
from sonarlog.log import Ints, Log, Odometry, Readings, Truth
from sonarlog.odometer import RADIANS, Odometer, Units
from sonarlog.protocol.framing import BadFrame, Frame, Framer, Junk, Piece
from sonarlog.protocol.packets import Malformed, Packet, Reset, SimStat, Sip, Sync, Unknown, parse_packet
from sonarlog.robot import Robot

GAP_NS = 1_000_000_000
"""Ten SIPs missed in a row are a gap worth telling."""

UNBRIDGEABLE_NS = 5_000_000_000
"""After so long a silence the robot may have turned by more than half a turn, or been carried: odometry starts anew."""


COAST_NS = 1_500_000_000
"""So long a robot goes on when the line falls silent, more or less: its watchdog waits for two seconds."""


class Pose(NamedTuple):
    """Where odometry has the robot: µm, µm, 1/TURN of a turn, unwrapped, from the first SIP on."""

    x_um: int
    y_um: int
    heading: int


class Reading(NamedTuple):
    """One new reading with the moment it was fired and the pose at that moment."""

    t_ns: int
    sonar: int
    range_mm: int
    pose: Pose


@dataclass(frozen=True)
class Sample:
    """A packet and what it means. `pose` and `readings` are a SIP's; `note` says what went wrong with odometry."""

    t_ns: int
    packet: Packet
    session: int
    pose: Pose | None = None
    readings: tuple[Reading, ...] = ()
    note: str = ""


def firing_age_ms(index: int, count: int, robot: Robot) -> int:
    """How long before its SIP reading `index` of `count` was fired.

    One disc of each array of eight fires every sonar cycle; of what a SIP cycle leaves over, up to half a sonar cycle
    lies after the last one: 60, 20 ms for two readings and 80, 40, 0 for three at 40 ms in 100 ms. More readings than
    can have been fired in the cycle come from a simulator that fires all at once, when it sends.
    """
    arrays = -(-len(robot.sonars) // 8)
    beats = -(-count // arrays)
    if beats * robot.sonar_cycle_ms > robot.sip_cycle_ms + robot.sonar_cycle_ms:
        return 0
    slack = max(0, robot.sip_cycle_ms - beats * robot.sonar_cycle_ms)
    return (beats - 1 - index // arrays) * robot.sonar_cycle_ms + min(slack, robot.sonar_cycle_ms // 2)


class WireDecoder:
    """Received bytes in, samples out; `counts` says by name what was used and what was left out."""

    def __init__(self, robot: Robot) -> None:
        self.counts: Counter[str] = Counter()
        self._framer = Framer()
        self._session = 0
        self._broken = False  # odometry is known not to go on from the SIP before
        self._last: _Last | None = None
        self._odometer = Odometer(robot)
        self._last_fired_ns: int | None = None
        self.become(robot)

    def become(self, robot: Robot) -> None:
        """Go on with the parameters of the robot that has turned out to be there."""
        self.robot = robot
        self._corrected = reckoning(robot.calibration)
        self._odometer.become(robot)
        self._range_nm = round(robot.range_mm_per_unit * 1e6)
        self._ages_ms: dict[int, list[int]] = {}  # of the readings of a SIP, by how many there are

    def feed(self, t_ns: int, data: bytes) -> list[Sample]:
        """The samples that these bytes complete; `t_ns` is when they came."""
        return self._samples(self._framer.feed(data, t_ns))

    def finish(self) -> list[Sample]:
        """No more bytes will come."""
        return self._samples(self._framer.finish())

    def _samples(self, pieces: list[Piece]) -> list[Sample]:
        samples = []
        behind = sum(_is_sip(piece) for piece in pieces)
        for piece in pieces:
            if isinstance(piece, Frame):
                self.counts["packets"] += 1
                behind -= _is_sip(piece)
                samples.append(self._sample(piece.t_ns, parse_packet(piece.body), behind))
            elif isinstance(piece, BadFrame):
                self.counts["bad_packets"] += 1
                self.counts["bad_packet_bytes"] += len(piece.data)
            elif isinstance(piece, Junk):
                self.counts["junk_bytes"] += len(piece.data)
        return samples

    def _sample(self, t_ns: int, packet: Packet, behind: int) -> Sample:
        if isinstance(packet, Sip):
            # SIPs that came in one piece had been held up on the way: each left a cycle before the next.
            return self._sip(t_ns, packet, t_ns - behind * self.robot.sip_cycle_ms * 1_000_000)
        note = ""
        if isinstance(packet, Reset) and self._last is not None:
            note = "the robot's controller was reset: odometry starts anew"
            self.counts["resets"] += 1
            self._broken = True
        elif isinstance(packet, Sync) and packet.number == 2:
            self._broken = self._last is not None  # a new handshake: the robot counts from zero again
        elif isinstance(packet, Unknown):
            self.counts["unknown_packets"] += 1
        elif isinstance(packet, Malformed):
            self.counts["malformed_packets"] += 1
        return Sample(t_ns, packet, self._session, note=note)

    def _sip(self, t_ns: int, sip: Sip, sent_ns: int) -> Sample:
        self.counts["sips"] += 1
        self.counts["missing_readings"] += sip.missing
        position, odometer = (sip.x, sip.y, sip.heading), self._odometer
        step = (0, 0, 0) if self._last is None else odometer.step(self._last.position, position)
        note = self._break_or_gap(t_ns, step, sent_ns)
        if self._last is None or self._broken:
            self._session += self._last is not None
            odometer.begin(sip.heading, self._missed(sent_ns))
            self._last = None
        else:
            odometer.go(step)
        self._broken = False
        pose = Pose(*self._corrected(odometer.place()))
        readings = tuple(self._readings(sent_ns, sip, pose))
        self._last = _Last(t_ns, sent_ns, position, pose)
        return Sample(t_ns, sip, self._session, pose, readings, note)

    def _missed(self, sent_ns: int) -> int:
        """How many SIPs' way the robot will have gone unheard: it goes on until somebody or its watchdog stops it."""
        if self._last is None or sent_ns - self._last.sent_ns < COAST_NS:
            return 0
        return COAST_NS // (self.robot.sip_cycle_ms * 1_000_000)

    def _break_or_gap(self, t_ns: int, step: tuple[int, int, int], sent_ns: int) -> str:
        """Look at the step from the SIP before; say what is wrong and mark odometry broken if it cannot go on."""
        if self._last is None or self._broken:
            return ""
        dx, dy, _ = step
        step_mm = max(abs(dx), abs(dy)) * self.robot.mm_per_unit
        # Half a second to spare: packets may have been held up on the line.
        if step_mm * 1_000_000_000 > self.robot.max_velocity_mm_s * (t_ns - self._last.t_ns + 500_000_000):
            self.counts["odometry_jumps"] += 1
            self._broken = True
            return f"odometry jumped by {step_mm / 1000:.2f} m: it starts anew"
        silence_ns = sent_ns - self._last.sent_ns
        if silence_ns <= GAP_NS:
            return ""
        self.counts["gaps"] += 1
        self._broken = silence_ns > UNBRIDGEABLE_NS
        return f"no SIP for {silence_ns / 1e9:.1f} s" + (": odometry starts anew" if self._broken else "")

    def _readings(self, sent_ns: int, sip: Sip, pose: Pose) -> Iterable[Reading]:
        nm, count = self._range_nm, len(sip.sonar)
        if count not in self._ages_ms:
            self._ages_ms[count] = [firing_age_ms(index, count, self.robot) for index in range(count)]
        for age_ms, (disc, distance) in zip(self._ages_ms[count], sip.sonar, strict=True):
            if disc >= len(self.robot.sonars):
                self.counts["bad_discs"] += 1
                continue
            self.counts["readings"] += 1
            fired_ns = sent_ns - age_ms * 1_000_000
            if self._last_fired_ns is not None:  # a burst of SIPs must not turn the order of firing round
                fired_ns = max(fired_ns, self._last_fired_ns)
            self._last_fired_ns = fired_ns
            yield Reading(fired_ns, disc, (distance * nm + 500_000) // 1_000_000, self._pose_at(sent_ns, pose, age_ms))

    def _pose_at(self, sent_ns: int, pose: Pose, age_ms: int) -> Pose:
        """The pose `age_ms` before its SIP, on the line between the last two.

        By the SIP cycle and not by the stamps, which jitter; SIPs lost in between count as cycles.
        """
        if self._last is None or age_ms == 0:
            return pose
        cycle_ms = self.robot.sip_cycle_ms
        cycles = max(1, (sent_ns - self._last.sent_ns + cycle_ms * 500_000) // (cycle_ms * 1_000_000))
        whole = cycles * cycle_ms
        (x, y, heading), (x0, y0, heading0), half = pose, self._last.pose, whole // 2
        return Pose(
            x - ((x - x0) * age_ms + half) // whole,
            y - ((y - y0) * age_ms + half) // whole,
            heading - ((heading - heading0) * age_ms + half) // whole,
        )


class _Last(NamedTuple):
    """The SIP before: when it came, when it must have been sent, and the pose it gave."""

    t_ns: int
    sent_ns: int
    position: Units
    pose: Pose


def _is_sip(piece: Piece) -> bool:
    return isinstance(piece, Frame) and piece.body[0] & 0xF0 == 0x30


def decode_wire(messages: Iterable[tuple[int, str, bytes]], robot: Robot) -> Log:
    """Everything a recording's `/wire` says: (t_ns, "rx" or "tx", bytes) in order of writing.

    Of a robot still open from a client before, what came before the handshake is a session of its own.
    """
    decoder = WireDecoder(robot)
    tables = _Tables()
    for t_ns, direction, data in messages:
        if direction == "rx":
            tables.take(decoder.feed(t_ns, data))
    tables.take(decoder.finish())
    return Log(robot, tables.odometry(), tables.readings(), tables.truth(), counts=dict(decoder.counts))


class _Tables:
    """What a log keeps of samples, row by row in the least memory: of a day's log the samples themselves fill it."""

    def __init__(self) -> None:
        self._sips = array("q")
        self._fired = array("q")
        self._true_ns = array("q")
        self._true = array("d")

    def take(self, samples: Iterable[Sample]) -> None:
        """Add the samples' rows."""
        for sample in samples:
            if sample.pose is not None:
                self._sips.extend((sample.t_ns, *sample.pose, sample.session))
                for t_ns, sonar, range_mm, pose in sample.readings:
                    self._fired.extend((t_ns, sonar, range_mm, *pose, sample.session))
            elif isinstance(sample.packet, SimStat):
                self._true_ns.append(sample.t_ns)
                self._true.extend(true_pose(sample.packet))

    def odometry(self) -> Odometry:
        return Odometry(*_columns(self._sips, 5))

    def readings(self) -> Readings:
        return Readings(*_columns(self._fired, 7))

    def truth(self) -> Truth | None:
        """None where no simulator told."""
        poses = np.array(self._true, dtype=np.float64).reshape(-1, 3)
        return Truth(np.array(self._true_ns, dtype=np.int64), poses) if self._true_ns else None


def true_pose(packet: SimStat) -> tuple[float, float, float]:
    """(x m, y m, heading rad), as exactly as the simulator says."""
    if packet.exact is not None:
        x_um, y_um, heading = packet.exact
        return x_um / 1e6, y_um / 1e6, heading * RADIANS
    return packet.x_mm / 1e3, packet.y_mm / 1e3, packet.heading_deg * (TURN / 360) * RADIANS


def _columns(values: "array[int]", width: int) -> list[Ints]:
    table = np.array(values, dtype=np.int64).reshape(-1, width)
    return [np.ascontiguousarray(table[:, column]) for column in range(width)]
