"""What a run shows in any viewer: map, paths, frames, walls by chain, readings by class, a line of text a sweep.

Must not know: files, digests' meaning.
"""

import numpy as np

from slam import dmath
from slam.geometry import Pose
from slam.grid import LIMIT, Grid
from slam.pipeline import Step
from slam.reliability import NO_ECHO
from sonarlog import ros2
from sonarlog.cdr import definition, encode, type_name
from sonarlog.mcap_file import McapWriter
from sonarlog.recording.layout import BASE_FRAME, MAP_FRAME, ODOM_FRAME, orientation
from sonarlog.ros2_markers import DELETE_ALL, LINE_LIST, Marker, MarkerArray

COLOURS = (  # Okabe and Ito: told apart by colour-blind readers too
    (0.90, 0.62, 0.00), (0.34, 0.71, 0.91), (0.00, 0.62, 0.45), (0.94, 0.89, 0.26),
    (0.00, 0.45, 0.70), (0.84, 0.37, 0.00), (0.80, 0.47, 0.65),
)  # fmt: skip

CHANNELS: dict[str, type] = {
    "/tf": ros2.TFMessage,
    "/map": ros2.OccupancyGrid,
    "/path": ros2.Path,
    "/path_odometry": ros2.Path,
    "/walls": MarkerArray,
    "/walls/points": ros2.PointCloud2,
    "/readings": ros2.PointCloud2,
    "/rosout": ros2.Log,
}

# Percent of being occupied for log-odds × 10 of −LIMIT..LIMIT; 0 is unknown.
_PERCENT = np.rint(100.0 / (1.0 + dmath.exp(-np.arange(-LIMIT, LIMIT + 1) / 10.0))).astype(np.int8)
_PERCENT[LIMIT] = -1


class RunTopics:
    """Standard ROS 2 messages of every step."""

    def __init__(self, writer: McapWriter) -> None:
        self._writer = writer
        self._channels = {t: writer.channel(t, type_name(kind), definition(kind)) for t, kind in CHANNELS.items()}
        self._odometry: list[ros2.PoseStamped] = []
        self._path: list[ros2.PoseStamped] = []

    def add(self, step: Step, index: int, chain: str) -> None:
        """Everything of one sweep, stamped with its reference reading's time."""
        t_ns = int(step.sweep.t_ns[step.sweep.reference])
        stamp = ros2.Time.of(t_ns)
        header = ros2.Header(stamp, MAP_FRAME)
        self._path.append(ros2.PoseStamped(header, _ros_pose(step.pose)))
        self._odometry.append(ros2.PoseStamped(header, _ros_pose(step.calibrated.odometry)))
        for topic, message in (
            ("/tf", _frames(step, stamp)),
            ("/map", _map(step.state.grid, header)),
            ("/path", ros2.Path(header, tuple(self._path))),
            ("/path_odometry", ros2.Path(header, tuple(self._odometry))),
            ("/walls", _walls(step, header)),
            ("/walls/points", _wall_points(step, header)),
            ("/readings", _readings(step, header)),
            ("/rosout", ros2.Log(stamp, ros2.LEVELS["info"], "replay", f"sweep {index}: {told(step)} [{chain}]")),
        ):
            self._writer.write(self._channels[topic], t_ns, encode(message))


def told(step: Step) -> str:
    """What the blocks decided, in a line."""
    found, linked = step.localisation, len(step.association.links)
    goal = step.decision.chosen
    where = "nothing reachable is unknown"
    if goal is not None:
        x, y = step.decision.regions[goal].centre
        where = f"goal ({x:.2f}, {y:.2f}) m"
    return (
        f"{len(step.reliability.rcds)} RCDs, {len(step.features.walls)} walls ({linked} joined a chain), "
        f"{len(step.features.corners)} corners; turned {found.turn_deg:+.1f}°, "
        f"shifted ({found.shift[0]:+.2f}, {found.shift[1]:+.2f}) m; {where}"
    )


def _ros_pose(pose: Pose) -> ros2.Pose:
    return ros2.Pose(ros2.Point(pose.x, pose.y), orientation(pose.theta))


def _transform(header: ros2.Header, child: str, pose: Pose) -> ros2.TransformStamped:
    moved = ros2.Transform(ros2.Vector3(pose.x, pose.y), orientation(pose.theta))
    return ros2.TransformStamped(header, child, moved)


def _frames(step: Step, stamp: ros2.Time) -> ros2.TFMessage:
    """map → odom → base_link: what localisation corrected, then what the robot thinks."""
    odometry = step.calibrated.odometry
    correction = step.pose.compose(odometry.step_to(Pose(0.0, 0.0, 0.0)))
    return ros2.TFMessage(
        (
            _transform(ros2.Header(stamp, MAP_FRAME), ODOM_FRAME, correction),
            _transform(ros2.Header(stamp, ODOM_FRAME), BASE_FRAME, odometry),
        )
    )


def _map(grid: Grid, header: ros2.Header) -> ros2.OccupancyGrid:
    cells, left, bottom = grid.dense()
    height, width = cells.shape
    corner = ros2.Pose(ros2.Point(left * grid.cell_m, bottom * grid.cell_m))
    info = ros2.MapMetaData(header.stamp, grid.cell_m, width, height, corner)
    return ros2.OccupancyGrid(header, info, _PERCENT[cells + LIMIT].tobytes())


def _colour(chain: int) -> tuple[float, float, float]:
    return COLOURS[chain % len(COLOURS)]


def _walls(step: Step, header: ros2.Header) -> MarkerArray:
    """Every chain's walls as lines, the roots twice as thick."""
    chains, roots = step.state.chains, set(step.state.chains.roots)
    markers = [Marker(header, "walls", 0, LINE_LIST, action=DELETE_ALL)]
    for number, member in enumerate(chains.members):
        ends = tuple(ros2.Point(x, y) for x, y in (member.segment.start, member.segment.end))
        width = 0.06 if number in roots else 0.03
        colour = ros2.Color(*_colour(member.chain), 1.0)
        markers.append(Marker(header, "walls", number, LINE_LIST, scale=ros2.Vector3(width), color=colour, points=ends))
    return MarkerArray(tuple(markers))


def _cloud(header: ros2.Header, points: np.ndarray[tuple[int, int], np.dtype[np.float32]]) -> ros2.PointCloud2:
    """Points (n, 4) of x, y, z and one value."""
    names = ("x", "y", "z", "value")
    fields = tuple(ros2.PointField(name, 4 * i, ros2.FLOAT32, 1) for i, name in enumerate(names))
    data = points.astype("<f4").tobytes()
    return ros2.PointCloud2(header, 1, len(points), fields, False, 16, len(data), data, True)


def _wall_points(step: Step, header: ros2.Header) -> ros2.PointCloud2:
    """Nine points on every wall, valued by its chain: for viewers that draw clouds but no markers."""
    part = np.arange(9) / 8.0
    rows = [np.zeros((0, 4))]
    for member in step.state.chains.members:
        (x0, y0), (x1, y1) = member.segment.start, member.segment.end
        zero = np.zeros(9)
        rows.append(np.stack([x0 + part * (x1 - x0), y0 + part * (y1 - y0), zero, zero + member.chain], axis=1))
    return _cloud(header, np.concatenate(rows).astype(np.float32))


def _readings(step: Step, header: ros2.Header) -> ros2.PointCloud2:
    """Echoes on their beams' axes, valued by reliability class."""
    classes = step.reliability.reading_class
    seen = classes != NO_ECHO
    echoes = step.posed.echoes[seen]
    points = np.column_stack([echoes, np.zeros(len(echoes)), classes[seen]])
    return _cloud(header, points.astype(np.float32))
