"""The ROS 2 message types that sonarlog writes, with the fields and units of their public definitions.

Another type is another class here; its schema text and its bytes follow (`sonarlog.cdr`).
"""

from math import nan

from sonarlog.cdr import (
    F32,
    F64,
    I32,
    U8,
    U32,
    Bool,
    Bytes,
    F32s,
    F64x36,
    SignedBytes,
    String,
    message,
)

SECOND_NS = 1_000_000_000
UNKNOWN_COVARIANCE = (0.0,) * 36


@message("builtin_interfaces/msg/Time")
class Time:
    """A moment: seconds and the nanoseconds after them."""

    sec: I32 = 0
    nanosec: U32 = 0

    @classmethod
    def of(cls, t_ns: int) -> "Time":
        """The moment `t_ns` nanoseconds after the epoch."""
        return cls(*divmod(t_ns, SECOND_NS))

    @property
    def ns(self) -> int:
        """Nanoseconds since the epoch."""
        return self.sec * SECOND_NS + self.nanosec


@message("builtin_interfaces/msg/Duration")
class Duration:
    """A span of time."""

    sec: I32 = 0
    nanosec: U32 = 0


@message("std_msgs/msg/Header")
class Header:
    """When, and in which frame."""

    stamp: Time
    frame_id: String


@message("std_msgs/msg/String")
class StringMessage:
    """A text."""

    data: String


@message("std_msgs/msg/ColorRGBA")
class Color:
    """0..1 each."""

    r: F32
    g: F32
    b: F32
    a: F32 = 1.0


@message("geometry_msgs/msg/Point")
class Point:
    """Metres."""

    x: F64 = 0.0
    y: F64 = 0.0
    z: F64 = 0.0


@message("geometry_msgs/msg/Vector3")
class Vector3:
    """Metres, m/s, rad/s or a scale."""

    x: F64 = 0.0
    y: F64 = 0.0
    z: F64 = 0.0


@message("geometry_msgs/msg/Quaternion")
class Quaternion:
    """A rotation; in the plane z = sin(heading/2), w = cos(heading/2)."""

    x: F64 = 0.0
    y: F64 = 0.0
    z: F64 = 0.0
    w: F64 = 1.0


@message("geometry_msgs/msg/Pose")
class Pose:
    """Where something is in a frame."""

    position: Point = Point()
    orientation: Quaternion = Quaternion()


@message("geometry_msgs/msg/PoseStamped")
class PoseStamped:
    """A pose with its frame and moment."""

    header: Header
    pose: Pose


@message("geometry_msgs/msg/PoseWithCovariance")
class PoseWithCovariance:
    """A pose; a covariance of zeros is an unknown one."""

    pose: Pose
    covariance: F64x36 = UNKNOWN_COVARIANCE


@message("geometry_msgs/msg/Twist")
class Twist:
    """Velocities, m/s and rad/s."""

    linear: Vector3 = Vector3()
    angular: Vector3 = Vector3()


@message("geometry_msgs/msg/TwistWithCovariance")
class TwistWithCovariance:
    """A twist; a covariance of zeros is an unknown one."""

    twist: Twist = Twist()
    covariance: F64x36 = UNKNOWN_COVARIANCE


@message("geometry_msgs/msg/Transform")
class Transform:
    """From the child's frame to the parent's."""

    translation: Vector3 = Vector3()
    rotation: Quaternion = Quaternion()


@message("geometry_msgs/msg/TransformStamped")
class TransformStamped:
    """`header.frame_id` is the parent."""

    header: Header
    child_frame_id: String
    transform: Transform = Transform()


@message("tf2_msgs/msg/TFMessage")
class TFMessage:
    """Edges of the tree of frames."""

    transforms: tuple[TransformStamped, ...]


@message("nav_msgs/msg/Odometry")
class Odometry:
    """Pose in `header.frame_id`, twist in `child_frame_id`."""

    header: Header
    child_frame_id: String
    pose: PoseWithCovariance
    twist: TwistWithCovariance = TwistWithCovariance()


@message("nav_msgs/msg/Path")
class Path:
    """Poses one after the other."""

    header: Header
    poses: tuple[PoseStamped, ...]


@message("nav_msgs/msg/MapMetaData")
class MapMetaData:
    """`origin`: pose of the lower left corner of cell (0, 0); resolution in m a cell."""

    map_load_time: Time
    resolution: F32
    width: U32
    height: U32
    origin: Pose


@message("nav_msgs/msg/OccupancyGrid")
class OccupancyGrid:
    """`data`: rows from the lowest y on, one int8 a cell: -1 unknown, 0 free .. 100 occupied."""

    header: Header
    info: MapMetaData
    data: SignedBytes


@message("sensor_msgs/msg/Range")
class Range:
    """One reading; what is not within min_range..max_range saw nothing. Radians and metres."""

    header: Header
    radiation_type: U8
    field_of_view: F32
    min_range: F32
    max_range: F32
    range: F32
    variance: F32 = 0.0  # 0 is unknown; the field came with ROS 2 Iron


ULTRASOUND = 0  # radiation_type


@message("sensor_msgs/msg/PointField")
class PointField:
    """One field of a cloud's points."""

    name: String
    offset: U32
    datatype: U8
    count: U32


@message("sensor_msgs/msg/PointCloud2")
class PointCloud2:
    """Points as rows of bytes."""

    header: Header
    height: U32
    width: U32
    fields: tuple[PointField, ...]
    is_bigendian: Bool
    point_step: U32
    row_step: U32
    data: Bytes
    is_dense: Bool


FLOAT32 = 7  # datatype


@message("sensor_msgs/msg/BatteryState")
class BatteryState:
    """Volts; NaN and 0 where unknown."""

    header: Header
    voltage: F32
    temperature: F32 = nan
    current: F32 = nan
    charge: F32 = nan
    capacity: F32 = nan
    design_capacity: F32 = nan
    percentage: F32 = nan
    power_supply_status: U8 = 0
    power_supply_health: U8 = 0
    power_supply_technology: U8 = 0
    present: Bool = True
    cell_voltage: F32s = ()
    cell_temperature: F32s = ()
    location: String = ""
    serial_number: String = ""


@message("rcl_interfaces/msg/Log")
class Log:
    """A line of /rosout."""

    stamp: Time
    level: U8
    name: String
    msg: String
    file: String = ""
    function: String = ""
    line: U32 = 0


LEVELS = {"debug": 10, "info": 20, "warn": 30, "error": 40, "fatal": 50}  # Log.level


@message("sonarlog_msgs/msg/Wire")
class Wire:
    """Bytes of the serial line as one read or write moved them; `direction` 0 from the robot, 1 to it."""

    stamp: Time
    direction: U8
    data: Bytes
