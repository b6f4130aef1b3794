"""Canonical bytes and digests, against the examples in docs/determinism.md."""

import ast
import re
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slam.geometry import Pose
from slam.grid import Grid, Patch
from sonarlog.canonical import NotCanonical, canonical, read_canonical
from sonarlog.digest import MapDigest, RunDigest, digest, grid_digest

PAGE = (Path(__file__).parent.parent / "docs" / "determinism.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"^\| `([^`]+)` \| `([^`]*)` \| `([0-9a-f]{32})` \|$", PAGE, re.MULTILINE)


@dataclass(frozen=True)
class Point:
    x: float
    y: float


def valued(text: str) -> Any:
    names = {"Point": Point, "array": np.array, "int16": np.int16, "float64": np.float64, "bool_": np.bool_}
    return eval(text, {"__builtins__": {}, "float": float, "true": True, **names})  # our own page


def byted(text: str) -> bytes:
    data: bytes = ast.literal_eval(f"b'{text}'")
    return data


@pytest.mark.parametrize(("value", "data", "made"), EXAMPLES, ids=[value for value, _, _ in EXAMPLES])
def test_the_page_tells_the_bytes_and_the_digest(value: str, data: str, made: str) -> None:
    assert canonical(valued(value)) == byted(data)
    assert digest(valued(value)) == made


def test_the_page_has_an_example_of_every_kind() -> None:
    assert {byted(data)[:1] for _, data, _ in EXAMPLES} == set(map(bytes, zip(b"dintfslcma", strict=True)))


@pytest.mark.parametrize(
    ("a", "b", "same"),
    [
        (0.0, -0.0, True),
        (float("nan"), -float("nan"), True),
        (1, 1.0, False),
        (True, 1, False),
        ("1", 1, False),
        ((1, 2), [1, 2], True),
        ((1, (2,)), ((1, 2),), False),
        (np.array([0.0, np.nan]), np.array([-0.0, -np.nan]), True),
        (np.array([1.0]), np.array([1.0], dtype=">f8"), True),
        (np.zeros((2, 3)), np.zeros((3, 2)), False),
        (np.zeros(2, dtype=np.int16), np.zeros(2, dtype=np.int64), False),
        (np.arange(6).reshape(2, 3).T, np.ascontiguousarray(np.arange(6).reshape(2, 3).T), True),
        ({"a": 1, "b": 2}, {"b": 2, "a": 1}, True),
        (np.float64(0.5), 0.5, True),
    ],
)
def test_what_counts_as_the_same_value(a: object, b: object, same: bool) -> None:
    assert (canonical(a) == canonical(b)) is same


@pytest.mark.parametrize("value", [object(), {1, 2}, np.array(["a"]), 1j, b"raw"])
def test_what_has_no_canonical_bytes(value: object) -> None:
    with pytest.raises(TypeError):
        canonical(value)


PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False).map(lambda x: x + 0.0) | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=20,
)


@given(PLAIN)
def test_plain_values_come_back(value: object) -> None:
    assert read_canonical(canonical(value)) == value


def test_arrays_and_records_come_back() -> None:
    back = read_canonical(canonical(Point(0.1, -0.0)))
    assert back == {"x": 0.1, "y": 0.0}
    array = np.arange(12, dtype=np.int16).reshape(3, 4)
    assert np.array_equal(read_canonical(canonical(array)), array)
    assert read_canonical(canonical({(1, 2): True})) == {(1, 2): True}


@given(st.binary(max_size=40))
def test_other_bytes_are_refused_or_are_canonical(data: bytes) -> None:
    with suppress(NotCanonical):
        read_canonical(data)


def test_the_map_digest_kept_up_is_that_of_the_whole() -> None:
    grid, kept, seen = Grid(0.05, 15, -6), MapDigest(), set()
    for k in range(12):
        patch = Patch(37 * k - 100, 11 * k - 64, np.full((30, 40), 7 * (-1) ** k, dtype=np.int16))
        grid = grid.extended(patch)
        assert kept.of(grid) == grid_digest(grid)
        seen.add(kept.of(grid))
    assert len(seen) == 12


def test_only_touched_tiles_are_hashed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    grid = Grid(0.05, 15, -6).extended(Patch(0, 0, np.ones((640, 640), dtype=np.int16)))
    kept = MapDigest()
    kept.of(grid)
    hashed: list[object] = []

    def noted(value: object) -> str:
        hashed.append(value)
        return digest(value)

    monkeypatch.setattr("sonarlog.digest.digest", noted)
    kept.of(grid.extended(Patch(70, 70, np.ones((2, 2), dtype=np.int16))))
    assert sum(isinstance(value, np.ndarray) for value in hashed) == 1


def test_a_tile_that_holds_nothing_does_not_count() -> None:
    grid = Grid(0.05, 15, -6).extended(Patch(0, 0, np.ones((2, 2), dtype=np.int16)))
    emptied = grid.extended(Patch(0, 0, -np.ones((2, 2), dtype=np.int16)))
    assert grid_digest(emptied) == grid_digest(Grid(0.05, 15, -6)) != grid_digest(grid)


def test_what_was_asked_is_part_of_a_runs_digest() -> None:
    assert RunDigest(("paper", 1)).result() != RunDigest(("paper", 2)).result()
    pose = Pose(1.0, 2.0, 3.0)
    assert digest(pose) != digest(replace(pose, x=1.0 + 2.0**-52))
