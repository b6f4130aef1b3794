"""Markers: what ROS viewers draw besides maps, paths and clouds.

Apart from `sonarlog.ros2` for length only.
"""

from sonarlog.cdr import F32, I32, Bool, Bytes, String, message
from sonarlog.ros2 import Color, Duration, Header, Point, Pose, Time, Vector3


@message("sensor_msgs/msg/CompressedImage")
class CompressedImage:
    """A picture; here only because a Marker has one."""

    header: Header = Header(Time(), "")
    format: String = ""
    data: Bytes = b""


@message("visualization_msgs/msg/MeshFile")
class MeshFile:
    """A mesh; here only because a Marker has one."""

    filename: String = ""
    data: Bytes = b""


@message("visualization_msgs/msg/UVCoordinate")
class UVCoordinate:
    """A place in a texture."""

    u: F32
    v: F32


@message("visualization_msgs/msg/Marker")
class Marker:
    """Something to draw; `id` within `ns` names it, `type` and `action` are the numbers below."""

    header: Header
    ns: String
    id: I32
    type: I32
    action: I32 = 0
    pose: Pose = Pose()
    scale: Vector3 = Vector3()
    color: Color = Color(1.0, 1.0, 1.0)
    lifetime: Duration = Duration()
    frame_locked: Bool = False
    points: tuple[Point, ...] = ()
    colors: tuple[Color, ...] = ()
    texture_resource: String = ""
    texture: CompressedImage = CompressedImage()
    uv_coordinates: tuple[UVCoordinate, ...] = ()
    text: String = ""
    mesh_resource: String = ""
    mesh_file: MeshFile = MeshFile()
    mesh_use_embedded_materials: Bool = False


LINE_STRIP, LINE_LIST, POINTS, TEXT = 4, 5, 8, 9  # Marker.type
DELETE_ALL = 3  # Marker.action


@message("visualization_msgs/msg/MarkerArray")
class MarkerArray:
    """Markers of one moment."""

    markers: tuple[Marker, ...]
