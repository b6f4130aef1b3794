"""Check a recording: is the file sound, is every byte accounted for, can its sweeps be used.

Must not know: how it is printed.
"""

import itertools
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sonarlog.check.finding import Finding, note, problem
from sonarlog.check.sonars import SonarCheck, sonar_checks, sonar_findings
from sonarlog.check.sweeps import SweepCheck, sweep_checks, sweep_findings
from sonarlog.check.wire import Account, Timing, Wire, account, timing, timing_findings, wire_findings
from sonarlog.info import GAP_NS
from sonarlog.log import Log
from sonarlog.odometer import WRAP
from sonarlog.protocol.packets import Sip
from sonarlog.recording import open_recording, read_log
from sonarlog.recording.reader import lost_before, read_wire

BROKEN_ODOMETRY = {"odometry_jumps": "odometry jumped", "resets": "the robot's controller was reset"}
MALFORMED = {
    "bad_discs": "readings of sonars the robot does not have",
    "malformed_packets": "packets with a right checksum and too few bytes",
    "missing_readings": "readings that were announced and did not come",
    "unknown_packets": "packets of unknown kinds",
}

__all__ = ["Finding", "Report", "check"]


@dataclass(frozen=True)
class Report:
    """What a check found. `received`, `sent` and `timing` are None where there is no wire."""

    path: str
    received: Account | None
    sent: Account | None
    timing: Timing | None
    wraps: int  # of the robot's counters, all undone
    sessions: int  # of odometry
    sonars: tuple[SonarCheck, ...]
    sweeps: tuple[SweepCheck, ...]
    findings: tuple[Finding, ...]

    @property
    def sound(self) -> bool:
        """No problem was found."""
        return not any(finding.level == "problem" for finding in self.findings)

    def as_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        sweeps = [{**asdict(sweep), "usable": sweep.usable} for sweep in self.sweeps]
        return {**asdict(self), "sweeps": sweeps, "sound": self.sound}


def check(path: Path) -> Report:
    """Look at everything. Raises what `open_recording` and `read_log` raise for files that are no recordings."""
    file = open_recording(path)
    log = read_log(path)
    wire = list(read_wire(file))
    received, sent = (account(wire, "rx"), account(wire, "tx")) if wire else (None, None)
    raw = _sips(wire, log)
    measured = timing((t_ns for t_ns, _ in raw), log.robot.sip_cycle_ms)
    sonars, sweeps = sonar_checks(log), sweep_checks(log)
    findings = [problem("file", sentence) for sentence in (*file.damage, *lost_before(file))]
    if received and sent:
        findings += wire_findings(wire, received, sent)
    findings += timing_findings(measured) if measured else ()
    findings += [*_odometry_findings(log), *sonar_findings(sonars), *sweep_findings(sweeps), *_event_findings(log)]
    sessions = len(np.unique(log.odometry.session))
    return Report(str(path), received, sent, measured, _wraps(raw, log), sessions, sonars, sweeps, tuple(findings))


def _sips(wire: Wire, log: Log) -> list[tuple[int, Sip]]:
    """Every SIP with the time it came."""
    from sonarlog.decode import WireDecoder

    decoder = WireDecoder(log.robot)
    samples = [sample for t_ns, way, data in wire if way == "rx" for sample in decoder.feed(t_ns, data)]
    return [(sample.t_ns, sample.packet) for sample in samples if isinstance(sample.packet, Sip)]


def _wraps(raw: list[tuple[int, Sip]], log: Log) -> int:
    """How often x, y or heading went over the end of their range."""
    half_turn = log.robot.heading_units_per_turn // 2
    return sum(
        (abs(after.x - before.x) > WRAP // 2)
        + (abs(after.y - before.y) > WRAP // 2)
        + (abs(after.heading - before.heading) > half_turn)
        for (_, before), (_, after) in itertools.pairwise(raw)
    )


def _odometry_findings(log: Log) -> Iterable[Finding]:
    for name, text in BROKEN_ODOMETRY.items():
        if times := log.counts.get(name):
            yield problem("odometry", f"{text} {times} {'time' if times == 1 else 'times'}: it starts anew there")
    for name, text in MALFORMED.items():
        if count := log.counts.get(name):
            yield note("wire", f"{count} {text}")
    t_ns = log.odometry.t_ns
    if not len(t_ns):
        yield problem("odometry", "there is none")
        return
    steps = np.diff(t_ns)
    for k in np.flatnonzero(steps > GAP_NS).tolist():
        at_s, gap_s = (int(t_ns[k]) - int(t_ns[0])) / 1e9, int(steps[k]) / 1e9
        yield problem("time", f"a gap of {gap_s:.1f} s at {at_s:.1f} s")
    if backwards := int(np.count_nonzero(steps < 0)):
        yield problem("time", f"{backwards} poses are earlier than the one before")


def _event_findings(log: Log) -> Iterable[Finding]:
    """What the recorder had to say: errors are problems, unless the decoder says the same."""
    for event in log.events:
        if event.level == "error":
            yield problem("events", f"{event.t_ns / 1e9:.1f} s: {event.text}")
