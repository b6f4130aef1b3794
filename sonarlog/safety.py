"""When a robot must not drive on, whatever its route says: someone or something has stopped it.

Must not know: routes, commands, the line.
"""

from sonarlog.protocol.packets import E_STALL, MOTORS, STOP_BUTTON, Sip

BUMPS = 0xFEFE  # of Sip.stall_bumps: all but the two stall bits
STALLED_SIPS = 3  # in a row; a wheel that slips for a moment is no obstacle


class Guard:
    """Looks at each SIP of one session for a reason to halt.

    Only once the motors are on: before, STOP button and bumpers are no news, and nothing moves.
    """

    def __init__(self) -> None:
        self._driven = False
        self._stalls = 0

    def halts(self, sip: Sip) -> str:
        """Why the route is to be halted, in words; nothing where all is well."""
        if not self._driven:
            self._driven = bool(sip.flags & MOTORS)
            return ""
        self._stalls = self._stalls + 1 if sip.stalled else 0
        why = ""
        if sip.flags & STOP_BUTTON:
            why = "the STOP button is pressed"
        elif sip.flags & E_STALL:
            why = "the robot made an emergency stop"
        elif sip.stall_bumps & BUMPS:
            why = "a bumper is pressed"
        elif self._stalls >= STALLED_SIPS:
            why = "the wheels stalled"
        elif not sip.flags & MOTORS:
            why = "the motors were switched off"
        return why
