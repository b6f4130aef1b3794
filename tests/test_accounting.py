import re
from pathlib import Path

import pytest

from sonarlog import decode
from sonarlog.accounting import EVENTS, REASONS, USED, Unaccounted, check, told

COUNTS = {"packets": 9, "sips": 7, "readings": 20, "sweeps": 2, "readings_used": 15}


@pytest.mark.parametrize(
    ("more", "why"),
    [
        ({}, "20 readings, but 15 used"),
        ({"readings_left_out_between_scans": 6}, "20 readings, but 15 used"),
        ({"readings_left_out_between_scans": 5, "eaten_by_the_dog": 3}, "without a reason: 3 eaten_by_the_dog"),
        ({"readings_left_out_by_mood": 5}, "without a reason: 5 readings_left_out_by_mood"),
    ],
)
def test_what_is_left_out_without_a_reason_is_a_failure(more: dict[str, int], why: str) -> None:
    with pytest.raises(Unaccounted, match=why):
        check(COUNTS | more)


def test_what_is_left_out_is_told_with_its_reason() -> None:
    counts = COUNTS | {"readings_left_out_between_scans": 6, "readings_used_twice": 1, "junk_bytes": 4, "gaps": 1}
    check(counts)
    assert told(counts) == [
        "9 packets, 20 readings, used 15 in 2 sweeps, 1 of them twice: two turns share them",
        "left out: 4 junk bytes: between packets",
        "left out: 6 readings: taken while driving from scan to scan",
        "1 silences of over a second",
    ]


def test_a_count_without_use_needs_no_reason() -> None:
    check({"readings": 0, "something": 0})


def test_every_name_that_is_counted_has_a_meaning() -> None:

    counted = set()
    for name in ("decode.py", "recording/topics.py"):
        source = (Path(decode.__file__).parent / name).read_text(encoding="utf-8")
        counted |= set(re.findall(r'counts\["(\w+)"\]', source))
    assert counted
    assert counted <= {*USED, *REASONS, *EVENTS}
