"""What differs between two runs: one module a level, and the report that holds them all."""

from sonarlog.diff.alignment import Alignment
from sonarlog.diff.calibration import CalibrationChange
from sonarlog.diff.cells import CellChanges, Window, cell_changes
from sonarlog.diff.comparable import NotComparable
from sonarlog.diff.first import Chaining, FirstDifference, first_difference
from sonarlog.diff.matching import WallChange
from sonarlog.diff.paths import PathChanges
from sonarlog.diff.report import Report, Side, diff_runs
from sonarlog.diff.rooms import RoomChange, RoomChanges
from sonarlog.diff.times import BlockTime, TimeChanges
from sonarlog.diff.tolerance import BadTolerance, Tolerance
from sonarlog.diff.truth import Truth, TruthMetric
from sonarlog.diff.walls import Wall

__all__ = [
    "Alignment",
    "BadTolerance",
    "BlockTime",
    "CalibrationChange",
    "CellChanges",
    "Chaining",
    "FirstDifference",
    "NotComparable",
    "PathChanges",
    "Report",
    "RoomChange",
    "RoomChanges",
    "Side",
    "TimeChanges",
    "Tolerance",
    "Truth",
    "TruthMetric",
    "Wall",
    "WallChange",
    "Window",
    "cell_changes",
    "diff_runs",
    "first_difference",
]
