"""An hour of recording: is memory flat, what does a SIP cost, is any packet missed at 20 times the real rate?

    python -m benchmarks.recorder_soak                       # an hour of robot time in three minutes
    python -m benchmarks.recorder_soak --seconds 600 --speed 50

The embedded robot and the recorder are two processes with TCP between them; /proc says what the recorder uses (Linux).
"""

import argparse
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from sonarlog.check import check

SONARLOG = (sys.executable, "-c", "from cli.main import main; main()")
SETTLED = 0.1  # of the time, after which memory should not grow any more
TICKS = os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True)
class Use:
    """What a process uses: resident MB, seconds of CPU so far."""

    megabytes: float
    cpu_s: float


def use_of(process: int) -> Use | None:
    """From /proc; None once it has ended."""
    try:
        status = Path(f"/proc/{process}/status").read_text(encoding="ascii")
        times = Path(f"/proc/{process}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    except OSError:
        return None
    found = re.search(r"VmRSS:\s+(\d+) kB", status)
    return Use(int(found[1]) / 1024, (int(times[11]) + int(times[12])) / TICKS) if found else None


def soak(seconds: float, speed: float, path: Path) -> tuple[list[Use], float]:
    """Record that long; what the recorder used, a sample twice a second, and how long it took."""
    sim = [*SONARLOG, "sim", "--world", "corridor", "--listen", "127.0.0.1:0", "--speed", str(speed)]
    with subprocess.Popen(sim, stderr=subprocess.PIPE, text=True) as robot:
        assert robot.stderr is not None
        address = robot.stderr.readline().split()[-1]
        record = [*SONARLOG, "record", "--port", f"socket://{address}", "--speed", str(speed), "-o", str(path), "-q"]
        record += ["--route", "repeat 10000 (scan)", "--time", str(seconds)]
        begin, samples = time.monotonic(), []
        with subprocess.Popen(record) as recorder:
            while recorder.poll() is None:
                if use := use_of(recorder.pid):
                    samples.append(use)
                time.sleep(0.5)
        robot.terminate()
    return samples, time.monotonic() - begin


def main() -> int:
    """Print the table; 1 if memory grew by more than 10 %, or a packet was missed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=3600, help="of robot time")
    parser.add_argument("--speed", type=float, default=20, help="times real time: 10 SIPs/s times this")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "soak.mcap"
        samples, took_s = soak(arguments.seconds, arguments.speed, path)
        report = check(path)
        size_mb = path.stat().st_size / 1e6
    assert report.received is not None
    assert report.timing is not None
    settled = samples[int(SETTLED * len(samples)) :]
    tenth = max(1, len(settled) // 10)
    first, last = (statistics.median(use.megabytes for use in part) for part in (settled[:tenth], settled[-tenth:]))
    sips = report.timing.sips
    expected = round(arguments.seconds * 10)
    lost = max(0, expected - sips) if expected - sips > 0.005 * expected else 0  # the handshake takes some
    bad = report.received.bad_packets + report.received.junk_bytes
    grown = last / first - 1
    print(f"robot time          {arguments.seconds:.0f} s in {took_s:.0f} s, {sips / took_s:.0f} SIPs/s")
    print(f"memory              {first:.1f} MB after a tenth, {last:.1f} MB at the end ({100 * grown:+.1f} %)")
    print(f"CPU                 {1e6 * samples[-1].cpu_s / sips:.0f} µs a SIP, start included")
    print(f"packets             {sips} SIPs of about {expected}, {bad} bad packets or junk bytes")
    print(f"file                {size_mb:.1f} MB")
    return 1 if grown > 0.1 or lost or bad else 0


if __name__ == "__main__":
    sys.exit(main())
