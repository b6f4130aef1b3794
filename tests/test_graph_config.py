"""Every setting of the graph is read somewhere, and explained on its page as it is."""

import re
from dataclasses import fields
from pathlib import Path

import pytest

import slam.graph
from slam.graph.config import GraphConfig
from tests.test_docs import HOME

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
