"""The wheel: three packages with their data files, and nothing else on the top level."""

import zipfile
from pathlib import Path

import pytest
from hatchling.builders.wheel import WheelBuilder

HOME = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def names(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    folder = tmp_path_factory.mktemp("wheel")
    (wheel,) = WheelBuilder(str(HOME)).build(directory=str(folder), versions=["standard"])
    with zipfile.ZipFile(wheel) as archive:
        return archive.namelist()


def test_the_top_level(names: list[str]) -> None:
    assert {name.split("/")[0] for name in names} == {"cli", "slam", "sonarlog", "sonarlog-0.1.0.dist-info"}
    assert "sonarlog-0.1.0.dist-info/licenses/LICENSE" in names


def test_every_module_and_data_file_is_in_it(names: list[str]) -> None:
    kept = {
        str(path.relative_to(HOME))
        for package in ("cli", "slam", "sonarlog")
        for pattern in ("*.py", "*.toml")
        for path in (HOME / package).rglob(pattern)
    }
    assert kept <= set(names)
    assert {"sonarlog/robots/amigo-sh.toml", "sonarlog/sim/worlds/corridor.toml"} <= kept
