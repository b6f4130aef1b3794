"""A report in plain values, ready for JSON: docs/diff.md lists them. Must not know: how differences are found."""

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from sonarlog.apart import plain
from sonarlog.diff.figures import figures

if TYPE_CHECKING:
    from sonarlog.diff.first import FirstDifference
    from sonarlog.diff.matching import WallChange
    from sonarlog.diff.report import Report, Side
    from sonarlog.diff.times import TimeChanges
    from sonarlog.diff.walls import Wall

VERSION = 1
"""Of this form; it grows when a key changes its meaning or goes."""
SHOWN = 20


def report_data(report: "Report") -> dict[str, Any]:
    """Every level; of the first difference's values only the first few."""
    alignment = report.alignment
    data = {
        "version": VERSION,
        "verdict": report.verdict,
        "same": report.same,
        "headline": report.headline,
        "tolerance": report.tolerance and asdict(report.tolerance),
        "names": report.names,
        "a": _side(report.a),
        "b": _side(report.b),
        "sweeps": report.sweeps,
        "settings": report.settings,
        "first": report.first and _first(report.first),
        "chaining": report.chaining and asdict(report.chaining),
        "goal": report.goal and asdict(report.goal),
        "alignment": {
            "shift_m": alignment.shift_m,
            "turned_deg": alignment.turned_deg,
            "about": alignment.about,
            "b_in_a": [alignment.pose.x, alignment.pose.y, alignment.pose.theta],
        },
        "cells": asdict(report.cells),
        "aligned_cells": asdict(report.aligned_cells),
        "walls": [_wall_change(change) for change in report.walls],
        "rooms": asdict(report.rooms),
        "path": asdict(report.path),
        "calibration": [asdict(change) for change in report.calibration],
        "truth": report.truth and asdict(report.truth),
        "times": report.times and _times(report.times),
        "figures": {name: figure.value for name, figure in figures(report).items()},
    }
    result: dict[str, Any] = plain(data)
    return result


def _side(side: "Side") -> dict[str, Any]:
    identity = side.run.identity
    return {
        "name": side.name,
        "asked": side.asked,
        "file": str(side.run.path),
        "digest": side.run.digest,
        "algorithm": identity.algorithm,
        "algorithm_version": identity.algorithm_version,
        "recording_digest": identity.recording_digest,
        "code_digest": identity.code_digest,
        "machine": side.run.machine,
    }


def _first(first: "FirstDifference") -> dict[str, Any]:
    return {
        "sweep": first.sweep,
        "block": first.block,
        "name": first.name,
        "words": first.words,
        "decisions": first.decisions,
        "values": len(first.differences),
        "differences": [vars(each) for each in first.differences[:SHOWN]],
    }


def _times(times: "TimeChanges") -> dict[str, Any]:
    blocks = [{**asdict(row), "ratio": row.ratio} for row in times.rows]
    return {"blocks": blocks, "words": times.words, "apart": times.apart, "now": times.now}


def _wall_change(change: "WallChange") -> dict[str, Any]:
    return {
        "kinds": change.kinds,
        "words": change.words,
        "a": [_wall(wall) for wall in change.a],
        "b": [_wall(wall) for wall in change.b],
        "moved_m": change.moved_m,
        "turned_deg": change.turned_deg,
        "longer_m": change.longer_m,
    }


def _wall(wall: "Wall") -> dict[str, Any]:
    return {
        "number": wall.number,
        "name": wall.name,
        "chain": wall.chain,
        "alpha": wall.alpha,
        "rho": wall.rho,
        "start": wall.start,
        "end": wall.end,
        "length_m": wall.length_m,
        "pieces": len(wall.pieces),
        "first_sweep": wall.first_sweep,
        "bent_m": wall.bent_m,
    }
