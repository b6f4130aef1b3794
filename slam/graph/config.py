"""What the graph believes of its measurements, and when it takes two things for one."""

from dataclasses import dataclass


@dataclass(frozen=True)
class GraphConfig:
    """Standard deviations (`…_sigma…`), gates in χ², and how much is solved at every sweep.

    A wheel's error is a scale (rotation, distance) or degrees of heading per metre (drift); `ring_sigma_deg` is what
    all sonars together may be turned by. Slip is degrees of heading per √metre driven and per √turn turned.
    """

    window: int = 25  # sweeps that move at every step; older ones only when a loop closes
    iterations: int = 6
    kernel: float = 1.5  # Cauchy's, in standard deviations: what is further off counts less and less
    distance_sigma_m: float = 0.005
    step_sigma_m: float = 0.003
    step_sigma: float = 0.005  # of a step's length
    slip_turn_deg: float = 0.4
    slip_metre_deg: float = 0.4
    heading_sigma_deg: float = 0.1
    rotation_sigma: float = 0.01
    scale_sigma: float = 0.02
    drift_sigma_deg: float = 0.6
    ring_sigma_deg: float = 0.7
    match_bearing_deg: float = 0.6  # on top of what a bearing's own σ is, for walls that are not quite straight
    match_distance_m: float = 0.012
    away_m: float = 0.01  # the pose grows that much more uncertain for each √sweep that a landmark was not seen
    away_deg: float = 0.15
    gate: float = 16.0
    margin: float = 6.0  # a match is unambiguous if the next best is that much worse
    gap_m: float = 3.0  # pieces of one wall may be this far apart
    nature_margin: float = 8.0
    merge_margin: float = 12.0  # two chains are one wall if that adds no more than this to the total error
    explained: float = 0.5  # with a smaller share of walls matched, the coarse search tries to find the place …
    search_deg: float = 5.0  # … turned by no more than this
