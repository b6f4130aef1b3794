"""The connection: one robot over a line that may break, be opened again, and speak at another rate.

Must not know: what is recorded, routes.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from sonarlog.log import Event
from sonarlog.protocol.commands import Command, encode_command
from sonarlog.session import NoAnswer, RobotSilent, Session
from sonarlog.transport import Link, LinkLost, PortNotOpened

SECOND = 1_000_000_000
BAUDS = (9600, 38400, 115200, 19200, 57600)  # in the order of likelihood after a dead client
HOSTBAUD = {9600: 0, 19200: 1, 38400: 2, 57600: 3, 115200: 4}
FASTER = 38400
PROBE_TRIES = 3
BACKOFF_S = (0.25, 0.5, 1.0, 2.0, 4.0)
ANSWER_NS = 900_000_000  # how long a packet at a new rate may take
Lost = LinkLost | RobotSilent | NoAnswer


@dataclass(frozen=True)
class Again:
    """How to come back to a lost robot: `open` the port once more (raises PortNotOpened), `sleep` before it, and
    give it up after so many seconds of the clock on the wall.
    """

    open: Callable[[], Link]
    sleep: Callable[[float], None]
    give_up_s: float = 60.0


@dataclass
class _Outage:
    error: Lost
    since_ns: int  # wall
    tries: int = 0


class Connection:
    """A link and the session over it. `again` None: what is lost stays lost."""

    def __init__(self, link: Link, session: Session, wall_ns: Callable[[], int], again: Again | None) -> None:
        self.link = link
        self.session = session
        self._wall_ns = wall_ns
        self._again = again
        self._outage: _Outage | None = None
        self._met = False  # SIPs have flowed once
        self._bauds: Iterator[int] | None = None
        self._first_baud = 0
        self._first_refusal: NoAnswer | None = None  # before other rates were tried
        self._slower: tuple[int, int] | None = None  # the rate before the change, and when that was
        self._asked_for_speed = False
        self._events: list[Event] = []

    def take_events(self) -> list[Event]:
        """What happened since this was asked last."""
        events, self._events = self._events, []
        return events + self.session.take_events()

    def note_open(self) -> None:
        """To be called now and then: whether what was lost is back."""
        if not self.session.open:
            return
        self._met, self._bauds = True, None
        if self._outage is not None:
            lost_s = (self._wall_ns() - self._outage.since_ns) / SECOND
            self._outage = None
            self._event("warn", f"connected again after {lost_s:.1f} s: odometry starts anew")

    def recover(self, error: Lost, stop: Callable[[], bool]) -> None:
        """Try another rate, or wait and open the port again; returns when there is a line to try. Raises `error`, or
        what was the first of it, where there is nothing more to try.
        """
        if isinstance(error, NoAnswer):
            if self._next_baud():
                self._first_refusal = self._first_refusal or error
                return
            error = self._first_refusal or error
        if self._outage is None:
            if not self._met or self._again is None:
                raise error
            self._outage = _Outage(error, self._wall_ns())
            self._event("error", f"{error}; trying again for {self._again.give_up_s:.0f} s")
        self._reopen(self._outage, stop)

    def change_baud(self, *, robot_is_real: bool) -> bytes:
        """HOSTBAUD, where a serial robot offers more than this rate; a rate that brings nothing is left again.

        The bytes returned have been sent already: they are for the record.
        """
        now_ns = self.link.now_ns()
        if self._slower is not None:
            slower, since_ns = self._slower
            if self.session.heard_ns > since_ns:
                self._slower = None
                self._event("info", f"the line runs at {self.link.baud} baud now")
            elif now_ns - since_ns > ANSWER_NS:
                self._slower = None
                self.link.set_baud(slower)
                self._event("warn", f"nothing is heard at {FASTER} baud: back to {slower}")
            return b""
        baud = self.link.baud
        if self._asked_for_speed or not robot_is_real or baud is None or baud >= FASTER or not self.session.open:
            return b""
        if self.session.config is None or self.session.config.get("autobaud") not in (1, 2):
            return b""
        self._asked_for_speed = True
        ask, pulse = encode_command(Command.HOSTBAUD, HOSTBAUD[FASTER]), encode_command(Command.PULSE)
        self.link.write(ask)
        self.link.set_baud(FASTER)
        self.link.write(pulse)
        self._slower = (baud, self.link.now_ns())
        return ask + pulse

    def _next_baud(self) -> bool:
        """Whether there is another rate to try the handshake at."""
        baud = self.link.baud
        if baud is None:
            return False
        if self._bauds is None:
            self._bauds = iter([rate for rate in BAUDS if rate != baud])
            self._first_baud = baud
        rate = self._first_baud if self.session.cleared and baud != self._first_baud else next(self._bauds, None)
        if rate is None:
            return False
        self._event("warn", f"no answer at {baud} baud: trying {rate}")
        self.link.set_baud(rate)
        self.session.restart(self.link.now_ns(), PROBE_TRIES)
        return True

    def _reopen(self, outage: _Outage, stop: Callable[[], bool]) -> None:
        assert self._again is not None
        self.link.close()
        while not stop():
            if self._wall_ns() - outage.since_ns > self._again.give_up_s * SECOND:
                raise outage.error
            left_s = BACKOFF_S[min(outage.tries, len(BACKOFF_S) - 1)]
            outage.tries += 1
            while left_s > 0 and not stop():
                self._again.sleep(min(left_s, 0.1))
                left_s -= 0.1
            try:
                self.link = self._again.open()
            except PortNotOpened:
                continue
            self._bauds, self._slower, self._asked_for_speed = None, None, False
            self.session.restart(self.link.now_ns())
            self._event("info", "the port is open again")
            return

    def _event(self, level: str, text: str) -> None:
        self._events.append(Event(self.link.now_ns(), level, text))
