"""A log from ROS 2 topics: Range, Odometry and static TF, as imports of ours have them and any bag may.

Must not know: the wire, packets, how files are read.
"""

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from math import inf, isnan, pi

import numpy as np

from slam import dmath
from slam.sweep import TURN
from sonarlog import ros2
from sonarlog.calibration.correction import reckoning
from sonarlog.cdr import decode, type_name
from sonarlog.errors import SonarlogError
from sonarlog.log import Ints, Log, Odometry, Readings
from sonarlog.mcap_file import McapReader
from sonarlog.recording import layout
from sonarlog.robot import RADIANS, Robot, Sonar, load_robot

RANGE, ODOMETRY, FRAMES = type_name(ros2.Range), type_name(ros2.Odometry), type_name(ros2.TFMessage)
Source = tuple[str, str]  # topic and frame: some drivers send all sonars on one topic


class MissingTopics(SonarlogError):
    """A file without what a replay needs."""

    def __init__(self, file: McapReader, what: str) -> None:
        if file.damage:
            super().__init__(f"{file.damage[0]}; what is left {what}")
        else:
            super().__init__(f"{file.path} {what}: a replay needs /wire, or Range, Odometry and static TF topics")


@dataclass
class _Topics:
    """What was found, by kind."""

    ranges: list[tuple[int, Source, ros2.Range]] = field(default_factory=list)
    odometry: dict[str, list[tuple[int, ros2.Odometry]]] = field(default_factory=dict)
    frames: dict[str, ros2.TransformStamped] = field(default_factory=dict)  # by child


def log_from_topics(file: McapReader, robot: Robot | None, start_ns: int, given: Robot | None = None) -> Log:
    """Decode Range and Odometry; odometry is interpolated at each reading's moment.

    Of our own imports `robot` is known and integers come back as they went in. Of a foreign bag mountings come from
    static TF, beam and maximum range from the Range messages, body and timing are an AmigoBot's; readings at or above
    the maximum range are no echo, too close ones and NaN are left out. The topics' odometry is what the recording's own
    robot made of it; a robot `given` instead corrects it by its calibration. Raises MissingTopics, BadMessage.
    """
    topics = _collect(file)
    if not topics.ranges:
        raise MissingTopics(file, "holds no sonar readings")
    messages = _one_odometry(file, topics)
    base = messages[0][1].child_frame_id or layout.BASE_FRAME
    if robot is None:
        sources = sorted({source for _, source, _ in topics.ranges}, key=_natural)
        robot = _robot(file, topics, base, sources)
    else:
        sources = [(layout.sonar_topic(i), layout.sonar_frame(i)) for i in range(len(robot.sonars))]
    counts: Counter[str] = Counter()
    between = topics.odometry.get(layout.READING_ODOMETRY, [])
    places = _odometry(sorted([*messages, *between], key=lambda timed: timed[0]), start_ns)
    if given is not None:
        if len(given.sonars) != len(robot.sonars):
            raise MissingTopics(file, f"holds {len(robot.sonars)} sonars, the robot given has {len(given.sonars)}")
        robot, places = given, _corrected(places, given)
    rows = sorted(_rows(topics.ranges, sources, robot, start_ns, counts))
    readings = _placed(np.array(rows, dtype=np.int64).reshape(-1, 3), places, counts)
    counts["readings"] = len(readings.t_ns)
    own = np.isin(places.t_ns, [t_ns - start_ns for t_ns, _ in messages])
    odometry = Odometry(**{name: column[own] for name, column in vars(places).items()})
    return Log(robot, odometry, readings, counts=dict(counts))


def _collect(file: McapReader) -> _Topics:
    found = _Topics()
    for message in file.stream():
        if message.schema == RANGE:
            reading = decode(ros2.Range, message.data, optional=1)
            source = (message.topic, reading.header.frame_id)
            found.ranges.append((reading.header.stamp.ns or message.log_time_ns, source, reading))
        elif message.schema == ODOMETRY:
            odometry = decode(ros2.Odometry, message.data)
            timed = (odometry.header.stamp.ns or message.log_time_ns, odometry)
            if _finite(odometry.pose.pose.position, odometry.pose.pose.orientation):
                found.odometry.setdefault(message.topic, []).append(timed)
        elif message.schema == FRAMES and message.topic.endswith("tf_static"):
            for edge in decode(ros2.TFMessage, message.data).transforms:
                if _finite(edge.transform.translation, edge.transform.rotation):
                    found.frames[edge.child_frame_id] = edge
    return found


def _finite(place: ros2.Point | ros2.Vector3, turn: ros2.Quaternion) -> bool:
    """Whether a pose is one, near enough for its µm to be integers."""
    return all(abs(value) < 1e9 for value in (place.x, place.y, turn.x, turn.y, turn.z, turn.w))


def _one_odometry(file: McapReader, topics: _Topics) -> list[tuple[int, ros2.Odometry]]:
    """The messages of /odom, or of the only topic of its kind, by time."""
    if not topics.odometry:
        raise MissingTopics(file, "holds no odometry")
    name = layout.ODOMETRY if layout.ODOMETRY in topics.odometry else min(topics.odometry)
    if name != layout.ODOMETRY and len(topics.odometry) > 1:
        raise MissingTopics(file, f"has several odometry topics ({', '.join(sorted(topics.odometry))}), none is /odom")
    return sorted(topics.odometry[name], key=lambda timed: timed[0])


def _odometry(messages: list[tuple[int, ros2.Odometry]], start_ns: int) -> Odometry:
    """Integers, heading unwrapped the short way round; of equal stamps the last counts."""
    by_time = {t_ns - start_ns: layout.integers(message.pose.pose) for t_ns, message in messages}
    times = np.array(list(by_time), dtype=np.int64)
    x_um, y_um, heading = np.array(list(by_time.values()), dtype=np.int64).T
    steps = (np.diff(heading) + TURN // 2) % TURN - TURN // 2
    unwrapped = heading[0] + np.concatenate(([0], np.cumsum(steps)))
    return Odometry(times, x_um.copy(), y_um.copy(), unwrapped, np.zeros_like(times))


def _rows(
    ranges: list[tuple[int, Source, ros2.Range]],
    sources: list[Source],
    robot: Robot,
    start_ns: int,
    counts: Counter[str],
) -> Iterable[tuple[int, int, int]]:
    """(t_ns, sonar, mm) of every usable reading."""
    numbers = {source: number for number, source in enumerate(sources)}
    for t_ns, source, reading in ranges:
        metres = reading.range
        if source not in numbers:
            counts["unknown_sonar"] += 1
        elif isnan(metres) or metres < reading.min_range:  # REP 117: −inf is an object too close to measure
            counts["unusable_readings"] += 1
        else:
            far = metres == inf or metres >= 1e6
            yield t_ns - start_ns, numbers[source], robot.max_range_mm if far else round(metres * 1e3)


def _corrected(odometry: Odometry, robot: Robot) -> Odometry:
    place = reckoning(robot.calibration)
    rows = zip(odometry.x_um.tolist(), odometry.y_um.tolist(), odometry.heading.tolist(), strict=True)
    x_um, y_um, heading = np.array([place(row) for row in rows], dtype=np.int64).reshape(-1, 3).T.copy()
    return replace(odometry, x_um=x_um, y_um=y_um, heading=heading)


def _placed(rows: Ints, odometry: Odometry, counts: Counter[str]) -> Readings:
    """Readings (n, 3) with odometry at their own moments; those before or after all odometry are left out."""
    known = (rows[:, 0] >= odometry.t_ns[0]) & (rows[:, 0] <= odometry.t_ns[-1])
    counts["readings_without_odometry"] += int(np.count_nonzero(~known))
    t_ns, sonar, range_mm = rows[known].T
    after = np.searchsorted(odometry.t_ns, t_ns)  # first odometry at or after the reading
    before = np.maximum(after - 1, 0)
    span = np.maximum(odometry.t_ns[after] - odometry.t_ns[before], 1)
    fraction = (t_ns - odometry.t_ns[before]) / span

    def between(values: Ints) -> Ints:
        step = np.rint((values[after] - values[before]) * fraction).astype(np.int64)
        placed: Ints = values[before] + step
        return placed

    x_um, y_um, heading = between(odometry.x_um), between(odometry.y_um), between(odometry.heading)
    return Readings(t_ns.copy(), sonar.copy(), range_mm.copy(), x_um, y_um, heading, np.zeros_like(t_ns))


def _robot(file: McapReader, topics: _Topics, base: str, sources: list[Source]) -> Robot:
    first = topics.ranges[0][2]
    if not (0 < first.max_range < 1e6 and 0 < first.field_of_view < pi):
        raise MissingTopics(file, "has Range messages without a max_range and a field_of_view")
    sonars = tuple(_mounting(file, topics, base, frame) for _, frame in sources)
    return replace(
        load_robot("amigo-sh"),
        name="ros2",
        half_beam_deg=round(first.field_of_view / 2 / RADIANS, 4),
        max_range_mm=round(first.max_range * 1e3),
        sonars=sonars,
    )


def _mounting(file: McapReader, topics: _Topics, base: str, frame: str) -> Sonar:
    """Where `frame` sits in `base`, by the chain of static transforms between them, in the plane."""
    x, y, heading, at, hops = 0.0, 0.0, 0.0, frame, 0
    while at != base:
        edge = topics.frames.get(at)
        hops += 1
        if edge is None or hops > len(topics.frames):
            raise MissingTopics(file, f"has no static transform from {base} to {frame}")
        turn = layout.yaw(edge.transform.rotation)
        sine, cosine = dmath.sincos(turn)
        offset = edge.transform.translation
        x, y = offset.x + cosine * x - sine * y, offset.y + sine * x + cosine * y
        heading += turn
        at = edge.header.frame_id
    return Sonar(round(x * 1e3, 3), round(y * 1e3, 3), round(heading / RADIANS, 4))


def _natural(source: Source) -> list[tuple[int, int | str]]:
    """Sort key with sonar_2 before sonar_10."""
    parts = re.split(r"(\d+)", "\0".join(source))
    return [(0, int(part)) if part.isdecimal() else (1, part) for part in parts]
