"""Every byte of the wire accounted for, and when it came.

Must not know: files, sweeps.
"""

import itertools
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from sonarlog.check.finding import Finding, note, problem
from sonarlog.protocol.framing import BadFrame, Frame, Framer, Junk
from sonarlog.protocol.packets import parse_packet

Wire = list[tuple[int, str, bytes]]
"""(t_ns, "rx" or "tx", bytes) in the order of the file."""

TOLERATED = 0.01  # of the packets may be bad, of the bytes junk: lines are like that
DRIFT = 0.05  # of the cycle: more, and one of the two clocks is wrong


@dataclass(frozen=True)
class Account:
    """The bytes of one direction: every one is in exactly one of the last three numbers."""

    bytes: int
    packets: dict[str, int]  # number by kind
    bad_packets: int
    packet_bytes: int
    bad_packet_bytes: int
    junk_bytes: int

    @property
    def complete(self) -> bool:
        """Nothing is unaccounted for."""
        return self.bytes == self.packet_bytes + self.bad_packet_bytes + self.junk_bytes

    def text(self) -> str:
        """In words."""
        kinds = ", ".join(f"{count} {kind}" for kind, count in self.packets.items()) or "no packets"
        rest = f"{self.bad_packet_bytes} in {self.bad_packets} bad packets, {self.junk_bytes} junk"
        return f"{self.bytes} bytes = {self.packet_bytes} in packets ({kinds}) + {rest}"


@dataclass(frozen=True)
class Timing:
    """When SIPs came. `cycle_ms` is measured, `drift_ppm` against the robot's nominal cycle."""

    sips: int
    cycle_ms: float
    p99_ms: float
    longest_ms: float
    missed: int  # cycles without a SIP
    bursts: int  # SIPs that came together with the one before
    drift_ppm: int


def account(wire: Wire, direction: str) -> Account:
    """Frame all bytes of that direction again."""
    framer, packets = Framer(), Counter[str]()
    sizes = Counter[type]()
    bad = total = 0
    stream = [(t_ns, data) for t_ns, way, data in wire if way == direction]
    for pieces in [*(framer.feed(data, t_ns) for t_ns, data in stream), framer.finish()]:
        for piece in pieces:
            if isinstance(piece, Frame):
                packets["commands" if direction == "tx" else type(parse_packet(piece.body)).__name__] += 1
                sizes[Frame] += piece.wire_length
            else:
                bad += isinstance(piece, BadFrame)
                sizes[type(piece)] += len(piece.data)
    total = sum(len(data) for _, data in stream)
    return Account(total, dict(packets.most_common()), bad, sizes[Frame], sizes[BadFrame], sizes[Junk])


def timing(sip_ns: Iterable[int], cycle_ms: int) -> Timing | None:
    """From the times at which SIPs came; None of fewer than three. Bursts are counted, not smeared."""
    times = np.array(list(sip_ns), dtype=np.int64)
    steps = np.diff(times)
    if len(steps) < 2:
        return None
    nominal_ns = cycle_ms * 1_000_000
    cycles = np.maximum(np.rint(steps / nominal_ns).astype(np.int64), 0)
    short = steps < 5 * nominal_ns  # in a gap nobody knows how many cycles there were
    counted = max(1, int(cycles[short].sum()))
    cycle_ns = float(steps[short].sum()) / counted
    return Timing(
        sips=len(times),
        cycle_ms=round(cycle_ns / 1e6, 3),
        p99_ms=round(float(np.percentile(steps, 99)) / 1e6, 1),
        longest_ms=round(float(steps.max()) / 1e6, 1),
        missed=max(0, int(cycles.sum()) - len(steps)),
        bursts=int(np.count_nonzero(steps < nominal_ns // 5)),
        drift_ppm=round((cycle_ns / nominal_ns - 1) * 1e6),
    )


def wire_findings(wire: Wire, received: Account, sent: Account) -> Iterable[Finding]:
    """What is wrong with the bytes themselves."""
    if not (received.complete and sent.complete):
        yield problem("wire", "bytes are unaccounted for: a bug of ours")
    packets = sum(received.packets.values())
    if received.bad_packets:
        share = received.bad_packets / (packets + received.bad_packets)
        text = f"{received.bad_packets} bad packets ({100 * share:.1f} %)"
        yield problem("wire", text) if share > TOLERATED else note("wire", text)
    if received.junk_bytes:
        text = f"{received.junk_bytes} bytes between packets"
        yield problem("wire", text) if received.junk_bytes > TOLERATED * received.bytes else note("wire", text)
    if sent.bad_packets or sent.junk_bytes:
        yield problem("wire", "what was sent is not all commands")
    times = [t_ns for t_ns, _, _ in wire]
    if backwards := sum(after < before for before, after in itertools.pairwise(times)):
        yield problem("time", f"{backwards} stamps are earlier than the one before")
    if twice := sum(before == after for before, after in itertools.pairwise(wire)):
        yield problem("wire", f"{twice} messages stand there twice")


def timing_findings(measured: Timing) -> Iterable[Finding]:
    """What is wrong with the times."""
    if measured.missed:
        text = f"{measured.missed} of {measured.sips + measured.missed} SIPs never came"
        worst = measured.missed > TOLERATED * measured.sips
        yield problem("time", text) if worst else note("time", text)
    if measured.bursts:
        yield note("time", f"{measured.bursts} SIPs came together with the one before: held up on the line")
    if abs(measured.drift_ppm) > DRIFT * 1e6:
        yield problem("time", f"a cycle takes {measured.cycle_ms:.1f} ms by our clock: one of the clocks is wrong")
