"""What lies where in a recording: topics, frames, metadata names, and poses as ROS writes them.

Must not know: files.
"""

from slam import dmath
from slam.sweep import TURN
from sonarlog.ros2 import Point, Pose, Quaternion

WIRE = "/wire"
ODOMETRY = "/odom"
READING_ODOMETRY = "/sonar/odometry"  # of imports: where the robot was when a sonar fired, if that is known
TF = "/tf"
TF_STATIC = "/tf_static"
POINTS = "/sonar/points"
BATTERY = "/battery"
EVENTS = "/rosout"
TRUTH = "/truth"
DECISIONS = "/decision"  # of explorations

MAP_FRAME, ODOM_FRAME, BASE_FRAME = "map", "odom", "base_link"  # then sonar_0, sonar_1, …

RECORDING = "recording"  # metadata: how it was made
ROBOT = "robot"  # metadata: which robot, and its parameters
RECOVERED = "recovered"  # metadata: that it was, and what is missing
SURFACES = "truth/surfaces.json"  # attachment

RADIANS = 6.283185307179586 / TURN
DIRECTIONS = ("rx", "tx")  # Wire.direction


def sonar_topic(sonar: int) -> str:
    """Where a sonar's readings are."""
    return f"/sonar/{sonar}"


def sonar_frame(sonar: int) -> str:
    """The sonar's own frame, x along its axis."""
    return f"sonar_{sonar}"


def orientation(heading: float) -> Quaternion:
    """The rotation by `heading` rad about z, components rounded to 2⁻²⁴: the zeros behind compress well, and
    1/TURN of a turn is a hundred times as much.
    """
    sine, cosine = dmath.sincos(heading / 2)
    return Quaternion(z=round(sine * (1 << 24)) / (1 << 24), w=round(cosine * (1 << 24)) / (1 << 24))


def yaw(rotation: Quaternion) -> float:
    """The rotation's part about z, rad in (−π, π]."""
    x, y, z, w = rotation.x, rotation.y, rotation.z, rotation.w
    return dmath.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def planar(x_um: int, y_um: int, heading: int) -> Pose:
    """A pose of integers (µm, 1/TURN of a turn) as ROS has it; `heading` keeps its place in the turn only."""
    return Pose(Point(x_um / 1e6, y_um / 1e6), orientation(heading % TURN * RADIANS))


def integers(pose: Pose) -> tuple[int, int, int]:
    """x µm, y µm and heading in 0..TURN−1, rounded: exactly what `planar` was given."""
    heading = round(yaw(pose.orientation) / RADIANS) % TURN
    return round(pose.position.x * 1e6), round(pose.position.y * 1e6), heading
