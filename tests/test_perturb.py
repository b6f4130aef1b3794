from pathlib import Path

import numpy as np
import pytest

from cli.main import run as sonarlog
from slam.algorithms import algorithm
from sonarlog.perturb import BadPerturbation, Perturbation, sensitivity
from sonarlog.recording import read_log


@pytest.mark.parametrize("text", ["", "ulp", "0mm", "1 metre", "drop=0%", "drop=100%", "drop=1", "-1ulp", "2km"])
def test_what_is_no_perturbation(text: str) -> None:
    with pytest.raises(BadPerturbation, match="give 1ulp"):
        Perturbation.parse(text)


def test_what_is_perturbed(short_recording: Path) -> None:
    log = read_log(short_recording)
    nudged = Perturbation.parse("1ulp").of(log, 1)
    assert nudged.robot.sonars[0].x_mm == np.nextafter(log.robot.sonars[0].x_mm, np.inf)
    assert nudged.readings is log.readings
    moved = Perturbation.parse("2mm").of(log, 1).readings.range_mm - log.readings.range_mm
    assert set(moved.tolist()) == {-2, -1, 0, 1, 2}
    assert not moved[log.readings.range_mm >= log.robot.max_range_mm].any()
    dropped = Perturbation.parse("drop=10%").of(log, 1).readings
    assert len(dropped.t_ns) / len(log.readings.t_ns) == pytest.approx(0.9, abs=0.03)
    again = Perturbation.parse("drop=10%").of(log, 1).readings
    assert np.array_equal(dropped.t_ns, again.t_ns)


def test_a_healthy_log_hardly_moves(short_recording: Path) -> None:
    found = sensitivity(short_recording, algorithm("paper"), Perturbation.parse("1ulp"))
    assert found.largest_mm < 0.01
    assert found.parted is None
    assert found.sweeps[0] == found.sweeps[1]


def test_replay_tells_the_sensitivity(short_recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert sonarlog(["replay", str(short_recording), "--perturb", "1mm", "--algorithm", "odometry", "-q"]) == 0
    assert capsys.readouterr().out.startswith("moved by 1mm: poses by up to 0 mm (sweep 0) and ")
    assert sonarlog(["replay", str(short_recording), "--perturb", "much"]) == 2
