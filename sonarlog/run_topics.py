"""What a run shows in any viewer: map, paths, frames, walls by chain, readings by class, a line of text a sweep.

What grows with the log is written whole only when it has grown by a tenth, and at the end; in between only what is new.
So a long run's sweeps take as much room and time as a short one's. Must not know: files, digests' meaning.
"""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from slam.association import Member
from slam.geometry import Pose
from slam.pipeline import Step
from slam.reliability import NO_ECHO
from sonarlog import ros2
from sonarlog.cdr import definition, encode, type_name
from sonarlog.mcap_file import McapWriter
from sonarlog.recording.layout import BASE_FRAME, MAP_FRAME, ODOM_FRAME, orientation
from sonarlog.ros2_maps import OccupancyGridUpdate
from sonarlog.ros2_markers import LINE_LIST, Marker, MarkerArray
from sonarlog.run_map import MapMessages

COLOURS = (  # Okabe and Ito: told apart by colour-blind readers too
    (0.90, 0.62, 0.00), (0.34, 0.71, 0.91), (0.00, 0.62, 0.45), (0.94, 0.89, 0.26),
    (0.00, 0.45, 0.70), (0.84, 0.37, 0.00), (0.80, 0.47, 0.65),
)  # fmt: skip

CHANNELS: dict[str, type] = {
    "/tf": ros2.TFMessage,
    "/map": ros2.OccupancyGrid,
    "/map_updates": OccupancyGridUpdate,
    "/path": ros2.Path,
    "/path_odometry": ros2.Path,
    "/walls": MarkerArray,
    "/walls/new": MarkerArray,
    "/walls/points": ros2.PointCloud2,
    "/readings": ros2.PointCloud2,
    "/rosout": ros2.Log,
}


class RunTopics:
    """Standard ROS 2 messages of every step."""

    def __init__(self, writer: McapWriter) -> None:
        self._writer = writer
        self._channels = {t: writer.channel(t, type_name(kind), definition(kind)) for t, kind in CHANNELS.items()}
        self._map = MapMessages()
        self._stamps: list[ros2.Time] = []
        self._odometry: list[ros2.Pose] = []
        self._told: dict[str, int] = {}  # how long each topic's last whole was
        self._last: Step | None = None

    def add(self, step: Step, index: int, chain: str) -> None:
        """Everything of one sweep, stamped with its reference reading's time."""
        t_ns = int(step.sweep.t_ns[step.sweep.reference])
        header = ros2.Header(ros2.Time.of(t_ns), MAP_FRAME)
        members = step.state.chains.members
        new = members[len(self._last.state.chains.members) if self._last else 0 :]
        self._last = step
        self._stamps.append(header.stamp)
        self._odometry.append(_ros_pose(step.calibrated.odometry))
        self._write("/tf", t_ns, _frames(step, header.stamp))
        self._write("/readings", t_ns, _readings(step, header))
        self._write("/walls/new", t_ns, MarkerArray(tuple(_lines(header, "new", new, step))))
        for topic, message in self._map.after(step.state.grid, header):
            self._write(topic, t_ns, message)
        self._write_wholes(step, header)
        text = f"sweep {index}: {told(step)} [{chain}]"
        self._write("/rosout", t_ns, ros2.Log(header.stamp, ros2.LEVELS["info"], "replay", text))

    def finish(self) -> None:
        """All that was not written whole with the last sweep, as it was then."""
        if self._last is not None:
            header = ros2.Header(self._stamps[-1], MAP_FRAME)
            self._write("/map", header.stamp.ns, self._map.whole(self._last.state.grid, header))
            self._write_wholes(self._last, header, always=True)

    def _write_wholes(self, step: Step, header: ros2.Header, *, always: bool = False) -> None:
        """Paths and walls, those that have grown by a tenth."""
        members = step.state.chains.members
        wholes: dict[str, tuple[int, Callable[[], object]]] = {
            "/path": (
                len(self._stamps),
                lambda: self._whole_path([_ros_pose(pose) for pose in step.state.poses], header),
            ),
            "/path_odometry": (len(self._stamps), lambda: self._whole_path(self._odometry, header)),
            "/walls": (len(members), lambda: MarkerArray(tuple(_lines(header, "walls", members, step)))),
            "/walls/points": (len(members), lambda: _wall_points(members, header)),
        }
        for topic, (size, made) in wholes.items():
            before = self._told.get(topic, 0)
            if always or 10 * abs(size - before) > before:
                self._told[topic] = size
                self._write(topic, header.stamp.ns, made())

    def _whole_path(self, poses: Sequence[ros2.Pose], header: ros2.Header) -> ros2.Path:
        stamped = (
            ros2.PoseStamped(ros2.Header(stamp, MAP_FRAME), pose)
            for stamp, pose in zip(self._stamps, poses, strict=True)
        )
        return ros2.Path(header, tuple(stamped))

    def _write(self, topic: str, t_ns: int, message: object) -> None:
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


def _colour(chain: int) -> tuple[float, float, float]:
    return COLOURS[chain % len(COLOURS)]


def _lines(header: ros2.Header, space: str, members: Sequence[Member], step: Step) -> Iterator[Marker]:
    """Walls as lines coloured by chain, the roots twice as thick: a marker of all roots and one of all others."""
    chains = step.state.chains
    roots = {id(chains.members[root]) for root in chains.roots}
    for number, width in enumerate((0.03, 0.06)):
        chosen = [member for member in members if (id(member) in roots) == bool(number)]
        ends = tuple(ros2.Point(x, y) for m in chosen for x, y in (m.segment.start, m.segment.end))
        colours = tuple(ros2.Color(*_colour(m.chain), 1.0) for m in chosen for _ in (0, 1))
        yield Marker(header, space, number, LINE_LIST, scale=ros2.Vector3(width), points=ends, colors=colours)


def _cloud(header: ros2.Header, points: np.ndarray[tuple[int, int], np.dtype[np.float32]]) -> ros2.PointCloud2:
    """Points (n, 4) of x, y, z and one value."""
    names = ("x", "y", "z", "value")
    fields = tuple(ros2.PointField(name, 4 * i, ros2.FLOAT32, 1) for i, name in enumerate(names))
    data = points.astype("<f4").tobytes()
    return ros2.PointCloud2(header, 1, len(points), fields, False, 16, len(data), data, True)


def _wall_points(members: Sequence[Member], header: ros2.Header) -> ros2.PointCloud2:
    """Nine points on every wall, valued by its chain: for viewers that draw clouds but no markers."""
    ends = np.array([(*member.segment.start, *member.segment.end) for member in members]).reshape(-1, 1, 4)
    part = np.arange(9) / 8.0
    points = np.zeros((len(members), 9, 4))
    points[:, :, :2] = ends[:, :, :2] + part[None, :, None] * (ends[:, :, 2:] - ends[:, :, :2])
    points[:, :, 3] = np.array([member.chain for member in members])[:, None]
    return _cloud(header, points.reshape(-1, 4).astype(np.float32))


def _readings(step: Step, header: ros2.Header) -> ros2.PointCloud2:
    """Echoes on their beams' axes, valued by reliability class."""
    classes = step.reliability.reading_class
    seen = classes != NO_ECHO
    echoes = step.posed.echoes[seen]
    points = np.column_stack([echoes, np.zeros(len(echoes)), classes[seen]])
    return _cloud(header, points.astype(np.float32))
