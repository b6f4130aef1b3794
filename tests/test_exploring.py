"""A robot that explores a chamber: how it ends, what it records, and how a replay decides."""

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from cli.main import run
from slam.algorithms import algorithm
from slam.geometry import Pose
from slam.intent import PATIENCE, Intent
from slam.regions import ranks_of
from sonarlog.decode import WireDecoder
from sonarlog.exploring.coverage import mapped_share, reach_of, short_tour_m
from sonarlog.exploring.explorer import Explorer
from sonarlog.exploring.live_sweeps import LiveSweeps
from sonarlog.log import Log
from sonarlog.recording import open_recording
from sonarlog.recording.reader import read_wire
from sonarlog.replay import replay, replay_sweeps, sweeps_of, true_pose
from sonarlog.sim.link import open_sim
from sonarlog.sim.world import load_world
from sonarlog.sweeps import cut
from tests.explorations import CHAMBER, GRAPH, HALL, QUICK, explore, url
from tests.test_recorder import clearance


@pytest.fixture(scope="module", params=[HALL, pytest.param(CHAMBER, marks=pytest.mark.slow)], ids=["hall", "chamber"])
def place(request: pytest.FixtureRequest) -> Path:
    found: Path = request.param
    return found


@pytest.fixture(scope="module")
def explored(place: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Explorer, Log]:
    path = tmp_path_factory.mktemp("explored") / "a.mcap"
    return (path, *explore(path, open_sim(url(place)), replace(QUICK, come_back=True), place))


def test_it_ends_by_itself_has_seen_all_touched_nothing_and_is_back(
    place: Path, explored: tuple[Path, Explorer, Log]
) -> None:
    path, explorer, log = explored
    assert explorer.ended == "nothing reachable is unknown"
    assert log.truth is not None
    assert clearance(log) > 0.2
    assert np.hypot(*log.truth.pose[-1, :2]) < 0.4
    first, *_, last = replay_sweeps(log, sweeps_of(log, path), GRAPH)
    truth = true_pose(log.truth, int(first.sweep.t_ns[first.sweep.reference]))
    assert truth is not None
    frame = truth.compose(last.state.poses[0].step_to(Pose(0.0, 0.0, 0.0)))
    assert mapped_share(last.state.grid, frame, reach_of(load_world(str(place)), 0.18)) > 0.95
    texts = [event.text for event in log.events]
    assert any("m² to see for" in text for text in texts)
    assert "the exploration is back at its start" in texts


def test_a_replay_takes_the_same_decisions(explored: tuple[Path, Explorer, Log], tmp_path: Path) -> None:
    path, explorer, log = explored
    replayed = replay(path, GRAPH, None)
    assert replayed.sweeps == len(log.decisions) == explorer.sweeps
    assert replayed.reproduced is not None
    assert replayed.reproduced.same
    assert replayed.reproduced.told() == f"all {explorer.sweeps} decisions of graph {GRAPH.version} are reproduced"
    assert run(["replay", str(path), "-o", str(tmp_path / "a.run.mcap"), "-q"]) == 0
    assert run(["verify", str(tmp_path / "a.run.mcap"), "-q"]) == 0


def test_other_decisions_are_told_one_by_one(explored: tuple[Path, Explorer, Log]) -> None:
    other = replay(explored[0], algorithm("odometry"), None).reproduced
    assert other is not None
    assert other.same  # for it need not be
    assert other.told().startswith(f"taken by graph {GRAPH.version}; decision ")


def test_a_decision_that_was_altered_is_found(explored: tuple[Path, Explorer, Log], tmp_path: Path) -> None:
    from sonarlog.exploring.reproduction import Reproduction

    path, _, log = explored
    told = [json.loads(text) for text in log.decisions]
    told[1]["goal"][0] += 0.1
    again = Reproduction([json.dumps(each) for each in told], GRAPH)
    for step in replay_sweeps(log, sweeps_of(log, path), GRAPH):
        again.add(step)
    result = again.result()
    assert result is not None
    assert not result.same
    assert result.told().startswith("decision 1: it was to go to the frontier at")


def test_sweeps_cut_as_they_come_are_those_that_a_replay_cuts(explored: tuple[Path, Explorer, Log]) -> None:
    path, _, log = explored
    decoder, live, found = WireDecoder(log.robot), LiveSweeps(log.robot), []
    for k, (t_ns, direction, data) in enumerate(read_wire(open_recording(path))):
        for sample in decoder.feed(t_ns, data) if direction == "rx" else ():
            live.hear(sample)
        found += live.take() if k % 7 == 0 else []
    found += live.take()
    expected = cut(log).sweeps
    assert len(found) == len(expected)
    for mine, yours in zip(found, expected, strict=True):
        assert (mine.session, mine.reference) == (yours.session, yours.reference)
        assert all(np.array_equal(getattr(mine, name), getattr(yours, name)) for name in ("t_ns", "sonar", "range_mm"))


def test_a_way_that_proves_blocked_is_remembered_and_after_a_while_forgotten() -> None:
    leg = np.column_stack([np.linspace(0.0, 1.0, 21), np.zeros(21)])
    before = Intent(goal=(2.0, 0.0), leg=leg)

    def at(sweep: int, x: float, y: float = 0.0) -> tuple[Pose, ...]:
        return (Pose(0.0, 0.0, 0.0),) * sweep + (Pose(x, y, 0.0),)

    assert not before.after(at(5, 0.95), 12).blocks
    scans = np.array([(pose.x, pose.y, pose.theta) for pose in at(5, 0.95)])
    assert before.after(at(5, 0.95), 12).driven(scans)[-1].tolist() == pytest.approx([0.9, 0.0], abs=0.06)
    stopped = before.after(at(5, 0.3), 12)
    (block,) = stopped.blocks
    assert (block.x, block.y) == pytest.approx((0.65, 0.0), abs=0.06)
    assert (stopped.vain[0].x, stopped.vain[0].y) == (2.0, 0.0)
    assert stopped.after(at(17, 9.0, 9.0), 12).blocks
    assert not stopped.after(at(18, 9.0, 9.0), 12).blocks
    often = stopped
    for sweep in range(6, 6 + PATIENCE):
        often = often.after(at(sweep, 0.3), 12)
    assert often.forgiving().blocks == often.blocks
    assert not stopped.forgiving().blocks


def test_the_command_line_records_and_sums_up(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.mcap"
    assert run(["explore", "--port", url(), "-o", str(path), "--max-time", "10", "--lean"]) == 0
    said = capfd.readouterr().err
    assert "station 0: " in said
    assert "scans, " in said
    assert "the time is up" in said
    assert run(["explore", "--port", "sim://nowhere", "-o", str(tmp_path / "b.mcap")]) == 2


def test_the_bound_of_a_tour_and_the_reach_of_a_robot() -> None:
    reach = reach_of(load_world(str(CHAMBER)), 0.18)
    assert reach.body.sum() * 0.05**2 == pytest.approx(4 * 2 + 1.2 * 0.9, rel=0.15)  # corners are out of reach
    assert 0.8 < short_tour_m(reach) < 4.0


def test_it_drives_nowhere_that_it_has_not_seen(explored: tuple[Path, Explorer, Log]) -> None:
    path, _, log = explored
    truth, config = log.truth, GRAPH.config.frontier
    assert truth is not None
    steps = list(replay_sweeps(log, sweeps_of(log, path), GRAPH))
    start = true_pose(truth, int(steps[0].sweep.t_ns[steps[0].sweep.reference]))
    assert start is not None
    for step, after in pairwise(steps):
        ranks = ranks_of(step.state.grid, config.chink_cells, 0)
        assert ranks is not None
        cells = np.floor(step.decision.path / ranks.cell_m).astype(int) - (ranks.left, ranks.bottom)
        unknown = step.decision.path[ranks.array(ranks.unknown)[cells[:, 1], cells[:, 0]]]
        scans = np.array([(pose.x, pose.y) for pose in step.state.poses])
        # So near to a scan the nearest surface would have answered.
        assert (np.hypot(*np.moveaxis(unknown[:, None] - scans, -1, 0)) < 0.8).any(axis=1).all()
        between = (truth.t_ns > step.sweep.t_ns[-1]) & (truth.t_ns < after.sweep.t_ns[0])
        places = start.step_to(Pose(0.0, 0.0, 0.0)).points(truth.pose[between, :2])
        off = np.hypot(*np.moveaxis(places[:, None] - step.decision.path, -1, 0)).min(axis=1)
        assert off.max() < 0.3
