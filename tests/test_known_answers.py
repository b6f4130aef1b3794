"""The pipeline's known answers: each can be worked by hand from the paper's formulas."""

import math

import numpy as np
import pytest

from slam import pipeline
from slam.algorithms import algorithm
from slam.association import (
    Association,
    AssociationConfig,
    Chains,
    Link,
    associate,
    end_gap,
    mean_distance,
    overlapping,
)
from slam.dmath import DEGREE, Floats
from slam.features import FeatureConfig, Wall, find_corner, intersection
from slam.geometry import ORIGIN, Pose, Segment, segment, through
from slam.localisation import LocalisationConfig, best_shift, best_turn, search
from slam.reliability import Rcd
from slam.self_calibration import Calibration, SelfCalibrationConfig, self_calibrate
from slam.sweep import Sweep
from tests.synthetic import AMIGO_MM_DEG, RING, StraightWall, corridor, echo_mm, scan

PAPER = algorithm("paper")


def line(x0: float, y0: float, x1: float, y1: float) -> Segment:
    return through((x0, y0), (x1, y1), (0.0, 0.0))


def rcd(distance: float, bearing_deg: float) -> Rcd:
    return Rcd(bearing_deg * DEGREE, distance, 0.4, 0.0, -0.2, 0.2, True, 8, ())


# 1. the lever arm ------------------------------------------------------------------------------------------------


def test_each_sonar_on_the_normal_reads_the_wall_less_its_own_lever_arm() -> None:
    expected = [1.4000, 1.3565, 1.3473, 1.3473, 1.3565, 1.4000, 1.3521, 1.3521]
    wall = [StraightWall(1.5, -5.0, 1.5, 5.0)]
    for sonar, (x, y, heading) in enumerate(AMIGO_MM_DEG):
        turn = -math.radians(heading)  # the robot turned so that this sonar looks along x
        mount_x = (math.cos(turn) * x - math.sin(turn) * y) / 1000
        mount_y = (math.sin(turn) * x + math.cos(turn) * y) / 1000
        assert echo_mm(wall, mount_x, mount_y, 0.0) == round(expected[sonar] * 1000)


def test_self_calibration_takes_the_lever_arm_out() -> None:
    sweep = scan([StraightWall(1.5, -5.0, 1.5, 5.0)], ORIGIN)
    config = SelfCalibrationConfig(fit=False)
    beams = self_calibrate(sweep, RING, None, Calibration.unknown(8), config).beams
    wall_x = beams.origin[beams.echo, 0] + beams.distance[beams.echo]
    assert np.abs(wall_x - 1.5).max() <= 0.0005 + 1e-9  # half a millimetre: ranges are integers


# 2. association --------------------------------------------------------------------------------------------------


def test_d1_is_not_symmetric_and_d2_is_between_ends() -> None:
    a, b = line(0, 1, 1, 1), line(1.3, 1.1, 2.3, 1.2)

    def of(segment_: Segment) -> tuple[Floats, Floats, Floats]:
        return np.array([segment_.alpha]), np.array([segment_.rho]), np.array([[segment_.start, segment_.end]])

    assert abs(a.alpha - b.alpha) / DEGREE == pytest.approx(5.711, abs=5e-4)
    assert mean_distance(b, *of(a)[:2])[0] == pytest.approx(0.1500, abs=5e-5)
    assert mean_distance(a, *of(b)[:2])[0] == pytest.approx(0.0398, abs=5e-5)
    assert end_gap(b, of(a)[2])[0] == pytest.approx(0.3162, abs=5e-5)
    assert not overlapping(b, of(a)[0], of(a)[2])[0]
    chains = Chains().joined([(None, 0, a)], 0)
    found = associate((Wall(0, b),), chains, (ORIGIN,), ORIGIN, AssociationConfig())
    assert [(link.chain, link.member) for link in found.links] == [(0, 0)]


@pytest.mark.parametrize(
    "config",
    [AssociationConfig(d1_m=0.149), AssociationConfig(a1_deg=5.7), AssociationConfig(d2_m=0.316)],
    ids=["distance", "angle", "gap"],
)
def test_each_threshold_alone_keeps_walls_apart(config: AssociationConfig) -> None:
    chains = Chains().joined([(None, 0, line(0, 1, 1, 1))], 0)
    assert associate((Wall(0, line(1.3, 1.1, 2.3, 1.2)),), chains, (ORIGIN,), ORIGIN, config).unlinked == (0,)


def test_the_two_faces_of_a_thin_wall_never_meet() -> None:
    front, back = segment(90 * DEGREE, 1.0, -0.3, 0.3), segment(-90 * DEGREE, -1.02, -0.3, 0.3)
    chains = Chains().joined([(None, 0, front)], 0)
    assert associate((Wall(0, back),), chains, (ORIGIN,), ORIGIN, AssociationConfig()).links == ()


def test_of_equal_members_the_lower_chain_then_the_older_member_wins() -> None:
    wall = segment(0.0, 2.0, -0.3, 0.3)
    chains = Chains().joined([(None, 0, wall), (None, 0, wall)], 0).joined([(0, 0, wall)], 0)
    link = associate((Wall(0, wall),), chains, (ORIGIN,), ORIGIN, AssociationConfig()).links[0]
    assert (link.chain, link.member) == (0, 0)


# 3. orientation --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("differences", "average", "turn"),
    [
        ([3.4, 2.6], 3.00, -3),
        ([5, -1], 3.00, 0),
        ([0.6, 0.8], 0.70, 0),
        ([4, 4, -2], 3.33, -3),
        ([-2.2], 2.20, 2),
        ([0.99], 0.99, 0),
        ([1.0], 1.00, -1),
        ([19, 1], 10.00, -1),
    ],
)
def test_orientation(differences: list[float], average: float, turn: int) -> None:
    found, best = best_turn(np.array(differences, dtype=np.float64))
    assert found == pytest.approx(average, abs=0.005)
    assert best == turn


# 4. and 8. translation -------------------------------------------------------------------------------------------


def shifted(walls: list[Segment], roots: list[Segment], price: float) -> tuple[object, object]:
    shift, _, after = best_shift(walls, roots, LocalisationConfig(shift_price=price))
    return (round(shift[0], 9), round(shift[1], 9)), after


def test_a_corridor_wall_moves_the_robot_across_and_not_along() -> None:
    root, wall = line(-1, 1, 1, 1), line(-0.2, 1.13, 0.2, 1.13)
    assert shifted([wall], [root], 0.1) == ((0.0, -0.15), pytest.approx(0.020))
    assert shifted([wall], [root], 0.0) == ((-0.25, -0.15), pytest.approx(0.020))  # eleven ties, row order


def test_the_price_on_shifts_keeps_the_robot_out_of_the_valley() -> None:
    tilt = math.tan(math.radians(1))
    roots = [line(-1, 1, 1, 1), line(-1, -1 - tilt, 1, -1 + tilt)]
    walls = [line(-0.2, 1.0, 0.2, 1.0), line(-0.2, -1.05, 0.2, -1.05)]
    assert shifted(walls, roots, 0.1) == ((0.0, 0.0), pytest.approx(0.0250, abs=5e-5))
    assert shifted(walls, roots, 0.0) == ((-0.25, 0.0), pytest.approx(0.0228, abs=5e-5))


# 5. corners ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("distance", "bearing", "is_corner"),
    [(2.236, 26.57, True), (2.270, 27.5, True), (2.236, 60.0, False), (2.400, 26.57, False)],
)
def test_an_rcd_where_two_walls_meet_is_a_corner(distance: float, bearing: float, is_corner: bool) -> None:
    rcds = (rcd(1.0, 90.0), rcd(2.0, 0.0), rcd(distance, bearing))
    assert (find_corner(2, rcds, FeatureConfig()) is not None) == is_corner


def test_where_two_walls_meet() -> None:
    point = intersection(rcd(1.0, 90.0), rcd(1.2, 40.0), FeatureConfig())
    assert point == pytest.approx((0.7274, 1.0000), abs=5e-5)
    assert point is not None
    assert math.hypot(*point) == pytest.approx(1.2366, abs=5e-5)
    assert math.degrees(math.atan2(point[1], point[0])) == pytest.approx(53.97, abs=5e-3)


# 6. post-localisation calibration --------------------------------------------------------------------------------


def test_a_wall_seen_from_the_pose_and_from_the_corrected_pose() -> None:
    wall = segment(60 * DEGREE, 1.5, -0.3, 0.3)
    before = wall.moved(Pose(2.0, 1.0, 30 * DEGREE))
    assert (before.alpha / DEGREE, before.rho) == pytest.approx((90.0, 2.5))
    assert before.middle == pytest.approx((2.0, 2.5))
    after = wall.moved(Pose(2.1, 0.95, 28 * DEGREE))
    assert (after.alpha / DEGREE, after.rho) == pytest.approx((88.0, 2.52271), abs=5e-6)
    assert after.middle == pytest.approx((2.1523, 2.4491), abs=5e-5)


def test_the_search_turns_then_shifts() -> None:
    root = segment(90 * DEGREE, 1.0, -0.5, 0.5)
    wall = segment(93 * DEGREE, 1.1, -0.3, 0.3)
    found = Association((Link(0, 0, 0, 0.1, 0.05, 0.0),), (), (wall,))
    result = search(ORIGIN, found, Chains().joined([(None, 0, root)], 0), LocalisationConfig())
    assert result.turn_deg == -3.0
    assert result.pose.theta / DEGREE == pytest.approx(-3.0, abs=1e-3)
    assert result.shift == pytest.approx((0.0, -0.10))


# 7. regions of constant depth ------------------------------------------------------------------------------------


def only_rcd(step: pipeline.Step) -> Rcd:
    assert len(step.reliability.rcds) == 1
    return step.reliability.rcds[0]


def one_step(sweep: Sweep) -> pipeline.Step:
    """Without the fit of block B, which one wall alone hardly determines: this is about block C."""
    unfitted = PAPER.configured({"self_calibration.fit": False})
    return pipeline.step(pipeline.first_state(RING, unfitted), sweep, RING, unfitted)


@pytest.mark.parametrize("bearing_deg", [0, 40, 133, 180])
@pytest.mark.parametrize("spoilt", [None, 5000, 400])
def test_a_wall_is_one_rcd_of_all_sonars_whatever_one_reading_a_sonar_says(
    bearing_deg: int, spoilt: int | None
) -> None:
    sine, cosine = math.sin(math.radians(bearing_deg)), math.cos(math.radians(bearing_deg))
    x, y = 1.5 * cosine, 1.5 * sine
    sweep = scan([StraightWall(x + 5 * sine, y - 5 * cosine, x - 5 * sine, y + 5 * cosine)], ORIGIN)
    if spoilt is not None:
        for sonar in range(8):
            hits = np.flatnonzero((sweep.sonar == sonar) & (sweep.range_mm < 5000))
            sweep.range_mm[hits[len(hits) // 2]] = spoilt
    found = only_rcd(one_step(sweep))
    assert found.sonars == 8
    assert found.distance == pytest.approx(1.5, abs=0.003)
    assert abs(math.remainder(found.bearing - math.radians(bearing_deg), 2 * math.pi)) <= 0.5 * DEGREE
    assert 24.0 <= found.width / DEGREE <= 28.0


def test_a_wall_that_only_two_sonars_see_is_none() -> None:
    assert one_step(scan([StraightWall(1.5, -5, 1.5, 5)], ORIGIN, sonars=(2, 3))).reliability.rcds == ()


# 9. and 10. the whole pipeline -----------------------------------------------------------------------------------


def drive(name: str, stations: int, spacing: float, kick_at: int, kick_deg: float) -> list[pipeline.Step]:
    """Down a noise-free corridor; odometry is perfect but for one step in heading."""
    heading, x, y, sweeps = 0.0, 0.0, 0.0, []
    for k in range(stations):
        if k == kick_at:
            heading += math.radians(kick_deg)
        if k:
            x, y = x + spacing * math.cos(heading), y + spacing * math.sin(heading)
        sweeps.append(scan(corridor(), Pose(k * spacing, 0.0, 0.0), Pose(x, y, heading)))
    return list(pipeline.run(sweeps, RING, algorithm(name)))


def test_a_heading_step_in_odometry_is_gone_at_the_next_station() -> None:
    steps = drive("paper", 22, 0.8, 1, 3.0)
    assert steps[1].pose.theta / DEGREE == pytest.approx(0.0, abs=0.05)
    assert [step.pose.theta / DEGREE for step in steps] == pytest.approx([0.0] * 22, abs=0.55)
    last = steps[-1].pose
    assert math.hypot(last.x - 16.8, last.y) <= 0.10
    raw = drive("odometry", 22, 0.8, 1, 3.0)[-1].pose
    assert math.hypot(raw.x - 16.8, raw.y) == pytest.approx(0.88, abs=0.01)


def test_with_perfect_odometry_paper_stays_and_literal_walks_along_the_corridor() -> None:
    def along(name: str) -> list[float]:
        return [abs(step.pose.x - 0.8 * k) for k, step in enumerate(drive(name, 12, 0.8, -1, 0.0))]

    assert max(along("paper")) <= 0.05
    assert max(along("literal")) >= 0.25  # a window's half at the least


def test_a_sweep_without_any_echo_changes_nothing() -> None:
    first, second = scan(corridor(), ORIGIN), scan([], Pose(0.4, 0.0, 0.0))
    before, after = pipeline.run([first, second], RING, PAPER)
    assert after.features == type(after.features)((), (), ())
    assert after.pose == Pose(0.4, 0.0, 0.0).quantised()
    assert after.state.grid == before.state.grid
