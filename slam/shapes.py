"""What is drawn of the things a sweep saw: a wall as long as it was seen, anything else as a dot where it was heard.

One sweep cannot tell a corner from a wall. What stands in line with a known wall and answers from another direction is
taken for a corner: a robot has some width, and does not come so near to a wall as to hear another one at right angles
there. Must not know: the grid, weights.
"""

from dataclasses import dataclass

import numpy as np

from slam import dmath
from slam.association import OPEN, POINT, WALL
from slam.dmath import DEGREE, Floats
from slam.geometry import Bools, Pose
from slam.pieces import Pieces
from slam.sight import Sight
from slam.sweep import Ints

MARGIN_M = 0.1
STEEP = 0.34
"""Sine of 20°: lines that cross at less than that are the same wall."""


@dataclass(frozen=True)
class ShapeConfig:
    """When something that may be a wall or a corner is drawn as a wall: near enough, and not in line with a wall.

    In full only if it is parallel or square to a wall; otherwise no farther than `open_half_m` from its foot.
    """

    open_m: float = 3.0
    in_line_m: float = 0.12
    in_line_deg: float = 20.0
    in_line_reach_m: float = 1.0
    open_half_m: float = 0.2
    square_deg: float = 5.0
    beyond_m: float = 5.0  # how far past the ends of what was seen of a wall nothing faint was heard behind it


@dataclass(frozen=True)
class Shapes:
    """n things in the map frame: each at its `foot` (n, 2), heard in the direction `towards` (n, 2), drawn between its
    `ends` (n, 4), which are one point for a dot.

    `wall` (n,): its number among the sweep's walls if it is drawn as one, else −1. `short` (n,): only the middle of
    one, because nobody knows yet. `faint` (n,): few readings told of it.
    """

    foot: Floats
    towards: Floats
    ends: Floats
    wall: Ints
    short: Bools
    faint: Bools
    support: Ints


def shapes_of(sight: Sight, pose: Pose, own: Pieces, around: Floats, told: Floats, config: ShapeConfig) -> Shapes:
    """A shape for each thing of the sweep; `own` are its walls, `around` (w, 4) those of other sweeps near by, and
    `told` (t, 2) the normals of what is known to be a wall."""
    foot, bearing = pose.points(sight.foot), sight.bearing + pose.theta
    feet, far = feet_of(own, pose)
    lines = np.concatenate([around, own.ends[own.nature != POINT]])
    doubtful = in_line(feet, own.normal, lines, config)
    solid = (own.nature == WALL) | ((own.nature == OPEN) & ~doubtful & (far <= config.open_m))
    as_wall = np.flatnonzero((sight.wall >= 0) & solid[sight.wall]) if len(own.chain) else np.zeros(0, dtype=np.int64)
    which = sight.wall[as_wall]
    ends = clipped(feet[which], own.ends[which], which, own, np.flatnonzero(solid))
    ends = cut(feet[which], ends, around)
    askew = ~_square(own.normal[which], told, config) & (own.nature[which] == OPEN)
    ends = _shortened(feet[which], ends, askew, config.open_half_m)
    sine, cosine = dmath.sincos(bearing)
    towards = np.stack([cosine, sine], axis=1)
    aside = np.stack([-sine * sight.half, cosine * sight.half], axis=1)
    all_ends = np.concatenate([foot - aside, foot + aside], axis=1)
    foot[as_wall], towards[as_wall] = feet[which], own.normal[which]
    all_ends[as_wall] = ends
    wall, short = np.full(len(foot), -1), np.zeros(len(foot), dtype=bool)
    wall[as_wall], short[as_wall] = which, askew
    seen = ~(sight.faint & _behind(foot, pose, own, config))
    return Shapes(
        foot[seen], towards[seen], all_ends[seen], wall[seen], short[seen], sight.faint[seen], sight.support[seen]
    )


def _behind(points: Floats, pose: Pose, own: Pieces, config: ShapeConfig) -> Bools:
    """Which points (n, 2) lie over 10 cm behind one of the sweep's walls, or where it goes on: sound came back by way
    of it. A sweep sees a short piece of a wall."""
    nx, ny = own.normal[:, :1], own.normal[:, 1:]
    before = nx * pose.x + ny * pose.y - own.line[:, 1:]
    after = nx * points[:, 0] + ny * points[:, 1] - own.line[:, 1:]
    through = (before < 0.0) & (after > 0.10)
    part = before / np.where(through, before - after, 1.0)
    x, y = pose.x + part * (points[:, 0] - pose.x), pose.y + part * (points[:, 1] - pose.y)
    place = nx * y - ny * x
    one, other = (nx * own.ends[:, k + 1 : k + 2] - ny * own.ends[:, k : k + 1] for k in (0, 2))
    low, high = np.minimum(one, other) - config.beyond_m, np.maximum(one, other) + config.beyond_m
    return np.asarray((through & (low <= place) & (place <= high)).any(axis=0))


def feet_of(own: Pieces, pose: Pose) -> tuple[Floats, Floats]:
    """The points (w, 2) of the walls' lines nearest to a station, and how far they are."""
    off = own.line[:, 1] - (own.normal[:, 0] * pose.x + own.normal[:, 1] * pose.y)
    return np.stack([pose.x + off * own.normal[:, 0], pose.y + off * own.normal[:, 1]], axis=1), np.abs(off)


def in_line(feet: Floats, normals: Floats, walls: Floats, config: ShapeConfig) -> Bools:
    """Which feet (n, 2) lie in line with one of the walls (w, 4), not far past its ends, and face away from it."""
    along_x, along_y, length = _directions(walls)
    dx, dy = feet[:, :1] - walls[:, 0], feet[:, 1:] - walls[:, 1]
    off, place = np.abs(along_x * dy - along_y * dx), along_x * dx + along_y * dy
    limit = dmath.sin(config.in_line_deg * DEGREE)
    aside = np.abs(normals[:, :1] * along_x + normals[:, 1:] * along_y) > limit
    reach = config.in_line_reach_m
    found = aside & (off <= config.in_line_m) & (place >= -reach) & (place <= length + reach)
    return np.asarray(found.any(axis=1))


def _directions(walls: Floats) -> tuple[Floats, Floats, Floats]:
    """Unit vectors along walls (w, 4), and their lengths."""
    dx, dy = walls[:, 2] - walls[:, 0], walls[:, 3] - walls[:, 1]
    length = np.maximum(np.sqrt(dx * dx + dy * dy), 1e-6)
    return dx / length, dy / length, length


def cut(feet: Floats, ends: Floats, walls: Floats) -> Floats:
    """Walls' ends (n, 4), drawn in to where walls (w, 4) of other sweeps cross them; the part with the foot stays."""
    along_x, along_y, length = _directions(walls)
    found = ends.copy()
    to_x, to_y = walls[:, 0] - feet[:, :1], walls[:, 1] - feet[:, 1:]
    aside = along_x * to_y - along_y * to_x
    for x, y in ((0, 1), (2, 3)):
        dx, dy = ends[:, x : x + 1] - feet[:, :1], ends[:, y : y + 1] - feet[:, 1:]
        across, size = along_x * dy - along_y * dx, np.sqrt(dx * dx + dy * dy)
        steep = np.abs(across) > STEEP * size
        safe = np.where(steep, across, 1.0)
        part, place = aside / safe, (dx * to_y - dy * to_x) / safe
        met = steep & (part * size > MARGIN_M) & (part < 1.0) & (place >= -MARGIN_M) & (place <= length + MARGIN_M)
        nearest = np.where(met, part, 1.0).min(axis=1, initial=1.0)
        found[:, x], found[:, y] = feet[:, 0] + nearest * dx[:, 0], feet[:, 1] + nearest * dy[:, 0]
    return found


def clipped(feet: Floats, ends: Floats, numbers: Ints, own: Pieces, others: Ints) -> Floats:
    """Walls' ends (n, 4), drawn in to where they meet the lines of others: what lies behind those was not seen.

    `numbers` (n,) are their own among the sweep's, `others` those that clip. The part that holds the foot point stays,
    for that is what answered.
    """
    cosine, sine, rho = own.normal[others, 0], own.normal[others, 1], own.line[others, 1]
    inside = cosine * feet[:, :1] + sine * feet[:, 1:] - rho
    clips = (inside < 0.0) & (numbers[:, None] != others)
    found = ends.copy()
    for x, y in ((0, 1), (2, 3)):
        past = cosine * ends[:, x : x + 1] + sine * ends[:, y : y + 1] - rho
        met = clips & (past > 0.0)
        part = np.where(met, inside / np.where(met, inside - past, 1.0), 1.0).min(axis=1, initial=1.0)
        found[:, x] = feet[:, 0] + part * (ends[:, x] - feet[:, 0])
        found[:, y] = feet[:, 1] + part * (ends[:, y] - feet[:, 1])
    return found


def _shortened(feet: Floats, ends: Floats, which: Bools, half_m: float) -> Floats:
    """Some of the walls' ends (n, 4), not farther than that from the foot."""
    found = ends.copy()
    for x, y in ((0, 1), (2, 3)):
        dx, dy = ends[:, x] - feet[:, 0], ends[:, y] - feet[:, 1]
        part = np.where(which, np.minimum(1.0, half_m / np.maximum(np.sqrt(dx * dx + dy * dy), 1e-9)), 1.0)
        found[:, x], found[:, y] = feet[:, 0] + part * dx, feet[:, 1] + part * dy
    return found


def _square(normals: Floats, others: Floats, config: ShapeConfig) -> Bools:
    """Which of the normals (n, 2) are parallel or square to one of the others (m, 2)."""
    along = normals[:, :1] * others[:, 0] + normals[:, 1:] * others[:, 1]
    across = normals[:, :1] * others[:, 1] - normals[:, 1:] * others[:, 0]
    return np.asarray((np.minimum(np.abs(along), np.abs(across)) <= dmath.sin(config.square_deg * DEGREE)).any(axis=1))
