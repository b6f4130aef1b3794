"""`make determinism`: one digest in all configurations, or which of them differs and where.

Prints the tables; with --write they also go into docs/determinism.md; with --quick the emulated machine replays
only the shortest recording. Exit 0: all the same, 1: not.
"""

import sys

from tests.matrix.aarch64 import emulated
from tests.matrix.configurations import HOME, ROOT, at_hand, others
from tests.matrix.probe import explored
from tests.matrix.table import outcomes, page

PAGE = ROOT / "docs" / "determinism.md"
BEGIN, END = "<!-- matrix: written by make determinism -->", "<!-- end of matrix -->"


def main(arguments: list[str]) -> int:
    """Run the matrix over the recordings in recordings/ and an exploration made for it."""
    recordings = sorted((ROOT / "recordings").glob("*.mcap"))
    paths = [str(path) for path in recordings if ".run." not in path.name]
    shortest = [str(min(recordings, key=lambda path: path.stat().st_size))] if recordings else []
    exploration = HOME / "exploration.mcap"
    exploration.unlink(missing_ok=True)
    explored(exploration)
    paths, shortest = [str(exploration), *paths], [str(exploration), *shortest]
    found = []
    slow = ["--short", *shortest] if "--quick" in arguments else paths
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
