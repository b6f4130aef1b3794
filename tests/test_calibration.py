"""Calibration: known errors are found, what cannot be seen is refused, and a robot's file takes them out again."""

import json
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cli.main import run
from slam.sweep import TURN
from sonarlog.calibration.adjustment import Adjusted, Priors, adjust
from sonarlog.calibration.correction import Calibration, reckoning
from sonarlog.calibration.equations import DEGREE, DISTANCE, DRIFT, RING, ROTATION, SONARS
from sonarlog.calibration.observations import stretches
from sonarlog.calibration.robot_file import write_robot
from sonarlog.log import Log, Odometry, Readings
from sonarlog.recording import read_log
from sonarlog.robot import BadRobot, Robot, load_robot
from sonarlog.runs import read_run
from sonarlog.sim.faults import draw_mounting
from sonarlog.sweeps import cut
from tests.synthetic import StraightWall, corridor, echo_mm

ROBOT = load_robot("amigo-sh")
TICK_NS = 100_000_000
ERRORS = Calibration(1.01, 0.98, 0.4, 1.0, (1.0, -1.0, 0.5, -0.5, 1.5, -1.5, 0.0, 0.0))
ROOM = [
    StraightWall(-2.2, -1.7, 2.6, -1.7), StraightWall(2.6, -1.7, 2.6, 2.0),
    StraightWall(2.6, 2.0, -2.2, 2.0), StraightWall(-2.2, 2.0, -2.2, -1.7),
]  # fmt: skip


class Drive:
    """A perfect robot with imperfect odometry and sonars among straight walls: rows of a log."""

    def __init__(self, walls: list[StraightWall], errors: Calibration) -> None:
        self.walls, self.errors = walls, errors
        self.x = self.y = self.heading = 0.0
        self.odometry = [0.0, 0.0, 0.0]
        self.t_ns = 0
        self.packets: list[tuple[int, int, int, int, int]] = []
        self.fired: list[tuple[int, ...]] = []

    def move(self, metres: float, degrees: float) -> None:
        """One packet's worth; odometry says what its errors make of it."""
        turn = math.radians(degrees)
        self.x += metres * math.cos(self.heading + turn / 2)
        self.y += metres * math.sin(self.heading + turn / 2)
        self.heading += turn
        said = metres / self.errors.distance_scale
        said_turn = (turn + math.radians(self.errors.drift_deg_per_m) * said) / self.errors.rotation_scale
        self.odometry[0] += said * math.cos(self.odometry[2] + said_turn / 2)
        self.odometry[1] += said * math.sin(self.odometry[2] + said_turn / 2)
        self.odometry[2] += said_turn
        self.t_ns += TICK_NS
        self.packets.append((self.t_ns, *self.pose(), 0))

    def pose(self) -> tuple[int, int, int]:
        x, y, heading = self.odometry
        return round(x * 1e6), round(y * 1e6), round(heading / (2 * math.pi) * TURN)

    def scan(self, way: int) -> None:
        for k in range(732):
            self.move(0.0, way * 0.5)
            sonar = k % 8
            mounted = ROBOT.sonars[sonar]
            cosine, sine = math.cos(self.heading), math.sin(self.heading)
            x = self.x + (cosine * mounted.x_mm - sine * mounted.y_mm) / 1000
            y = self.y + (sine * mounted.x_mm + cosine * mounted.y_mm) / 1000
            axis = self.heading + math.radians(mounted.heading_deg + self.errors.bearing_deg(sonar))
            self.fired.append((self.t_ns, sonar, echo_mm(self.walls, x, y, axis), *self.pose(), 0))
        for _ in range(12):
            self.move(0.0, -way * 0.5)
        self.move(0.0, 0.0)

    def go(self, metres: float) -> None:
        for _ in range(round(abs(metres) / 0.05)):
            self.move(math.copysign(0.05, metres), 0.0)

    def turn(self, degrees: float) -> None:
        for _ in range(round(abs(degrees) / 3)):
            self.move(0.0, math.copysign(3, degrees))

    def log(self) -> Log:
        def columns(rows: Sequence[tuple[int, ...]]) -> list[np.ndarray]:
            return [np.array(column, dtype=np.int64) for column in zip(*rows, strict=True)]

        return Log(ROBOT, Odometry(*columns(self.packets)), Readings(*columns(self.fired)))


def squares(walls: list[StraightWall]) -> Log:
    drive = Drive(walls, ERRORS)
    drive.scan(1)
    for way in (1, -1):
        for side in range(4):
            drive.go(0.5)
            drive.turn(way * 90)
            drive.go(0.5)
            drive.scan(1 if side % 2 else -1)
    return drive.log()


def straight_on() -> Log:
    drive = Drive(corridor(width=2.4), ERRORS)
    for k in range(6):
        drive.scan(1 if k % 2 else -1)
        drive.turn(6 if k % 2 else -6)
        drive.go(0.6)
    return drive.log()


def found_in(log: Log) -> Adjusted:
    return adjust(stretches(log, cut(log).sweeps), len(ROBOT.sonars), Priors())


def test_known_errors_are_found() -> None:
    found = found_in(squares(ROOM))
    bearings = np.array([ERRORS.bearing_deg(k) for k in range(8)])
    errors, sigma = found.errors, found.sigma
    assert 1 + errors[ROTATION] == pytest.approx(ERRORS.rotation_scale, abs=8e-4)
    assert 1 + errors[DISTANCE] == pytest.approx(ERRORS.distance_scale, abs=2e-3)
    assert errors[DRIFT] / DEGREE == pytest.approx(ERRORS.drift_deg_per_m, abs=0.1)
    assert errors[RING] / DEGREE == pytest.approx(bearings.mean(), abs=0.25)
    np.testing.assert_allclose(errors[SONARS:] / DEGREE, bearings - bearings.mean(), atol=0.25)
    assert errors[SONARS:].sum() == pytest.approx(0.0, abs=1e-9)
    assert (sigma[:SONARS] < [1e-3, 5e-3, 0.2 * DEGREE, 0.5 * DEGREE]).all()
    assert found.noise.distance < 0.004


def test_between_two_endless_walls_the_way_is_not_measured() -> None:
    found = found_in(straight_on())
    prior = Priors().of(8)
    assert found.sigma[DISTANCE] > 0.9 * prior[DISTANCE]
    assert found.sigma[ROTATION] < 0.1 * prior[ROTATION]
    assert 1 + found.errors[ROTATION] == pytest.approx(ERRORS.rotation_scale, abs=3 * found.sigma[ROTATION])


def test_a_sonar_that_is_silent_is_not_guessed_and_harms_no_other() -> None:
    log = squares(ROOM)
    deaf = replace(log.readings, range_mm=np.where(log.readings.sonar == 3, 5000, log.readings.range_mm))
    found = found_in(replace(log, readings=deaf))
    assert found.sigma[SONARS + 3] > 0.9 * Priors().sonar
    others = [k for k in range(8) if k != 3]
    bearings = np.array([ERRORS.bearing_deg(k) for k in others])
    np.testing.assert_allclose(
        found.errors[[SONARS + k for k in others]] / DEGREE, bearings - bearings.mean(), atol=0.3
    )


def places(calibration: Calibration | None, raw: Sequence[tuple[int, int, int]]) -> list[tuple[int, int, int]]:
    place = reckoning(calibration)
    return [place(each) for each in raw]


def test_odometry_loses_its_errors() -> None:
    drive = Drive([], ERRORS)
    for metres, degrees in [(0.0, 3.0)] * 60 + [(0.05, 0.0)] * 40 + [(0.05, 2.0)] * 90 + [(-0.05, 0.0)] * 20:
        drive.move(metres, degrees)
    *_, (x, y, heading) = places(ERRORS, [(0, 0, 0), *((x, y, h) for _, x, y, h, _ in drive.packets)])
    assert (x / 1e6, y / 1e6) == pytest.approx((drive.x, drive.y), abs=2e-4)
    assert heading / TURN * 360 == pytest.approx(math.degrees(drive.heading), abs=0.002)


@pytest.mark.parametrize(
    ("calibration", "raw", "end"),
    [
        (None, [(5, 6, 7), (1005, 6, 7)], (1005, 6, 7)),
        (Calibration(), [(5, 6, 7), (1005, 6, 7)], (1005, 6, 7)),
        (Calibration(distance_scale=1.02), [(0, 0, 0), (1_000_000, 0, 0)], (1_020_000, 0, 0)),
        (Calibration(distance_scale=1.02), [(0, 0, 0), (-1_000_000, 0, 0)], (-1_020_000, 0, 0)),
        (Calibration(rotation_scale=0.99), [(0, 0, 0), (0, 0, 10 * TURN)], (0, 0, 10 * TURN * 99 // 100)),
        # Turned by a tenth while it drove a metre: on average by a twentieth.
        (Calibration(drift_deg_per_m=36), [(0, 0, 0), (1_000_000, 0, 0)], (951_057, -309_017, -TURN // 10)),
    ],
)  # fmt: skip
def test_reckoning_by_hand(
    calibration: Calibration | None, raw: list[tuple[int, int, int]], end: tuple[int, int, int]
) -> None:
    assert places(calibration, raw)[-1] == pytest.approx(end, abs=0 if calibration is None else 2)


def test_a_robots_file_says_what_it_was_given(tmp_path: Path) -> None:
    calibrated = replace(
        ROBOT, calibration=replace(ERRORS, sigma={"ring_deg": 0.1, "sonar_deg": [0.2] * 8}, recordings=("ab", "cd"))
    )
    write_robot(calibrated, tmp_path / "mine.toml")
    assert load_robot(str(tmp_path / "mine.toml")) == calibrated
    assert Robot.from_dict(json.loads(json.dumps(calibrated.as_dict()))) == calibrated
    turned = [a.heading - b.heading for a, b in zip(calibrated.ring().mountings, ROBOT.ring().mountings, strict=True)]
    np.testing.assert_allclose(np.degrees(turned), [ERRORS.bearing_deg(k) for k in range(8)])
    assert "calibration" not in ROBOT.as_dict()  # recordings made without one keep their digests
    write_robot(ROBOT, tmp_path / "plain.toml")
    assert load_robot(str(tmp_path / "plain.toml")) == ROBOT


@pytest.mark.parametrize(
    ("calibration", "sentence"),
    [
        ({"turn": 1.0}, "unknown key 'turn' in its calibration"),
        ({"rotation_scale": 3.0}, "rotation_scale goes from 0.5 to 2; it cannot be 3.0"),
        ({"rotation_scale": float("nan")}, "it cannot be nan"),
        ({"sonar_deg": [0.0]}, "1 sonar_deg for 8 sonars"),
        ({"ring_deg": 90.0}, "at most 45° off"),
        (5, "calibration is a table"),
    ],
)
def test_a_calibration_that_is_none_is_refused(calibration: object, sentence: str) -> None:
    with pytest.raises(BadRobot, match="robot parameters: ") as refused:
        Robot.from_dict({**ROBOT.as_dict(), "calibration": calibration})
    assert sentence in str(refused.value)


ROTATION_SCALE, DISTANCE_SCALE, DRIFT_DEG = 1 / 1.012, 1 / 0.99, 0.4


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the calibration route's recording of a bad robot, and the file made of it."""
    folder = tmp_path_factory.mktemp("calibrated")
    port = "sim://loop?seed=1&odometry=rotation=1.012,distance=0.99,drift=0.4,slip=0.3&mounting=1.5"
    made = ["record", "--port", port, "--route", "calibration", "-o", str(folder / "squares.mcap"), "--lean", "-q"]
    assert run(made) == 0
    assert run(["calibrate", str(folder / "squares.mcap"), "-o", str(folder / "mine.toml"), "-q"]) == 0
    return folder


def test_the_simulators_errors_are_found_by_its_calibration_route(calibrated: Path) -> None:
    found = load_robot(str(calibrated / "mine.toml")).calibration
    assert found is not None
    bearings = np.array(draw_mounting(1.5, 8, 1))
    values = [found.rotation_scale, found.distance_scale, found.drift_deg_per_m, found.ring_deg, *found.sonar_deg]
    true = [ROTATION_SCALE, DISTANCE_SCALE, DRIFT_DEG, bearings.mean(), *(bearings - bearings.mean())]
    names = ("rotation_scale", "distance_scale", "drift_deg_per_m", "ring_deg")
    sigma = np.array([*(found.sigma[name] for name in names), *found.sigma["sonar_deg"]])
    assert (np.abs(np.array(values) - true) < 3 * sigma).all()
    assert (sigma < [0.002, 0.005, 0.2, 0.4, *[0.4] * 8]).all()


def test_a_calibrated_robot_reckons_better(calibrated: Path) -> None:
    def off_deg(log: Log) -> float:
        assert log.truth is not None
        heading = np.interp(log.truth.t_ns, log.odometry.t_ns, log.odometry.heading / TURN * 360)
        away = heading - np.degrees(np.unwrap(log.truth.pose[:, 2]))
        return float(np.sqrt(np.mean((away - away[0]) ** 2)))

    raw, mine = (
        read_log(calibrated / "squares.mcap", robot) for robot in (None, load_robot(str(calibrated / "mine.toml")))
    )
    assert off_deg(mine) < 0.3 * off_deg(raw)


def test_the_robot_given_is_part_of_the_run(short_recording: Path, tmp_path: Path) -> None:
    mine, asked = replace(ROBOT, calibration=ERRORS), []
    write_robot(mine, tmp_path / "mine.toml")
    for name, robot in (("raw", []), ("mine", ["--robot", str(tmp_path / "mine.toml")])):
        output = str(tmp_path / f"{name}.run.mcap")
        arguments = ["replay", str(short_recording), "--algorithm", "paper", "-o", output, "-q", *robot]
        assert run([*arguments, "--checkpoint-every", "2"]) == 0
        asked.append(read_run(output).identity)
        assert run(["verify", output, str(short_recording), "-q", "--jobs", "1"]) == 0
    assert asked[0].asked() == {key: value for key, value in asked[1].asked().items() if key != "robot"}
    assert asked[1].given_robot == mine
    assert run(["replay", str(short_recording), "--robot", "amigo", "--from", "3", "-q"]) == 2


@pytest.mark.slow
def test_a_robot_is_calibrated_on(calibrated: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """From what its file says: the same errors come out, not those that are left."""
    arguments = [
        "calibrate",
        str(calibrated / "squares.mcap"),
        "--robot",
        str(calibrated / "mine.toml"),
        "--json",
        "-q",
    ]
    assert run(arguments) == 0
    again = json.loads(capsys.readouterr().out)
    before = load_robot(str(calibrated / "mine.toml")).calibration
    assert before is not None
    rotation, distance, drift = again["parameters"][:3]
    assert rotation["before"] == before.rotation_scale
    for each in (rotation, distance, drift):
        assert each["value"] == pytest.approx(each["before"], abs=0.5 * each["sigma"])


def test_what_is_not_determined_is_said_and_not_written(
    short_recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "mine.toml"
    assert run(["calibrate", str(short_recording), "-o", str(output)]) == 1
    said = capsys.readouterr()
    assert "not determined: drive further, with scans at both ends that see the same walls" in said.out
    assert f"{output} is not written, for want of distance_scale, drift_deg_per_m: " in said.err
    assert not output.exists()
    assert run(["calibrate", str(short_recording), "-o", str(output), "--partial", "-q"]) == 0
    partial = load_robot(str(output)).calibration
    assert partial is not None
    assert partial.drift_deg_per_m == 0.0
    assert partial.rotation_scale != 1.0
    assert partial.sigma["drift_deg_per_m"] == pytest.approx(Priors().drift / DEGREE)
    capsys.readouterr()
    assert run(["calibrate", str(short_recording), "-o", str(output), "-q"]) == 2
    assert "exists and is not overwritten" in capsys.readouterr().err


def test_recordings_that_say_nothing_are_refused(
    short_recording: Path, short_run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    still = tmp_path / "still.mcap"
    assert run(["record", "--port", "sim://loop", "--drive", "none", "--time", "2", "-o", str(still), "-q"]) == 0
    other = tmp_path / "other.mcap"
    port = "sim://loop?robot=p3dx-sh"
    assert run(["record", "--port", port, "--drive", "none", "--time", "2", "-o", str(other), "-q"]) == 0
    capsys.readouterr()
    for arguments, sentence in (
        ([still], "0 full turns in place, and 3 are the least"),
        ([short_recording, other], "are not of the same robot"),
        ([short_run], "is a run, not a recording"),
        ([tmp_path / "nowhere.mcap"], "nowhere.mcap"),
        ([short_recording, "--robot", "nobody"], "robot 'nobody' is not built in"),
    ):
        assert run(["calibrate", *map(str, arguments), "-q"]) == 2
        said = capsys.readouterr().err
        assert sentence in said
        assert said.count("\n") == 1


def test_a_recording_made_with_a_calibrated_robot_keeps_it(tmp_path: Path) -> None:
    write_robot(replace(ROBOT, calibration=ERRORS), tmp_path / "mine.toml")
    recordings = []
    for name, robot in (("plain", []), ("mine", ["--robot", str(tmp_path / "mine.toml")])):
        recordings.append(tmp_path / f"{name}.mcap")
        made = ["record", "--port", "sim://loop", "--route", "turn 90; go 0.4", "-o", str(recordings[-1]), "-q", *robot]
        assert run(made) == 0
    log = read_log(recordings[1])
    assert log.robot.calibration == ERRORS
    topics = read_log(recordings[0], log.robot)
    turned = log.odometry.heading[-1] - log.odometry.heading[0]
    assert turned / TURN * 360 == pytest.approx(90, abs=2.5)  # it drives by what it knows
    assert topics.robot == log.robot
    plain = read_log(recordings[0])
    assert topics.odometry.heading[-1] == pytest.approx(
        plain.odometry.heading[-1] * 1.01 - 0.4 / 360 * TURN * 0.4, abs=0.2 / 360 * TURN
    )
