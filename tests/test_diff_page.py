"""The page of a difference: what is in it, and what a browser without a network makes of it."""

import base64
import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from sonarlog.diff import Report, diff_runs
from sonarlog.diff_page import CannotWritePage, page, write_page
from tests.made_runs import drifting, made_run

BROWSER = next(
    (found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), ""
)
OFFLINE = ("--headless", "--no-sandbox", "--disable-gpu", "--host-resolver-rules=MAP * ~NOTFOUND",
           "--enable-logging=stderr", "--virtual-time-budget=2000", "--window-size=1600,1000")  # fmt: skip

# What a reader does, and what is seen of it afterwards.
A_READER = """
const seen = {};
const press = (key) => document.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
const mode = () => document.querySelector("#modes button[aria-pressed=true]").dataset.mode;
seen.first = mode();
press("3"); seen.three = mode();
press(" "); press(" "); seen.flipped = mode(); const b = canvas.toDataURL();
press(" "); seen.back = mode(); seen.flips = b !== canvas.toDataURL();
const before = view.scale; press("+"); seen.nearer = view.scale > before; press("0"); seen.fits = view.scale === before;
press("5"); document.getElementById("swipe").value = 20;
document.getElementById("swipe").dispatchEvent(new Event("input", { bubbles: true })); seen.swipe = view.swipe;
rows[0].click(); seen.chosen = view.wall; seen.row = rows[0].classList.contains("chosen");
press("0"); press("3");
const change = DATA.walls[view.wall], side = change.a.length ? "a" : "b";
const [start, end] = wallEnds(frames()[0], change[side][0], side);
const box = canvas.getBoundingClientRect();
canvas.dispatchEvent(new PointerEvent("pointermove", { bubbles: true, clientX: box.left + (start[0] + end[0]) / 2,
  clientY: box.top + (start[1] + end[1]) / 2 }));
seen.hot = view.hot; seen.tip = tip.textContent;
document.querySelector("#checks input[name=aligned]").click(); seen.aligned = shown.aligned;
document.querySelectorAll("#plots svg").forEach((svg) => svg.dispatchEvent(new PointerEvent("pointermove",
  { clientX: svg.getBoundingClientRect().left + 45 })));
seen.sweep = view.sweep; seen.plots = document.querySelectorAll("#plots svg path").length;
seen.wide = document.documentElement.scrollWidth <= window.innerWidth;
document.documentElement.dataset.seen = JSON.stringify(seen);
"""


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Report:
    folder = tmp_path_factory.mktemp("page")
    runs = [made_run(folder / f"{name}.run.mcap", name, drifting()) for name in ("odometry", "paper")]
    return diff_runs(*runs)


def test_the_page_needs_nothing_else(report: Report) -> None:
    text = page(report)
    assert re.findall(r"https?://[^\s\"']+", text) == ["http://www.w3.org/2000/svg"]
    assert not re.search(r"<(link|img|iframe|object|embed)\b|\bsrc=|@import|url\(", text)
    assert "default-src 'none'" in text


def test_it_says_what_the_report_says(report: Report) -> None:
    text = page(report)
    assert report.first is not None
    assert f"Sweep <b>{report.first.sweep}</b>, block <b>{report.first.block}</b>" in text
    assert text.count('<tr class="wall') == len(report.walls)
    for run in (report.a.run, report.b.run):
        assert run.digest in text
        assert run.identity.code_digest in text
    assert "position, RMS" in text


def test_the_cells_are_those_of_the_maps(report: Report) -> None:
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page(report), re.DOTALL)
    assert found
    cells = json.loads(found[1])["laid"]
    states, data = [], iter(base64.b64decode(cells["runs"]))
    for state in data:
        length = shift = 0
        while True:
            part = next(data)
            length |= (part & 127) << shift
            shift += 7
            if part < 128:
                break
        states += [state] * length
    window = report.window
    assert (cells["height"], cells["width"]) == window.a.shape
    np.testing.assert_array_equal(np.array(states), (3 * window.a.astype(int) + window.b).reshape(-1))


def test_names_cannot_become_markup(tmp_path: Path) -> None:
    run = made_run(tmp_path / "a.run.mcap", "paper", drifting())
    evil = "</script><script>alert(1)</script>"
    text = page(diff_runs(run, run, asked=(f"x@{evil}", "x@<b>")))
    assert evil not in text
    assert "alert(1)" in text
    assert "There is none: every block" in text


def test_a_page_is_not_overwritten_unasked(tmp_path: Path, report: Report) -> None:
    (tmp_path / "mine.html").write_text("mine")
    with pytest.raises(CannotWritePage, match="not overwritten"):
        write_page(report, tmp_path / "mine.html")
    with pytest.raises(CannotWritePage, match="cannot write the page"):
        write_page(report, tmp_path / "nowhere" / "page.html")
    assert (tmp_path / "mine.html").read_text() == "mine"
    write_page(report, tmp_path / "mine.html", force=True)


@pytest.mark.skipif(not BROWSER, reason="no Chromium here: apt-get install chromium")
def test_a_browser_without_a_network_opens_it_and_a_reader_uses_it(tmp_path: Path, report: Report) -> None:
    write_page(report, tmp_path / "plain.html")
    reader = (tmp_path / "plain.html").read_text().replace("</body>", f"<script>{A_READER}</script></body>")
    (tmp_path / "read.html").write_text(reader)
    command = [
        BROWSER,
        *OFFLINE,
        f"--user-data-dir={tmp_path / 'profile'}",
        "--dump-dom",
        (tmp_path / "read.html").as_uri(),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert [line for line in done.stderr.splitlines() if "CONSOLE" in line] == []
    assert 'data-ready="yes"' in done.stdout
    told = re.search(r'data-seen="(.*?)"', done.stdout)
    assert told, "the page's script did not come to its end"
    seen = json.loads(told[1].replace("&quot;", '"').replace("&amp;", "&"))
    assert seen.pop("tip").startswith(report.walls[seen["chosen"]].wall.name)
    assert seen.pop("hot") == seen.pop("chosen")
    assert seen == {
        "first": "all", "three": "diff", "flipped": "b", "back": "a", "flips": True, "nearer": True, "fits": True,
        "swipe": 0.2, "row": True, "aligned": False, "sweep": 0, "plots": 11, "wide": True,
    }  # fmt: skip
