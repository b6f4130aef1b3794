"""Bisection: which of many revisions is the first bad one, where some cannot be tried at all.

Must not know: git, what makes a revision bad.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from sonarlog.errors import SonarlogError

Judge = Callable[[str], bool | None]
"""Whether a revision is bad; None for one that cannot be tried."""


class NothingToFind(SonarlogError):
    """The last revision is not bad, or none is there to be tried."""


@dataclass(frozen=True)
class Found:
    """The last revision known to be good, the first known to be bad, and those between that could not be tried."""

    good: str
    bad: str
    between: tuple[str, ...]
    tried: int


def bisect(good: str, revisions: Sequence[str], judge: Judge) -> Found:
    """The first bad one of the revisions, oldest first, that come after a good one.

    Taken to be good up to somewhere and bad from there on; a revision that cannot be tried makes way for its
    neighbours. Raises NothingToFind if the last one that can be tried is not bad.
    """
    known: dict[int, bool | None] = {-1: False}

    def bad(k: int) -> bool | None:
        if k not in known:
            known[k] = judge(revisions[k])
        return known[k]

    last = next((k for k in range(len(revisions) - 1, -1, -1) if bad(k) is not None), -1)
    if last < 0:
        raise NothingToFind("no revision after the good one changes the code and runs: there is nothing to search")
    if not bad(last):
        raise NothingToFind(f"revision {revisions[last][:12]} is not bad: there is nothing to search for")
    low, high = -1, last
    while True:
        # The nearest to the middle that can be tried.
        middle = (low + high) / 2
        order = sorted(range(low + 1, high), key=lambda k: (abs(k - middle), k))
        k = next((k for k in order if bad(k) is not None), None)
        if k is None:
            break
        low, high = (low, k) if bad(k) else (k, high)
    names = [good, *revisions]
    return Found(names[low + 1], revisions[high], tuple(revisions[low + 1 : high]), len(known) - 1)
