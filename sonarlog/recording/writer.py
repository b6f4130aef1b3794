"""Write a recording: the wire as it was, and beside it what ROS tools can show.

Must not know: ports, packets, what time it is.
"""

import json
import struct
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Self

import sonarlog
from slam import dmath
from sonarlog import ros2
from sonarlog.cdr import definition, encode, type_name
from sonarlog.decode import Reading
from sonarlog.log import Surfaces
from sonarlog.mcap_file import McapWriter
from sonarlog.recording import layout, versions
from sonarlog.recording.layout import BASE_FRAME, MAP_FRAME, ODOM_FRAME
from sonarlog.robot import Robot

BATTERY_EVERY_NS = 10_000_000_000
CLOUD_EVERY_NS = 1_000_000_000
LEAN_POSE_EVERY_NS = 1_000_000_000
POINT = struct.Struct("<fff")
POINT_FIELDS = tuple(ros2.PointField(name, 4 * i, ros2.FLOAT32, 1) for i, name in enumerate("xyz"))
POINT_STEPS = 128  # per metre: a cloud is for the eye, and round numbers compress

CHANNELS = {
    layout.WIRE: ros2.Wire,
    layout.ODOMETRY: ros2.Odometry,
    layout.TF: ros2.TFMessage,
    layout.TF_STATIC: ros2.TFMessage,
    layout.POINTS: ros2.PointCloud2,
    layout.BATTERY: ros2.BatteryState,
    layout.EVENTS: ros2.Log,
    layout.TRUTH: ros2.PoseStamped,
}


class RecordingWriter:
    """One recording being made. Times `t_ns` are the recorder's monotonic clock's; in the file stands
    `started_wall_ns + t_ns`.

    As a context manager it finishes the file on every way out: a recording is made once. Raises OutputExists and
    CannotWrite (`sonarlog.mcap_file`).
    """

    def __init__(
        self,
        path: Path | str,
        *,
        started_wall_ns: int,
        command_line: str,
        config: Mapping[str, Any],
        wire: bool = True,
        lean: bool = False,
        force: bool = False,
    ) -> None:
        """`wire=False`: an import, which has no wire.

        `lean`: a fifth of the size, the same replay. The wire is whole; of what follows from it there are only the
        points, and the poses once a second. Rerun opens it; Lichtblick and rosbags miss the message index.
        """
        self._file = McapWriter(path, force=force, message_index=not lean, keep=wire)
        self._lean = lean
        self._last_pose_ns = dict.fromkeys((layout.ODOMETRY, layout.TRUTH), -LEAN_POSE_EVERY_NS)
        self._started_wall_ns = started_wall_ns
        self._last_ns = 0
        self._cloud = bytearray()
        self._cloud_ns = 0
        self._battery: tuple[int, float] | None = None
        self._robot: Robot | None = None
        self._channels = {
            topic: self._channel(topic, kind) for topic, kind in CHANNELS.items() if wire or topic != layout.WIRE
        }
        self._file.metadata(
            layout.RECORDING,
            versions.sealed(
                {
                    "schema_version": str(versions.VERSION),
                    "sonarlog_version": sonarlog.__version__,
                    "started_wall_ns": str(started_wall_ns),
                    "clock": "started_wall_ns + the recorder's monotonic clock" if wire else "the imported log's own",
                    "command_line": command_line,
                    "port": str(config.get("port", "")),
                    "config": json.dumps(config, sort_keys=True),
                }
            ),
        )

    def identity(self, identity: Mapping[str, str], robot: Robot) -> None:
        """Say which robot it is: metadata, the tree of frames, a channel for each sonar. Again after a reconnect."""
        self._robot = robot
        known = {**identity, "parameters": json.dumps(robot.as_dict(), sort_keys=True)}
        self._file.metadata(layout.ROBOT, versions.sealed(known))
        for sonar in range(len(robot.sonars)):
            topic = layout.sonar_topic(sonar)
            if topic not in self._channels and not self._lean:
                self._channels[topic] = self._channel(topic, ros2.Range)
        self._write(layout.TF_STATIC, self._last_ns, ros2.TFMessage(tuple(self._static_frames(robot))))

    def wire(self, t_ns: int, direction: str, data: bytes) -> None:
        """Keep bytes as they were received ("rx") or sent ("tx"); `t_ns` is when the first of them came or went."""
        self._write(layout.WIRE, t_ns, ros2.Wire(self._stamp(t_ns), layout.DIRECTIONS.index(direction), data))

    def odometry(
        self, t_ns: int, x_um: int, y_um: int, heading: int, velocity_mm_s: float = 0.0, turn_rad_s: float = 0.0
    ) -> None:
        """The robot's own pose (µm, 1/TURN of a turn) to /odom and /tf."""
        if self._left_out(layout.ODOMETRY, t_ns):
            return
        pose = layout.planar(x_um, y_um, heading)
        header = self._header(t_ns, ODOM_FRAME)
        twist = ros2.Twist(ros2.Vector3(velocity_mm_s / 1e3), ros2.Vector3(z=turn_rad_s))
        self._write(
            layout.ODOMETRY,
            t_ns,
            ros2.Odometry(header, BASE_FRAME, ros2.PoseWithCovariance(pose), ros2.TwistWithCovariance(twist)),
        )
        moved = ros2.Transform(ros2.Vector3(pose.position.x, pose.position.y), pose.orientation)
        self._write(layout.TF, t_ns, ros2.TFMessage((ros2.TransformStamped(header, BASE_FRAME, moved),)))

    def reading_odometry(self, t_ns: int, x_um: int, y_um: int, heading: int) -> None:
        """Where the robot was when its sonars fired, if that is known better than between two poses of /odom."""
        topic = layout.READING_ODOMETRY
        if topic not in self._channels:
            self._channels[topic] = self._channel(topic, ros2.Odometry)
        pose = ros2.PoseWithCovariance(layout.planar(x_um, y_um, heading))
        header = self._header(t_ns, ODOM_FRAME)
        self._write(topic, t_ns, ros2.Odometry(header, BASE_FRAME, pose, ros2.TwistWithCovariance()))

    def reading(self, t_ns: int, sonar: int, range_mm: int) -> None:
        """A new reading at its own moment. What saw nothing is written as it was measured, above max_range."""
        robot = self._known_robot()
        if self._lean:
            return
        message = ros2.Range(
            self._header(t_ns, layout.sonar_frame(sonar)),
            ros2.ULTRASOUND,
            2 * robot.ring().half_beam,
            0.0,
            (robot.max_range_mm - 1) / 1e3,  # max_range_mm itself is no echo
            range_mm / 1e3,
        )
        self._write(layout.sonar_topic(sonar), t_ns, message)

    def points(self, t_ns: int, readings: Iterable[Reading]) -> None:
        """Where the echoes of these readings lie on their beams' axes: one cloud a second, in the odometry frame."""
        robot = self._known_robot()
        self._cloud += b"".join(_point(robot, reading) for reading in readings if reading.range_mm < robot.max_range_mm)
        if t_ns - self._cloud_ns >= CLOUD_EVERY_NS:
            self._write_cloud(t_ns)

    def battery(self, t_ns: int, volts: float) -> None:
        """Battery voltage; written when it changes and every ten seconds."""
        if self._battery and self._battery[1] == volts and t_ns - self._battery[0] < BATTERY_EVERY_NS:
            return
        self._battery = (t_ns, volts)
        self._write(layout.BATTERY, t_ns, ros2.BatteryState(self._header(t_ns, BASE_FRAME), volts))

    def truth(self, t_ns: int, x_m: float, y_m: float, heading_rad: float) -> None:
        """Where a simulator knows the robot to be, in the frame of its first pose."""
        if self._left_out(layout.TRUTH, t_ns):
            return
        pose = ros2.Pose(ros2.Point(x_m, y_m), layout.orientation(heading_rad))
        self._write(layout.TRUTH, t_ns, ros2.PoseStamped(self._header(t_ns, MAP_FRAME), pose))

    def surfaces(self, surfaces: Surfaces) -> None:
        """The true surfaces of the place."""
        self._file.attachment(layout.SURFACES, "application/json", surfaces.to_json())

    def event(self, t_ns: int, level: str, text: str) -> None:
        """Something that happened: level "info", "warn" or "error"."""
        self._write(layout.EVENTS, t_ns, ros2.Log(self._stamp(t_ns), ros2.LEVELS[level], "sonarlog", text))

    def decision(self, t_ns: int, text: str) -> None:
        """What a robot that explores decided, as JSON (docs/exploration.md)."""
        if layout.DECISIONS not in self._channels:
            self._channels[layout.DECISIONS] = self._channel(layout.DECISIONS, ros2.StringMessage)
        self._write(layout.DECISIONS, t_ns, ros2.StringMessage(text))

    def flush(self, *, fsync: bool = False) -> None:
        """Close the chunk in progress; what was written before survives a kill, with `fsync` a power cut."""
        self._file.flush(fsync=fsync)

    def close(self) -> None:
        """Finish the file and give it its name. Idempotent."""
        if self._cloud and not self._file.closed:
            self._write_cloud(self._last_ns)
        self._file.finish()

    def abandon(self) -> None:
        """Remove what was written."""
        self._file.abandon()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        self.close()

    def _write_cloud(self, t_ns: int) -> None:
        data = bytes(self._cloud)
        count = len(data) // POINT.size
        header = self._header(t_ns, ODOM_FRAME)
        cloud = ros2.PointCloud2(header, 1, count, POINT_FIELDS, False, POINT.size, len(data), data, True)
        self._write(layout.POINTS, t_ns, cloud)
        self._cloud.clear()
        self._cloud_ns = t_ns

    def _channel(self, topic: str, kind: type) -> int:
        return self._file.channel(topic, type_name(kind), definition(kind))

    def _write(self, topic: str, t_ns: int, message: object) -> None:
        self._last_ns = max(self._last_ns, t_ns)
        self._file.write(self._channels[topic], self._log_time_ns(t_ns), encode(message))

    def _left_out(self, topic: str, t_ns: int) -> bool:
        """Whether a lean recording does without this pose."""
        if self._lean and t_ns - self._last_pose_ns[topic] < LEAN_POSE_EVERY_NS:
            return True
        self._last_pose_ns[topic] = t_ns
        return False

    def _log_time_ns(self, t_ns: int) -> int:
        return max(0, self._started_wall_ns + t_ns)  # a reading may have been fired before a clock that starts at 0

    def _stamp(self, t_ns: int) -> ros2.Time:
        return ros2.Time.of(self._log_time_ns(t_ns))

    def _header(self, t_ns: int, frame: str) -> ros2.Header:
        return ros2.Header(self._stamp(t_ns), frame)

    def _known_robot(self) -> Robot:
        if self._robot is None:
            raise ValueError("identity() comes before readings: they need the robot's sonars")
        return self._robot

    def _static_frames(self, robot: Robot) -> Iterable[ros2.TransformStamped]:
        """map → odom, which here is the identity, and base_link → each sonar."""
        yield ros2.TransformStamped(self._header(self._last_ns, MAP_FRAME), ODOM_FRAME)
        for number, mounting in enumerate(robot.ring().mountings):
            place = ros2.Transform(ros2.Vector3(mounting.x, mounting.y), layout.orientation(mounting.heading))
            yield ros2.TransformStamped(self._header(self._last_ns, BASE_FRAME), layout.sonar_frame(number), place)


def _point(robot: Robot, reading: Reading) -> bytes:
    """A reading's echo on the beam's axis: x y z as float32 metres in the odometry frame."""
    mounting = robot.ring().mountings[reading.sonar]
    heading = reading.pose.heading * layout.RADIANS
    sine, cosine = dmath.sincos(heading)
    ray_sine, ray_cosine = dmath.sincos(heading + mounting.heading)
    along = reading.range_mm / 1e3
    x = reading.pose.x_um / 1e6 + mounting.x * cosine - mounting.y * sine + along * ray_cosine
    y = reading.pose.y_um / 1e6 + mounting.x * sine + mounting.y * cosine + along * ray_sine
    return POINT.pack(round(x * POINT_STEPS) / POINT_STEPS, round(y * POINT_STEPS) / POINT_STEPS, 0.0)
