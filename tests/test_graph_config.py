"""Every setting of the graph is read somewhere, and explained on its page as it is."""

import re
from dataclasses import fields
from pathlib import Path

import pytest

import slam.graph
from slam import pipeline
from slam.algorithms import algorithm
from slam.config import RANGES
from slam.graph.config import GraphConfig
from slam.motion import WheelErrors
from tests.synthetic import RING
from tests.test_docs import HOME
from tests.walks import room, straight, walk

CODE = "".join(
    path.read_text(encoding="utf-8") for path in Path(slam.graph.__path__[0]).glob("*.py") if path.stem != "config"
)
PAGE = (HOME / "docs" / "graph.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", [field.name for field in fields(GraphConfig)])
def test_every_setting_does_something(name: str) -> None:
    assert re.search(rf"\bconfig\.(graph\.)?{name}\b", CODE)


@pytest.mark.parametrize("name", [field.name for field in fields(GraphConfig)])
def test_every_setting_is_explained_with_its_default(name: str) -> None:
    default = getattr(GraphConfig(), name)
    assert re.search(rf"^\| `{name}` \| {re.escape(f'{default:g}')}\b", PAGE, re.MULTILINE)


@pytest.mark.parametrize(
    "name", [*(f"graph.{field.name}" for field in fields(GraphConfig)), "reliability.bearing_sigma_deg"]
)
def test_the_smallest_value_of_every_setting_breaks_nothing(name: str) -> None:
    """It may well be a bad one."""
    least = RANGES.get(name, (0, 0))[0]
    made = walk(room(-1.0, -1.0, 4.0, 1.0), straight(4), WheelErrors(0.01, 0.02, 0.005))
    chosen = algorithm("graph").configured({name: least})
    poses = list(pipeline.run(made.sweeps, RING, chosen))[-1].state.poses
    assert all(abs(value) < 10.0 for pose in poses for value in (pose.x, pose.y, pose.theta))
