"""The motion server: commands set goals, and the wheels follow them within the accelerations.

Metres, radians, seconds inside; the commands' mm and degrees end here. Must not know: packets, sonar, sessions.
"""

from math import sqrt

from slam.dmath import DEGREE, PI
from sonarlog.protocol.commands import Call, Command, split_wheels
from sonarlog.robot import Robot
from sonarlog.sim.body import Body

TICK_NS = 10_000_000
HALF_TRACK_MM = 1.0 / 0.011
"""From DiffConvFactor of the AmigoBots: a convention of clients, not a measured width."""
ACCELERATION_MM_S2, TURN_ACCELERATION_DEG_S2, MAX_TURN_DEG_S = 300, 100, 150
_TICK_S = TICK_NS / 1e9
_HARD = (2.0, 300.0 * DEGREE)  # what an emergency stop may do: m/s², rad/s²
_WHEEL_STEP_M_S = 0.02  # VEL2 counts in 20 mm/s


class Drive:
    """Wheels with motors, which are off at first; `speed` (m/s) and `turn` (rad/s) are the wheels'."""

    def __init__(self, robot: Robot, body: Body) -> None:
        self._robot = robot
        self._body = body
        self.switch_off()

    def switch_off(self) -> None:
        """Motors off, limits back to what the robot's memory says."""
        self.enabled = False
        self.speed = self.turn = 0.0
        self._acceleration = self._deceleration = ACCELERATION_MM_S2 / 1000
        self._turn_acceleration = self._turn_deceleration = TURN_ACCELERATION_DEG_S2 * DEGREE
        self._max_speed = self._robot.max_velocity_mm_s / 1000
        self._max_turn = min(MAX_TURN_DEG_S, self._robot.max_turn_deg_s) * DEGREE
        self._stop()

    @property
    def wheels_mm_s(self) -> tuple[float, float]:
        """Speed of the left and of the right wheel."""
        return self.speed * 1000 - self.turn * HALF_TRACK_MM, self.speed * 1000 + self.turn * HALF_TRACK_MM

    @property
    def moving(self) -> bool:
        """Faster than a millimetre or a tenth of a degree a second."""
        return abs(self.speed) > 0.001 or abs(self.turn) > 0.1 * DEGREE

    def obey(self, call: Call) -> None:
        """Take a motion command; others, and those whose argument is missing, change nothing."""
        if call.number in (Command.STOP, Command.E_STOP):
            self._stop(hard=call.number == Command.E_STOP)
        elif isinstance(call.argument, int):
            if call.number == Command.ENABLE:
                if self.enabled != (call.argument != 0):
                    self._stop()
                self.enabled = call.argument != 0
            elif call.number in _LIMITS:
                self._set_limit(call.number, call.argument)
            elif self.enabled:
                self._set_goal(call.number, call.argument)

    def _stop(self, hard: bool = False) -> None:
        self._hard = hard
        self._goal_speed = self._goal_turn = 0.0
        self._goal_travel: float | None = None
        self._goal_turned: float | None = None

    def _set_limit(self, number: int, value: int) -> None:
        size = abs(value) / 1000 if number in (Command.SETV, Command.SETA) else abs(value) * DEGREE
        if number == Command.SETV:
            self._max_speed = min(size, self._robot.max_velocity_mm_s / 1000)
        elif number == Command.SETRV:
            self._max_turn = min(size, self._robot.max_turn_deg_s * DEGREE)
        elif number == Command.SETA and value > 0:
            self._acceleration = size
        elif number == Command.SETA and value < 0:
            self._deceleration = size
        elif number == Command.SETRA and value > 0:
            self._turn_acceleration = size
        elif number == Command.SETRA and value < 0:
            self._turn_deceleration = size

    def _set_goal(self, number: int, value: int) -> None:
        turned = self._body.turned
        if number == Command.VEL:
            self._go_at(value / 1000)
        elif number == Command.MOVE:
            self._hard, self._goal_travel = False, self._body.travel + value / 1000
        elif number in (Command.RVEL, Command.ROTATE):
            self._turn_at(value * DEGREE)
        elif number == Command.DHEAD:
            self._turn_to(turned + value * DEGREE)
        elif number == Command.DCHEAD:
            self._turn_to((turned if self._goal_turned is None else self._goal_turned) + value * DEGREE)
        elif number == Command.HEAD:
            turns = (value * DEGREE - self._body.odometry_heading) / (2.0 * PI)
            self._turn_to(turned + (turns - round(turns)) * 2.0 * PI)
        elif number == Command.VEL2:
            left, right = split_wheels(value)
            self._go_at((left + right) / 2 * _WHEEL_STEP_M_S)
            self._turn_at((right - left) / 2 * _WHEEL_STEP_M_S * 1000 / HALF_TRACK_MM)

    def _go_at(self, speed: float) -> None:
        self._hard, self._goal_travel, self._goal_speed = False, None, speed

    def _turn_at(self, turn: float) -> None:
        self._hard, self._goal_turned, self._goal_turn = False, None, turn

    def _turn_to(self, turned: float) -> None:
        self._hard, self._goal_turned = False, turned

    def tick(self, halted: bool) -> None:
        """One tick of motion. `halted`: the watchdog holds the robot, but the goals stay."""
        body = self._body
        body.stalled = False
        still = halted or not self.enabled
        goal, turn_goal = (0.0, 0.0) if still else self._goals()
        slower, turn_slower = _HARD if self._hard or not self.enabled else (self._deceleration, self._turn_deceleration)
        self.speed = _toward(self.speed, goal, self._acceleration, slower)
        self.turn = _toward(self.turn, turn_goal, self._turn_acceleration, turn_slower)
        if self.speed == 0.0 == self.turn:
            return
        body.roll(self.speed * _TICK_S, self.turn * _TICK_S)
        if body.stalled:
            self.speed = 0.0

    def _goals(self) -> tuple[float, float]:
        """Speeds to aim at in this tick, within the limits."""
        speed, turn = self._goal_speed, self._goal_turn
        if self._goal_travel is not None:
            speed = _approach(self._goal_travel - self._body.travel, self._deceleration)
        if self._goal_turned is not None:
            turn = _approach(self._goal_turned - self._body.turned, self._turn_deceleration)
        return (
            min(max(speed, -self._max_speed), self._max_speed),
            min(max(turn, -self._max_turn), self._max_turn),
        )


_LIMITS = (Command.SETV, Command.SETRV, Command.SETA, Command.SETRA)


def _approach(left: float, deceleration: float) -> float:
    """The speed from which that deceleration just stops in what is left of the way."""
    speed = min(sqrt(2.0 * deceleration * abs(left)), abs(left) / _TICK_S)
    return speed if left > 0.0 else -speed


def _toward(value: float, goal: float, faster: float, slower: float) -> float:
    """One tick nearer to the goal; through zero it brakes first."""
    if value * goal < 0.0:
        goal = 0.0
    step = (faster if abs(goal) > abs(value) else slower) * _TICK_S
    return goal if abs(goal - value) <= step else value + (step if goal > value else -step)
