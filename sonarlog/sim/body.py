"""The robot's body: where it truly is, where its wheels think it is, and the walls that stop it.

Metres and radians; headings are not wrapped. Must not know: commands, packets, time.
"""

from math import inf, sqrt

from slam.dmath import DEGREE, PI, sincos
from slam.sweep import TURN
from sonarlog.sim.faults import Kick
from sonarlog.sim.odometry import Floor
from sonarlog.sim.world import World

_FAR = 2000.0
"""Here the world ends: micrometres in 32 bits reach no further."""


class Body:
    """A round robot of that radius at the start of that world; a kick moves it once."""

    def __init__(self, world: World, floor: Floor, radius: float, kick: Kick | None = None) -> None:
        self._floor = floor
        self._radius = radius
        self._walls = [(w.x0, w.y0, (w.x1 - w.x0) / w.length, (w.y1 - w.y0) / w.length, w.length) for w in world.walls]
        self._poles = [(p.x, p.y, p.radius) for p in world.poles]
        self._kick = kick
        self._driven = 0.0  # metres the wheels have run either way
        self.travel, self.turned = 0.0, 0.0  # metres and radians the wheels have run, ever
        self.stalled = False
        self.place(0.0, 0.0, 0.0)
        self.reset_odometry()

    def place(self, x: float, y: float, heading: float) -> None:
        """Lift it and set it down there; odometry does not notice."""
        self.x, self.y, self.heading = min(max(x, -_FAR), _FAR), min(max(y, -_FAR), _FAR), heading
        self._room = 0.0  # so far it can surely go before it touches anything

    def reset_odometry(self) -> None:
        """Odometry says (0, 0, 0) here."""
        self.odometry_x, self.odometry_y, self.odometry_heading = 0.0, 0.0, 0.0

    @property
    def true_pose(self) -> tuple[int, int, int]:
        """x µm, y µm, heading in 1/TURN of a turn, in ±TURN/2."""
        heading = round(self.heading / (2.0 * PI) * TURN)
        return round(self.x * 1e6), round(self.y * 1e6), (heading + TURN // 2) % TURN - TURN // 2

    def roll(self, distance: float, turn: float) -> None:
        """Let the wheels run that far forward and round; `stalled` says afterwards whether a wall held them."""
        true_distance, true_turn = self._floor.true_motion(distance, turn)
        if distance != 0.0:
            sine, cosine = sincos(self.heading + 0.5 * true_turn)
            self.stalled = not self._go(self.x + true_distance * cosine, self.y + true_distance * sine)
            if not self.stalled:
                sine, cosine = sincos(self.odometry_heading + 0.5 * turn)
                self.odometry_x += distance * cosine
                self.odometry_y += distance * sine
                self.travel += distance
        self.heading += true_turn
        self.odometry_heading += turn
        self.turned += turn
        self._driven += abs(distance)
        if self._kick and self._driven >= self._kick.after:
            self._take(self._kick)
            self._kick = None

    def _take(self, kick: Kick) -> None:
        """Be moved; where there is no room, to the other side; where there is none either, nowhere."""
        sine, cosine = sincos(self.heading)
        x, y = kick.ahead * cosine - kick.aside * sine, kick.ahead * sine + kick.aside * cosine
        for way in (1.0, -1.0):
            part = [(self.x + way * x * k / 10, self.y + way * y * k / 10) for k in range(1, 11)]
            through = any(self._clearance(*point) < self._radius / 2 for point in part)
            if not through and self._clearance(*part[-1]) >= self._radius:
                self.place(*part[-1], self.heading + kick.turn * DEGREE)
                return

    def _go(self, x: float, y: float) -> bool:
        """Go there, unless that is nearer to something than the radius, and nearer than now."""
        if max(abs(x), abs(y)) > _FAR:
            return False
        dx, dy = x - self.x, y - self.y
        self._room -= sqrt(dx * dx + dy * dy)
        if self._room <= 0.0:
            clearance = self._clearance(x, y)
            if clearance < self._radius and clearance < self._clearance(self.x, self.y):
                self._room = 0.0
                return False
            self._room = clearance - self._radius
        self.x, self.y = x, y
        return True

    def _clearance(self, x: float, y: float) -> float:
        """Metres from there to the nearest surface."""
        nearest = inf
        for x0, y0, ux, uy, length in self._walls:
            dx, dy = x - x0, y - y0
            along = min(max(dx * ux + dy * uy, 0.0), length)
            dx, dy = dx - along * ux, dy - along * uy
            nearest = min(nearest, dx * dx + dy * dy)
        nearest = sqrt(nearest)
        for cx, cy, radius in self._poles:
            dx, dy = x - cx, y - cy
            nearest = min(nearest, abs(sqrt(dx * dx + dy * dy) - radius))
        return nearest
