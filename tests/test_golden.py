"""Replays of recordings/ give what was blessed, to the bit: `make golden` shows a change, and blesses it."""

import re
from dataclasses import replace
from pathlib import Path

import pytest
from _pytest.mark import ParameterSet

from slam.algorithms import DEFAULT
from tests.golden_runs import KEPT, ROOT, changes, kept, made, names


def marked(path: Path, name: str) -> ParameterSet:
    """One of them is in every test run; all are in CI."""
    quick = (path.stem, name) == ("bend", DEFAULT)
    return pytest.param(path, name, id=f"{path.stem}-{name}", marks=() if quick else pytest.mark.slow)


@pytest.mark.parametrize(("path", "name"), [marked(path, name) for path, name in names()])
def test_a_replay_gives_what_was_blessed(path: Path, name: str) -> None:
    assert not changes(kept(path, name), made(path, name)), "see it whole, and bless it: make golden"


def test_nothing_is_blessed_that_is_not_replayed() -> None:
    assert {file.stem for file in KEPT.glob("*.json")} == {f"{path.stem}.{name}" for path, name in names()}


def test_the_page_prints_the_blessed_digests() -> None:
    text = (ROOT / "docs" / "determinism.md").read_text(encoding="utf-8")
    printed = dict(re.findall(r"^\| (\w+, \w+) \| `([0-9a-f]{32})` \|$", text, re.MULTILINE))
    for path, name in names():
        golden = kept(path, name)
        assert golden is not None
        assert printed[f"{path.stem}, {name}"] == golden.digest


def test_a_change_is_told_as_a_user_would_read_it() -> None:
    path, name = names()[0]
    golden = kept(path, name)
    assert golden is not None
    assert changes(golden, golden) == ""
    assert changes(None, golden).startswith(f"{golden.name}: new, {len(golden.sweeps)} sweeps")
    x, y, theta = golden.sweeps[2]["pose"]
    digests = golden.sweeps[2]["digests"] | {"F": "0", "G": "0"}
    other = {**golden.sweeps[2], "pose": [x + 0.002, y, theta], "digests": digests}
    asked = {**golden.asked, "config": {**golden.asked["config"], "map.wall": 0}}
    moved = replace(
        golden,
        asked=asked,
        sweeps=[*golden.sweeps[:2], other, *golden.sweeps[3:]],
        map={**golden.map, "left": golden.map["left"] + 1},
    )
    told = changes(golden, moved)
    assert f"{golden.name}: map.wall was {golden.asked['config']['map.wall']}, is 0; differs first at sweep 2, " in told
    assert f"local localisation (block F); 1 of {len(golden.sweeps)} poses change, by up to 2 mm; " in told
    assert re.search(r"\d+ of \d+ known cells change: .*\d+ free → occupied", told)
