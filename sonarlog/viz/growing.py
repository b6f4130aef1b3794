"""An exploration as it goes on: the map as it grows, stations, frontier, goal and way; and what is heard meanwhile.

Must not know: Rerun, the thread that draws, how it is decided.
"""

from collections import deque
from collections.abc import Sequence

import numpy as np

from slam.geometry import ORIGIN, Pose
from slam.pipeline import Step
from sonarlog.decode import Sample
from sonarlog.exploring.mapper import described
from sonarlog.log import Floats
from sonarlog.picture import BLUE, GREEN, PURPLE
from sonarlog.robot import Robot
from sonarlog.surroundings import place
from sonarlog.viz.blocks import BLOCK_PATHS, robot
from sonarlog.viz.live import echoes_of
from sonarlog.viz.scene import FRONTIER, GRID, Scene
from sonarlog.viz.shapes import GREY, Dots, Labels, Shape, Strips

HEARD = 400  # so many of the last echoes are shown
SHOWN = (GRID, FRONTIER, BLOCK_PATHS["I"], "map/path/corrected", "map/chains/walls")
"""Entity paths of a replay's scene that are shown of an exploration, too."""
HERE = f"{BLOCK_PATHS['I']}/robot"


class Growing:
    """A `sonarlog.viz.live.Drawing` in the map's frame; in odometry's until there is a map."""

    def __init__(self) -> None:
        self._robot: Robot | None = None
        self._scene: Scene | None = None
        self._stations = 0
        self._carry = ORIGIN  # odometry's frame in the map
        self._heard: deque[tuple[float, float]] = deque(maxlen=HEARD)
        self._way: list[tuple[float, float]] = []  # since the last station

    def samples(self, samples: Sequence[tuple[Sample, Robot]]) -> dict[str, Shape]:
        """Where the robot is, which way it came from the last station, and the last echoes."""
        for sample, known in samples:
            self._robot = known
            assert sample.pose is not None
            self._way.append((sample.pose.x_um / 1e6, sample.pose.y_um / 1e6))
            self._heard.extend(echoes_of(sample, known))
        last, known = samples[-1]
        assert last.pose is not None
        here = place(last.pose)
        pose = self._carry.compose(Pose(here.x, here.y, float(np.radians(here.heading_deg))))
        return {
            "map/live/robot": Strips(robot(pose, known.radius_mm / 1e3), [GREEN], 2.5),
            "map/live/way": Strips([self._in_map(self._way)], [GREY], 1.5),
            "map/live/echoes": Dots(self._in_map(self._heard), BLUE, 2.0),
        }

    def step(self, step: Step) -> tuple[dict[str, Shape], str, float | None]:
        """What a station adds, what was decided there in words, and with the first the heading that is to the right."""
        first = self._scene is None
        if self._scene is None:
            assert self._robot is not None
            self._scene = Scene(self._robot.ring(), self._robot.radius_mm / 1e3, None)
        shown = self._scene.show(step)
        self._carry = step.pose.compose(step.calibrated.odometry.step_to(ORIGIN))
        self._way = []
        self._stations += 1
        shapes = {path: shape for path, shape in shown.shapes.items() if path.startswith(SHOWN) and path != HERE}
        stations = np.array([(pose.x, pose.y) for pose in step.state.poses])
        shapes["map/stations"] = Dots(stations, PURPLE, 4.0)
        shapes["map/stations/last"] = Labels(stations[-1:], (str(self._stations - 1),))
        words = f"### Station {self._stations - 1}\n\n{described(step)}\n\n{shown.text.partition(chr(10))[2]}"
        return shapes, words, step.calibrated.odometry.theta if first else None

    def _in_map(self, points: Sequence[tuple[float, float]]) -> Floats:
        return self._carry.points(np.array(points).reshape(-1, 2))
