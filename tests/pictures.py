"""The documentation's pictures, taken of the real viewer, a real browser and the picture itself.

`python -m tests.pictures FOLDER` writes them there; docs/pictures is where they are kept.
"""

import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from PIL import Image
from rerun.experimental import ViewerClient

from slam.algorithms import algorithm
from slam.geometry import Pose
from slam.pipeline import Step
from sonarlog.diff import Report, diff_runs
from sonarlog.diff_page import draw_difference, write_page
from sonarlog.log import Log
from sonarlog.replay import replay
from sonarlog.runs import read_run
from sonarlog.viz.comparison import compare_to_file
from sonarlog.viz.inspection import Inspection, inspect_to_file
from sonarlog.viz.native import start_viewer

RECORDING = Path(__file__).parents[1] / "recordings" / "loop.mcap"
SWEEP = 38
BROWSER = next(
    (found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), ""
)
WIDE, PHONE, DARK = (1600, 1250), (390, 1400), ("--blink-settings=preferredColorScheme=0",)


class Shown:
    """A watcher that saves what it sees to two files: beginning with the overview, and with the blocks."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._to: list[Inspection] = []

    def begin(self, log: Log, sweeps: int) -> None:
        """Open the files."""
        names = ("overview", "blocks")
        self._to = [inspect_to_file("loop", log, self._folder / f"{n}.rrd", tab=k) for k, n in enumerate(names)]

    def step(self, step: Step, truth: Pose | None) -> None:
        """Draw it."""
        for each in self._to:
            each.add(step, truth)

    def finish(self) -> None:
        """Close the files."""
        for each in self._to:
            each.finish()


def take(folder: Path) -> list[Path]:
    """Take all pictures that this machine can; those of pages need a browser. Raises NoViewer."""
    with tempfile.TemporaryDirectory(prefix="pictures-") as there:
        work = Path(there)
        shown = Shown(work)
        replay(RECORDING, algorithm("graph"), work / "graph.run.mcap", watcher=shown)
        shown.finish()
        replay(RECORDING, algorithm("paper"), work / "paper.run.mcap")
        report = diff_runs(read_run(work / "paper.run.mcap"), read_run(work / "graph.run.mcap"))
        compare_to_file(report, work / "difference.rrd")
        draw_difference(report, work / "difference.png")
        taken = [_kept(work / "difference.png", folder / "difference.png", 1200)]
        for name in ("overview", "blocks", "difference"):
            with _viewer() as client:
                client.open(str(work / f"{name}.rrd"))
                _settled(client)
                client.save_screenshot(str(work / "shot.png"))
                taken.append(_kept(work / "shot.png", folder / f"viewer-{name}.png", 1280))
        return taken + (_pages(report, work, folder) if BROWSER else [])


@contextmanager
def _viewer() -> Iterator[ViewerClient]:
    viewer = start_viewer(headless=True)
    try:
        yield ViewerClient.connect(viewer.url)
    finally:
        viewer.process.kill()
        viewer.process.wait()


def _settled(client: ViewerClient) -> None:
    """Wait until everything has arrived, notices are gone and plots have found their scale."""
    client.set_time("sweep", sequence=SWEEP, play_state="paused")
    end = time.monotonic() + 8
    while time.monotonic() < end or client.get_state().loading:
        client.take_screenshot(max_size=64)
        time.sleep(0.5)


def _pages(report: Report, work: Path, folder: Path) -> list[Path]:
    write_page(report, work / "page.html")
    sizes = {"page": (WIDE, ()), "page-phone": (PHONE, DARK)}
    taken = []
    for name, ((width, height), more) in sizes.items():
        shot = work / f"{name}.png"
        command = [
            BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--virtual-time-budget=3000",
            f"--user-data-dir={work / 'profile'}", f"--window-size={width},{height}", f"--screenshot={shot}", *more,
            (work / "page.html").as_uri(),
        ]  # fmt: skip
        subprocess.run(command, capture_output=True, timeout=60, check=True)
        taken.append(_kept(shot, folder / f"{name}.png", 1200))
    return taken


def _kept(shot: Path, path: Path, width: int) -> Path:
    """The picture no wider than that, in 256 colours: small enough for a repository."""
    image = Image.open(shot).convert("RGB")
    if image.width > width:
        image = image.resize((width, round(image.height * width / image.width)), Image.Resampling.LANCZOS)
    image.quantize(256, kmeans=4, dither=Image.Dither.NONE).save(path, optimize=True)
    return path


if __name__ == "__main__":
    sys.stdout.writelines(f"{path}\n" for path in take(Path(sys.argv[1])))
