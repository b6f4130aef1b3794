"""What a recording says while it runs: a live line on a terminal, a plain one now and then elsewhere, and events.

A thread of its own writes it: a terminal that is held with Ctrl-S must not hold the recorder.
"""

import os
import sys
import time
from collections import deque
from threading import Event as Flag
from threading import Thread
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from sonarlog.log import Event
    from sonarlog.recorder import Status

PLAIN_EVERY_S = 5.0
EVERY_S = 0.1
WAITING = 500  # lines that may wait; then the oldest are left out
CLOSE_S = 1.0


class LiveLine:
    """Give it statuses and events; it never waits. `lost` says that the terminal is gone.

    `talk`: how events begin that are told without being asked for.
    """

    def __init__(self, *, quiet: bool, verbose: bool, talk: tuple[str, ...] = ()) -> None:
        self.lost = False
        self._talk = talk
        self._quiet = quiet
        self._verbose = verbose
        self._live = sys.stderr.isatty()
        self._status: Status | None = None
        self._lines: deque[str] = deque(maxlen=WAITING)
        self._shown_s = time.monotonic()
        self._width = 0
        self._end = Flag()
        self._thread = Thread(target=self._work, name="live line", daemon=True)

    def __enter__(self) -> "LiveLine":
        self._thread.start()
        return self

    def __exit__(self, *_error: object) -> None:
        self._end.set()
        self._thread.join(CLOSE_S)

    def show(self, status: "Status") -> None:
        """How it is going."""
        self._status = status

    def tell(self, event: "Event") -> None:
        """An event above the line: what went wrong always, the rest if asked for."""
        told = event.level != "info" or (self._talk and event.text.startswith(self._talk))
        if self._verbose or (told and not self._quiet):
            self.say(f"{event.t_ns / 1e9:7.1f} s {event.text}")

    def say(self, text: str) -> None:
        """A line of its own."""
        self._lines.append(text)

    def _work(self) -> None:
        try:
            while not self._end.wait(EVERY_S):
                self._write()
                self._write_status()
            self._write()
        except (OSError, ValueError):  # ValueError: it is closed
            self.lost = True

    def _write(self) -> None:
        self._wipe()
        while self._lines:
            _put(self._lines.popleft() + "\n")

    def _write_status(self) -> None:
        status, now_s = self._status, time.monotonic()
        if status is None or self._quiet or not (self._live or now_s - self._shown_s >= PLAIN_EVERY_S):
            return
        self._shown_s = now_s
        volts = "" if status.battery_volts is None else f", {status.battery_volts:.1f} V"
        text = (
            f"{status.t_ns / 1e9:7.1f} s, {status.sips_per_s:4.1f} SIPs/s, {status.sweeps} sweeps, "
            f"{status.readings} readings, {status.bad_packets} bad packets{volts}"
        )
        if self._live:
            _put(text)
            self._width = len(text)
        else:
            _put(text.strip() + "\n")

    def _wipe(self) -> None:
        if self._width:
            _put("\r" + " " * self._width + "\r")
            self._width = 0


def _put(text: str) -> None:
    """To stderr without Python's buffer: a thread that hangs with its lock would make Python die at its end."""
    try:
        number = sys.stderr.fileno()
    except (OSError, ValueError):  # something stands in for it
        click.echo(text, err=True, nl=False)
        return
    data = text.encode(sys.stderr.encoding or "utf-8", "replace")
    while data:
        data = data[os.write(number, data) :]
