"""A part of an occupancy grid, for what changes of a large one.

Apart from `sonarlog.ros2` for length only.
"""

from sonarlog.cdr import I32, U32, SignedBytes, message
from sonarlog.ros2 import Header


@message("map_msgs/msg/OccupancyGridUpdate")
class OccupancyGridUpdate:
    """New values of a rectangle of the last OccupancyGrid; `x`, `y` are the column and row of its first cell there."""

    header: Header
    x: I32
    y: I32
    width: U32
    height: U32
    data: SignedBytes
