"""`make determinism`: one digest in all configurations, or which of them differs and where.

Prints the tables; with --write they also go into docs/determinism.md; with --quick the emulated machine replays
only the shortest recording. Recordings that are given are replayed instead, their decisions taken again, all with the
default algorithm; the emulated machine takes the shortest. Exit 0: all the same, 1: not.
"""

import sys
from pathlib import Path

from tests.matrix.aarch64 import emulated
from tests.matrix.configurations import HOME, ROOT, at_hand, others
from tests.matrix.probe import explored
from tests.matrix.table import outcomes, page

PAGE = ROOT / "docs" / "determinism.md"
BEGIN, END = "<!-- matrix: written by make determinism -->", "<!-- end of matrix -->"


def among(given: list[str]) -> tuple[list[str], list[str]]:
    """What every configuration replays of the recordings given, and what the slow ones do."""
    shortest = min(given, key=lambda path: Path(path).stat().st_size)
    return ["--short", *given], ["--short", shortest]


def everything(*, quick: bool) -> tuple[list[str], list[str]]:
    """The same of recordings/ and an exploration made for it."""
    recordings = sorted((ROOT / "recordings").glob("*.mcap"))
    HOME.mkdir(parents=True, exist_ok=True)
    exploration = HOME / "exploration.mcap"
    exploration.unlink(missing_ok=True)
    explored(exploration)
    paths = [str(exploration), *(str(path) for path in recordings if ".run." not in path.name)]
    shortest = [str(min(recordings, key=lambda path: path.stat().st_size))] if recordings else []
    return paths, ["--short", str(exploration), *shortest] if quick else paths


def main(arguments: list[str]) -> int:
    """Run the matrix over the recordings given, or those in recordings/ and an exploration made for it."""
    given = [argument for argument in arguments if not argument.startswith("--")]
    if given and "--write" in arguments:
        sys.exit("the page is of recordings/ alone: leave out --write, or the recordings")
    if absent := [path for path in given if not Path(path).is_file()]:
        sys.exit(f"no recording {absent[0]}: name files that are there")
    paths, slow = among(given) if given else everything(quick="--quick" in arguments)
    found = []
    for outcome in outcomes([*at_hand(), *others(), emulated()], paths, slow):
        found.append(outcome)
        print(f"{outcome.name}: {outcome.verdict} {outcome.why}".rstrip(), file=sys.stderr, flush=True)
    print(page(found))
    if "--write" in arguments:
        text = PAGE.read_text(encoding="utf-8")
        before, _, rest = text.partition(BEGIN)
        PAGE.write_text(f"{before}{BEGIN}\n{page(found)}\n{END}{rest.partition(END)[2]}", encoding="utf-8")
    return 0 if all(outcome.well for outcome in found) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
