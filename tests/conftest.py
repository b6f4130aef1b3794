"""What many tests start from: a short recording of the embedded robot, made once."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from cli.main import run

ROUTE = "scan; go 0.8; scan; go 0.8; scan"
SCANS = 3


@pytest.fixture(scope="session", autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Runs made on the way do not go to the user's cache."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SONARLOG_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="session")
def short_recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three scans in the corridor. Nobody may change it."""
    path = tmp_path_factory.mktemp("short") / "short.mcap"
    assert run(["record", "--port", "sim://corridor?seed=1", "-o", str(path), "--route", ROUTE, "--lean", "-q"]) == 0
    return path


@pytest.fixture(scope="session")
def short_run(short_recording: Path) -> Path:
    """Its run with `paper`. Nobody may change it."""
    path = short_recording.parent / "short.paper.run.mcap"
    assert run(["replay", str(short_recording), "--algorithm", "paper", "-o", str(path), "-q"]) == 0
    return path
