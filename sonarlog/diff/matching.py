"""Walls of two maps, matched one to one: moved, turned, longer, shorter, split, merged, doubled, appeared, gone.

B's walls are held against A's where the alignment lays them. Must not know: runs, cells, how the maps were aligned.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sonarlog.diff.offsets import offset
from sonarlog.diff.walls import Wall

MOVED_M = 0.02
TURNED_DEG = 1.0
LONGER_M = 0.15
"""Smaller changes of a wall are not told."""
APART_M = 0.60
TURN_RAD = float(np.radians(20.0))
GAP_M = 0.50
"""Walls further apart, or turned more, or further on along their line, are not one wall."""
LINE_M = 0.15
"""Nearer to its line than this, a wall goes another on; further off, but nearer than `APART_M`, it doubles it."""
DOUBLED_PART = 0.5
DOUBLED_M = 0.04
MIRRORED = {"longer": "shorter", "split": "merged", "doubled": "single", "appeared": "gone"}
MIRROR = MIRRORED | {b: a for a, b in MIRRORED.items()}
KINDS = ("gone", "appeared", "doubled", "single", "split", "merged", "moved", "turned", "shorter", "longer")
"""In the order in which they are told; `single` is a wall that is doubled in A and no longer in B."""


@dataclass(frozen=True)
class WallChange:
    """What became of a wall, or of walls that belong together; empty `kinds`: the same.

    `a` and `b` are the walls in their own maps' frames. From A to B, after alignment: `moved_m` across the wall (away
    from the robot positive), `turned_deg` counter-clockwise, `longer_m` along it.
    """

    kinds: tuple[str, ...]
    a: tuple[Wall, ...]
    b: tuple[Wall, ...]
    moved_m: float = 0.0
    turned_deg: float = 0.0
    longer_m: float = 0.0

    @property
    def wall(self) -> Wall:
        """The one that gives the change its name: A's, if there is one."""
        return (self.a or self.b)[0]

    @property
    def words(self) -> str:
        """`east wall 3 (4.1 m) moved by 7 cm`."""
        wall = self.wall
        said = [_said(kind, self) for kind in KINDS if kind in self.kinds] or ["is the same"]
        return f"{wall.name} ({wall.length_m:.1f} m at ({wall.middle[0]:.1f}, {wall.middle[1]:.1f})) {', '.join(said)}"

    def mirrored(self) -> "WallChange":
        """From B to A."""
        kinds = tuple(sorted((MIRROR.get(kind, kind) for kind in self.kinds), key=KINDS.index))
        return WallChange(kinds, self.b, self.a, -self.moved_m, -self.turned_deg, -self.longer_m)


def _said(kind: str, change: WallChange) -> str:
    moved, turned, longer = 100 * change.moved_m, change.turned_deg, change.longer_m
    return {
        "gone": "is gone",
        "appeared": "appeared",
        "doubled": f"is doubled: {_listed(change.b)} in B",
        "single": f"is no longer doubled: {_listed(change.a)} in A",
        "split": f"is split into {_listed(change.b)}",
        "merged": f"and what is {_listed(change.a[1:])} in A are one",
        "moved": f"moved by {abs(moved):.0f} cm {'away from' if moved > 0 else 'towards'} the robot",
        "turned": f"turned by {turned:+.1f}°",
        "shorter": f"is {-longer:.1f} m shorter",
        "longer": f"is {longer:.1f} m longer",
    }[kind]


def _listed(walls: Sequence[Wall]) -> str:
    if len(walls) > 3:
        return f"{len(walls)} pieces of {sum(wall.length_m for wall in walls):.1f} m"
    return " and ".join(f"{wall.name} ({wall.length_m:.1f} m)" for wall in walls)


def same(walls: Sequence[Wall]) -> tuple[WallChange, ...]:
    """Each wall with itself, for maps that are the same."""
    return tuple(WallChange((), (wall,), (wall,)) for wall in walls)


def match(a: Sequence[Wall], b: Sequence[Wall], laid: Sequence[Wall]) -> tuple[WallChange, ...]:
    """What became of each wall of A, then of those that only B has.

    `laid` are the walls of B in A's frame, in their order.
    """
    pairs = _pairs(a, laid)
    changes = [_pair(a[i], b[j], laid[j]) for i, j in pairs]
    of_a, of_b = {i: k for k, (i, _) in enumerate(pairs)}, {j: k for k, (_, j) in enumerate(pairs)}
    for j in (j for j in range(len(b)) if j not in of_b):
        k = _kin(laid[j], [(laid[m], a[i]) for i, m in pairs])
        if k is None:
            changes.append(WallChange(("appeared",), (), (b[j],)))
        else:
            kind = "doubled" if _beside(laid[j], laid[pairs[k][1]]) else "split"
            changes[k] = _widened(changes[k], kind, b=b[j])
    for i in (i for i in range(len(a)) if i not in of_a):
        k = _kin(a[i], [(a[m], laid[j]) for m, j in pairs])
        if k is None:
            changes.append(WallChange(("gone",), (a[i],), ()))
        else:
            kind = "single" if _beside(a[i], a[pairs[k][0]]) else "merged"
            changes[k] = _widened(changes[k], kind, a=a[i])
    return tuple(changes)


def _pairs(a: Sequence[Wall], laid: Sequence[Wall]) -> list[tuple[int, int]]:
    """The pairing (of A, of B) that costs least in all; what fits no other stays alone."""
    if not a or not laid:
        return []
    from scipy.optimize import linear_sum_assignment  # a second of its own: only where there is something to match

    alone = 4.0
    cost = np.array([[min(_cost(wall, other), 2 * alone) for other in laid] for wall in a])
    rows, columns = linear_sum_assignment(cost)
    return [(i, j) for i, j in zip(rows.tolist(), columns.tolist(), strict=True) if cost[i, j] < alone]


def _cost(a: Wall, b: Wall) -> float:
    """0 for the same wall; grows with the distance across, the turn, and what is not shared along; infinite if none."""
    across, turn, shared, gap = _between(a, b)
    if abs(across) > APART_M or abs(turn) > TURN_RAD or gap > GAP_M:
        return float("inf")
    union = a.length_m + b.length_m - shared
    return abs(across) / 0.20 + abs(turn) / (0.75 * TURN_RAD) + (1.0 - shared / union if union > 0 else 1.0)


def _between(a: Wall, b: Wall) -> tuple[float, float, float, float]:
    """From A to B: distance across (away from the robot positive), turn, shared length along, gap along.

    Across is measured where the two lie side by side, or else where they are nearest, from the line halfway between.
    """
    turn = float(np.arctan2(np.sin(b.alpha - a.alpha), np.cos(b.alpha - a.alpha)))
    alpha = a.alpha + 0.5 * turn
    along = np.array([-np.sin(alpha), np.cos(alpha)])
    (a0, a1), (b0, b1) = (sorted((float(along @ w.start), float(along @ w.end))) for w in (a, b))
    low, high = max(a0, b0), min(a1, b1)
    at = 0.5 * (low + high)
    return _off(b, alpha, at) - _off(a, alpha, at), turn, max(0.0, high - low), max(0.0, low - high)


def _off(wall: Wall, alpha: float, at: float) -> float:
    """How far along the normal of direction α the wall's line is, at a place `at` along the direction across it."""
    turn = wall.alpha - alpha
    return (wall.rho - at * float(np.sin(turn))) / float(np.cos(turn))


def _pair(a: Wall, b: Wall, laid: Wall) -> WallChange:
    across, turn, _, _ = _between(a, laid)
    off = offset(a, laid, a.alpha + 0.5 * turn, (across, turn))
    longer, turned = b.length_m - a.length_m, float(np.degrees(off.turned_rad))
    # The ends of a short wall say little of its direction.
    least = max(TURNED_DEG, float(np.degrees(2 * MOVED_M / max(0.01, min(a.length_m, b.length_m)))))
    said = {
        "moved": abs(off.moved_m) >= MOVED_M and off.moved,
        "turned": abs(turned) >= least and off.turned,
        "longer": longer >= LONGER_M,
        "shorter": longer <= -LONGER_M,
    }
    return WallChange(tuple(k for k in KINDS if said.get(k)), (a,), (b,), off.moved_m, turned, longer)


def _kin(wall: Wall, pairs: Sequence[tuple[Wall, Wall]]) -> int | None:
    """Which pair (in its own map, in the other) the wall that has no pair belongs to: it doubles it, or is a part."""
    best: tuple[float, int] | None = None
    for k, (own, other) in enumerate(pairs):
        across, turn, shared, _ = _between(own, wall)
        doubles = DOUBLED_M <= abs(across) <= APART_M and shared >= DOUBLED_PART * min(wall.length_m, own.length_m)
        off, _, covered, _ = _between(other, wall)
        part = abs(off) <= LINE_M and covered >= DOUBLED_PART * wall.length_m
        if abs(turn) <= TURN_RAD and (doubles or part) and (best is None or abs(across) < best[0]):
            best = (abs(across), k)
    return best[1] if best else None


def _beside(wall: Wall, own: Wall) -> bool:
    """Whether two walls of one map run side by side, rather than one after the other."""
    _, _, shared, _ = _between(own, wall)
    return shared >= DOUBLED_PART * min(wall.length_m, own.length_m)


def _widened(change: WallChange, kind: str, a: Wall | None = None, b: Wall | None = None) -> WallChange:
    """With one more wall on a side: what the parts are together decides how much longer the wall is."""
    mine, yours = (*change.a, *([a] if a else [])), (*change.b, *([b] if b else []))
    kinds = {*change.kinds, kind}
    longer = change.longer_m
    if kind in ("split", "merged"):
        longer = sum(w.length_m for w in yours) - sum(w.length_m for w in mine)
        kinds -= {"longer", "shorter"}
        kinds |= {"longer"} if longer >= LONGER_M else {"shorter"} if longer <= -LONGER_M else set()
    return replace(change, kinds=tuple(k for k in KINDS if k in kinds), a=mine, b=yours, longer_m=longer)
