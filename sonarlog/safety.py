"""When a robot must not drive on, whatever its route says: someone or something has stopped it.

Must not know: routes, commands, the line.
"""

from sonarlog.protocol.packets import E_STALL, MOTORS, STOP_BUTTON, Sip

BUMPS = 0xFEFE  # of Sip.stall_bumps: all but the two stall bits
STALLED_SIPS = 3  # in a row; a wheel that slips for a moment is no obstacle
RECOVERY_SIPS = 60  # in a row; six seconds to get off what was touched


class Guard:
    """Looks at each SIP of one session for a reason to halt.

    Only once the motors are on: before, STOP button and bumpers are no news, and nothing moves.
    """

    def __init__(self, *, recovers: bool = False) -> None:
        """`recovers`: whoever drives backs off by itself; only where that does not help is it halted."""
        self._driven = False
        self._patience = RECOVERY_SIPS if recovers else 0
        self._stalls = 0
        self._bumps = 0

    def halts(self, sip: Sip) -> str:
        """Why the route is to be halted, in words; nothing where all is well."""
        if not self._driven:
            self._driven = bool(sip.flags & MOTORS)
            return ""
        self._stalls = self._stalls + 1 if sip.stalled else 0
        self._bumps = self._bumps + 1 if sip.stall_bumps & BUMPS else 0
        why = ""
        if sip.flags & STOP_BUTTON:
            why = "the STOP button is pressed"
        elif sip.flags & E_STALL:
            why = "the robot made an emergency stop"
        elif self._bumps > self._patience:
            why = "a bumper is pressed"
        elif self._stalls >= max(STALLED_SIPS, self._patience):
            why = "the wheels stalled"
        elif not sip.flags & MOTORS:
            why = "the motors were switched off"
        return why
