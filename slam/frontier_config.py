"""The settings of block I.

Must not know: how they are used.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class FrontierConfig:
    """Which regions count, how far from walls the robot keeps, what the way costs, and when to scan on the way."""

    min_cells: int = 6
    chink_cells: int = 2  # unknown stretches nowhere wider than twice as many cells are left
    piece_m: float = 1.0  # regions are cut into pieces so large
    robot_radius_m: float = 0.18
    margin_m: float = 0.06
    clear_m: float = 0.35  # a way that keeps so much more off walls, and off the unknown, costs half
    unseen_m: float = 0.12  # the robot stands no nearer to what was never seen
    heard_m: float = 0.8  # so far about a scan nothing stands, but for what answered from nearer
    settle_m: float = 0.7  # added to every way: a near goal is not infinitely good
    min_gain_m2: float = 0.30  # for less no robot moves …
    more_gain_m2: float = 0.16  # … nor for so much less a metre of way …
    enough_gain_m2: float = 1.4  # … but it does for this
    near_gain_m2: float = 0.05  # in the end so much a metre is enough, where nobody was near …
    far_enough_m2: float = 0.45  # … and this is always enough …
    far_m: float = 0.25  # … for ways no longer than so much a scan, a third of what it has driven: longer ones …
    far_gain_m2: float = 0.065  # … must show so much a metre …
    weary_scans: int = 60  # … and after more scans than this more is always enough in proportion …
    far_most_m2: float = 0.7  # … but no more than that
    wide_m2: float = 0.5  # a view that shows so much where a scan was nearer is enough, too
    picky_scans: int = 30  # after more scans than this, more a metre in proportion, and in the end more for long ways
    apart_m: float = 0.65  # nearer than this to a scan another is worth less in proportion
    step_gain_m2: float = 1.2  # nearer than half of that only a view that shows so much counts
    most_gain_m2: float = 2.0  # a view that promises more is not better
    lost: float = 0.1  # a view that sees no wall squarely is worth so much less, and one that sees none across as well
    vain_m: float = 0.5  # so near to where the robot could not get to …
    vain_share: float = 0.4  # … a view is worth so much less, each time
    stay: float = 1.3  # what the goal chosen before is worth more
    leg_m: float = 0.9  # from scan to scan where nobody stood before
    known_leg_m: float = 1.8  # where the walls were seen from near the next place already
    known_m: float = 0.6
    block_m: float = 0.15  # the size of what was in the way
    block_sweeps: int = 12  # so long it is believed to be there
