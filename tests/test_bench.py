"""The bench: what it plans, what it keeps, what it makes of results, and the command over all that."""

import json
from collections.abc import Sequence
from math import cos, radians, sin
from pathlib import Path

import numpy as np
import pytest

from cli.main import run
from cli.options import value_of
from cli.recording import plan_of
from slam.errors import SlamError
from sonarlog.bench import pool
from sonarlog.bench.conditions import CONDITIONS, BadCondition, Condition, conditions_named
from sonarlog.bench.guide import guided
from sonarlog.bench.page import Picture, page
from sonarlog.bench.plan import BadPlan, Case, Plan, contender, numbers_of, worlds_of
from sonarlog.bench.recipe import Recipe
from sonarlog.bench.report import BEGIN, END, NoPlace, as_dict, write_into
from sonarlog.bench.results import Results, results_of
from sonarlog.bench.routes import respaced, without_scans
from sonarlog.bench.tables import broken, tables
from sonarlog.bench.work import Outcome
from sonarlog.recording import read_log
from sonarlog.route import Action, Follow, Go, Repeat, Scan, Turn, parse_route
from sonarlog.sim.link import parse_url
from sonarlog.sim.world import BadWorld, built_in, load_world

EXAMPLE = """
[materials]
plaster = { half_beam_deg = 14.0 }
[[walls]]
material = "plaster"
points = [[-1.0, -1.0], [2.5, -1.0], [2.5, 1.0], [-1.0, 1.0]]
closed = true
"""


@pytest.mark.parametrize(("text", "numbers"), [("3", (3,)), ("1-3,7,2", (1, 2, 3, 7))])
def test_numbers(text: str, numbers: tuple[int, ...]) -> None:
    assert numbers_of("seeds", text) == numbers


@pytest.mark.parametrize("text", ["", "x", "3-1", "1-", "-1", "1-999999999"])
def test_bad_numbers(text: str) -> None:
    with pytest.raises(BadPlan, match="seeds: "):
        numbers_of("seeds", text)


def test_worlds() -> None:
    assert worlds_of("bend, random:2-3,random:9") == ("bend", "random:2", "random:3", "random:9")
    with pytest.raises(BadWorld, match="no world 'bent'"):
        worlds_of("bent")


def test_contenders_are_algorithms_with_settings() -> None:
    plain, changed = (contender(text, value_of) for text in ("paper", "paper+association.d2_m=0.8"))
    assert plain.algorithm.config.association.d2_m == 2.0
    assert changed.algorithm.config.association.d2_m == 0.8
    assert changed.label == "paper+association.d2_m=0.8"
    with pytest.raises(BadPlan, match=r"'d2' is no BLOCK\.KEY=VALUE"):
        contender("paper+d2", value_of)
    with pytest.raises(SlamError, match="no algorithm 'papr'"):
        contender("papr", value_of)


@pytest.mark.parametrize("condition", CONDITIONS.values(), ids=CONDITIONS)
def test_every_condition_makes_a_robot_in_every_world(condition: Condition) -> None:
    for world in built_in():
        recipe = Recipe.of(load_world(world), 3, condition)
        assert parse_url(recipe.url).build()
        assert recipe.route


def test_all_conditions() -> None:
    assert [condition.name for condition in conditions_named(["plain", "all"])] == list(CONDITIONS)
    with pytest.raises(BadCondition, match="no condition 'fog'; known are plain, perfect"):
        conditions_named(["fog"])


def test_a_recording_is_named_by_what_it_is_made_of() -> None:
    names = {Case("bend", seed, name).recipe().name() for seed in (1, 2) for name in CONDITIONS}
    same = {"noise-1cm", "spacing-0.8", "odometry-1"}  # usual noise and spacing have a name of their own, odometry too
    assert Case("bend", 1, "spacing-0.8").recipe().name() == Case("bend", 1, "plain").recipe().name()
    assert len(names) >= 2 * (len(CONDITIONS) - len(same))


def test_scans_closer_together_and_none() -> None:
    route = parse_route("scan; repeat 2 (go 0.8; scan); turn 90; follow 1; scan")
    assert respaced(route, 0.4) == (
        Scan(), *(Go(0.4), Scan()) * 4, Turn(90.0), Follow(0.4), Scan(), Follow(0.4), Scan(), Follow(0.2), Scan(),
    )  # fmt: skip
    assert respaced(route, 1.2) == (
        Scan(), Go(0.8), Go(0.4), Scan(), Go(0.4), Turn(90.0), Follow(0.8), Scan(), Follow(0.2), Scan(),
    )  # fmt: skip
    assert without_scans(route) == (Repeat(2, (Go(0.8),)), Turn(90.0), Follow(1.0))


def results(ratios: Sequence[float | None], conditions: tuple[str, ...] = ("plain",)) -> Results:
    """Of `paper` in random places 1, 2, …; None is a replay that failed."""
    worlds = tuple(f"random:{n}" for n in range(1, len(ratios) + 1))
    plan = Plan(worlds, (1,), conditions, (contender("paper", value_of),))
    found = [
        Outcome("paper", None if ratio is None else {"ate_m": ratio / 2, "ate_m_ratio": ratio, "free_true": ratio / 4},
                "" if ratio is not None else "no sweeps") for ratio in ratios
    ]  # fmt: skip
    return results_of(plan, [(case, [found[worlds.index(case.world)]]) for case in plan.cases()])


def test_spreads() -> None:
    (group,) = results([0.2, 1.4, 0.4, None]).groups
    spread = group.spreads["ate_m_ratio"]
    assert (spread.median, spread.low, spread.high) == pytest.approx((0.4, 0.3, 0.9))
    assert (spread.worst, spread.worst_case.world) == (1.4, "random:2")
    assert group.spreads["free_true"].worst == pytest.approx(0.05)  # of a share the least is the worst
    assert (group.place, group.failed, len(group.rows)) == ("random", 1, 4)


def test_what_broke_is_said() -> None:
    assert broken(results([0.2, 0.9])) == []
    assert broken(results([0.2, 1.4, 0.4, None])) == [
        "`paper` in random, plain: 1 of 4 worse than raw odometry, the worst 1.40 × (random:2, seed 1)",
        "`paper` in random, plain: 1 of 4 failed, such as random:4, seed 1: no sweeps",
    ]


def test_where_odometry_is_perfect_centimetres_are_said() -> None:
    assert broken(results([0.06, 0.2], ("perfect",))) == [
        "`paper` in random, perfect: 1 of 2 more than 5 cm off, the worst 10.0 cm (random:2, seed 1)"
    ]


def test_tables_and_reports(tmp_path: Path) -> None:
    found = results([0.2, None], ("plain", "noise-3cm"))
    path, maps, others = tables(found)
    assert path.rows[0][:4] == ("random", "paper", "2, 1 failed", "0.100")
    assert others.rows == (("noise-3cm", "paper", "0.20 (0.20, 1 failed)"),)
    assert maps.rows[0][6] == "5"
    document = tmp_path / "page.md"
    document.write_text(f"# Accuracy\n\nBefore.\n\n{BEGIN}\nold\n{END}\n\nAfter.\n")
    for _ in range(2):
        write_into(document, found, "sonarlog bench")
    text = document.read_text()
    assert text.startswith("# Accuracy\n\nBefore.\n")
    assert text.endswith(f"{END}\n\nAfter.\n")
    assert "old" not in text
    assert "| noise-3cm | paper | 0.20 (0.20, 1 failed) |" in text
    assert json.loads(json.dumps(as_dict(found, "sonarlog bench")))["rows"][1]["error"] == "no sweeps"
    html = page(found, [Picture("<corridor>", OSError("no disk"))], "sonarlog bench")
    assert "&lt;corridor&gt;" in html
    document.write_text("nothing")
    with pytest.raises(NoPlace, match="has no lines"):
        write_into(document, found, "sonarlog bench")


def test_a_call_that_fails_is_a_result_and_the_others_go_on() -> None:
    for processes in (1, 2):
        found = dict(pool.run(int, ["1", "x", "3"], processes))
        assert (found["1"], found["3"]) == (1, 3)
        assert isinstance(found["x"], ValueError)


def test_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """A room of a world file, recorded, replayed, told; then told again without doing anything."""
    monkeypatch.chdir(tmp_path)
    Path("room.toml").write_text('tour = "scan; go 0.5; scan"' + EXAMPLE)
    Path("torn.toml").write_text('tour = "scan"' + EXAMPLE)
    torn = Path("out/bench/recordings") / f"{Case('torn.toml', 1, 'plain').recipe().name()}.mcap"
    torn.parent.mkdir(parents=True)
    torn.write_bytes(b"no recording at all")
    line = [
        "bench",
        "--worlds",
        "room.toml,torn.toml",
        "--seeds",
        "1",
        "--algorithms",
        "odometry,paper",
        "--jobs",
        "1",
        "-q",
    ]
    assert run([*line, "--conditions", "plain,noise-1cm", "--json", "all.json", "--html", "page.html"]) == 1
    out = capsys.readouterr().out
    assert "paper in torn.toml, plain: 1 of 1 failed, such as seed 1: " in out
    rows = json.loads(Path("all.json").read_text())["rows"]
    assert [row["error"] is None for row in rows] == [True, True, False, False] * 2
    assert rows[1]["measures"]["ate_m"] < 0.1
    assert Path("page.html").read_text().count("data:image/png;base64,") == 2
    recordings = sorted(Path("out/bench/recordings").glob("room*.mcap"))
    assert len(recordings) == 1  # 1 cm of noise is the usual
    assert len(read_log(recordings[0]).readings.t_ns) > 1000
    before = {path: path.stat().st_mtime_ns for path in Path("out/bench").rglob("room*")}
    assert run([*line, "--only-table"]) == 0
    assert {path: path.stat().st_mtime_ns for path in Path("out/bench").rglob("room*")} == before
    assert "room.toml" in capsys.readouterr().out


def test_a_world_file_is_found_where_it_is_and_its_surfaces_are_known(tmp_path: Path) -> None:
    names = set()
    for folder in (tmp_path / "here", tmp_path / "there"):
        folder.mkdir()
        (folder / "room.toml").write_text('tour = "scan"' + EXAMPLE)
        recipe = Case(str(folder / "room.toml"), 1, "plain").recipe()
        assert recipe.guided
        names.add(recipe.name())
        recipe.make(folder / "it.mcap")
        surfaces = read_log(folder / "it.mcap").surfaces
        assert surfaces is not None
        assert surfaces.segments.shape == (4, 4)
    assert len(names) == 1
    settings = {"port": f"sim://{tmp_path}/here/room.toml?seed=2", "speed": None, "robot": None, "sim": False}
    known = plan_of(settings).surfaces
    assert known is not None
    assert surfaces is not None
    assert (known.segments == surfaces.segments).all()


def test_conditions_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["bench", "--list"]) == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == list(CONDITIONS)


class Crooked:
    """A robot whose metre is a tenth too long and whose turns are a tenth too wide."""

    def __init__(self) -> None:
        self.x = self.y = self.heading = 0.0

    def where_is(self) -> tuple[float, float, float]:
        return self.x, self.y, self.heading

    def do(self, action: Action) -> None:
        if isinstance(action, Turn):
            self.heading += 1.1 * action.degrees
        elif isinstance(action, Go):
            self.x += 1.1 * action.metres * cos(radians(self.heading))
            self.y += 1.1 * action.metres * sin(radians(self.heading))


def test_a_guide_brings_the_robot_where_the_route_leads_on_paper() -> None:
    robot = Crooked()
    scanned = []
    for action in guided(parse_route("scan; repeat 3 (go 1; scan; turn 90); go 1; go -1; turn -180"), robot.where_is):
        robot.do(action)
        if isinstance(action, Scan):
            scanned.append((robot.x, robot.y))
    assert np.abs(np.array(scanned) - [(0, 0), (1, 0), (1, 1), (0, 1)]).max() < 0.2
    assert (robot.x, robot.y) == pytest.approx((0, 1), abs=0.2)
    assert 50 < robot.heading < 130  # 270° round to the left, a half turn back
