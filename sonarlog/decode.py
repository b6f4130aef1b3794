"""The decoder: wire bytes with their times to odometry and readings, the same live and in every replay.

Must not know: where the bytes come from, files, commands, what sweeps are. Integers only: its output is replayed.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from slam.sweep import TURN
from sonarlog.calibration.correction import reckoning
from sonarlog.log import Floats, Ints, Log, Odometry, Readings, Truth
from sonarlog.protocol.framing import BadFrame, Frame, Framer, Junk, Piece
from sonarlog.protocol.packets import Malformed, Packet, Reset, SimStat, Sip, Sync, Unknown, parse_packet
from sonarlog.robot import Robot

GAP_NS = 1_000_000_000
"""Ten SIPs missed in a row are a gap worth telling."""

UNBRIDGEABLE_NS = 5_000_000_000
"""After so long a silence the robot may have turned by more than half a turn, or been carried: odometry starts anew."""

WRAP = 1 << 15
"""X and Y count modulo this on 15-bit robots, and so they do on 16-bit ones."""

RADIANS = 6.283185307179586 / TURN


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
        self.robot = robot
        self.counts: Counter[str] = Counter()
        self._framer = Framer()
        self._session = 0
        self._broken = False  # odometry is known not to go on from the SIP before
        self._last: _Last | None = None
        self._units = (0, 0, 0)  # odometry unwrapped, in the robot's units
        self._corrected = reckoning(robot.calibration)
        self._last_fired_ns: int | None = None

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
        note = self._break_or_gap(t_ns, sip, sent_ns)
        if self._last is None or self._broken:
            self._session += self._last is not None
            self._last = None
        else:
            dx, dy, turned = self._step(self._last.sip, sip)
            x, y, heading = self._units
            self._units = (x + dx, y + dy, heading + turned)
        self._broken = False
        pose = Pose(*self._corrected(self._pose()))
        readings = tuple(self._readings(sent_ns, sip, pose))
        self._last = _Last(t_ns, sent_ns, sip, pose)
        return Sample(t_ns, sip, self._session, pose, readings, note)

    def _break_or_gap(self, t_ns: int, sip: Sip, sent_ns: int) -> str:
        """Compare with the SIP before; say what is wrong and mark odometry broken if it cannot go on."""
        if self._last is None or self._broken:
            return ""
        dx, dy, _ = self._step(self._last.sip, sip)
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

    def _step(self, before: Sip, now: Sip) -> tuple[int, int, int]:
        """Odometry between two SIPs in robot units, the short way round each wrap."""
        turn = self.robot.heading_units_per_turn
        return (
            _shortest(now.x - before.x, WRAP),
            _shortest(now.y - before.y, WRAP),
            _shortest(now.heading - before.heading, turn),
        )

    def _pose(self) -> Pose:
        x, y, heading = self._units
        nm = round(self.robot.mm_per_unit * 1e6)
        turn = self.robot.heading_units_per_turn
        return Pose((x * nm + 500) // 1000, (y * nm + 500) // 1000, (heading * TURN + turn // 2) // turn)

    def _readings(self, sent_ns: int, sip: Sip, pose: Pose) -> Iterable[Reading]:
        nm = round(self.robot.range_mm_per_unit * 1e6)
        for index, (disc, distance) in enumerate(sip.sonar):
            if disc >= len(self.robot.sonars):
                self.counts["bad_discs"] += 1
                continue
            self.counts["readings"] += 1
            age_ms = firing_age_ms(index, len(sip.sonar), self.robot)
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
        x, y, heading = (
            now - ((now - before) * age_ms + whole // 2) // whole
            for now, before in zip(pose, self._last.pose, strict=True)
        )
        return Pose(x, y, heading)


class _Last(NamedTuple):
    """The SIP before: when it came, when it must have been sent, and the pose it gave."""

    t_ns: int
    sent_ns: int
    sip: Sip
    pose: Pose


def _is_sip(piece: Piece) -> bool:
    return isinstance(piece, Frame) and piece.body[0] & 0xF0 == 0x30


def _shortest(difference: int, modulus: int) -> int:
    """The difference modulo `modulus` that is nearest to zero."""
    return (difference + modulus // 2) % modulus - modulus // 2


def decode_wire(messages: Iterable[tuple[int, str, bytes]], robot: Robot) -> Log:
    """Everything a recording's `/wire` says: (t_ns, "rx" or "tx", bytes) in order of writing.

    Of a robot still open from a client before, what came before the handshake is a session of its own.
    """
    decoder = WireDecoder(robot)
    samples: list[Sample] = []
    for t_ns, direction, data in messages:
        if direction == "rx":
            samples += decoder.feed(t_ns, data)
    samples += decoder.finish()
    sips = [(s.t_ns, *s.pose, s.session) for s in samples if s.pose is not None]
    fired = [(r.t_ns, r.sonar, r.range_mm, *r.pose, s.session) for s in samples for r in s.readings]
    truth = [(s.t_ns, true_pose(s.packet)) for s in samples if isinstance(s.packet, SimStat)]
    return Log(
        robot,
        Odometry(*_columns(sips, 5)),
        Readings(*_columns(fired, 7)),
        Truth(_columns([(t,) for t, _ in truth], 1)[0], _poses([pose for _, pose in truth])) if truth else None,
        counts=dict(decoder.counts),
    )


def true_pose(packet: SimStat) -> tuple[float, float, float]:
    """(x m, y m, heading rad), as exactly as the simulator says."""
    if packet.exact is not None:
        x_um, y_um, heading = packet.exact
        return x_um / 1e6, y_um / 1e6, heading * RADIANS
    return packet.x_mm / 1e3, packet.y_mm / 1e3, packet.heading_deg * (TURN / 360) * RADIANS


def _columns(rows: Sequence[tuple[int, ...]], width: int) -> list[Ints]:
    table = np.array(rows, dtype=np.int64).reshape(-1, width)
    return [np.ascontiguousarray(table[:, column]) for column in range(width)]


def _poses(rows: list[tuple[float, float, float]]) -> Floats:
    return np.array(rows, dtype=np.float64).reshape(-1, 3)
