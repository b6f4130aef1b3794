"""The one base of every error that is the user's to mend.

A subclass lives beside its cause, takes facts, and builds its own sentence: what, where, what to do.
Nothing below `cli/` prints or exits; the net in `cli/main.py` turns these into one line and exit code 2.
"""

from typing import Any


class SonarlogError(Exception):
    """Something the user can mend: a bad argument, a bad file, no robot."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Between processes it goes as the sentence it is: the facts that it was built from are not asked for again."""
        return _again, (type(self), self.args, vars(self))


def _again(kind: type[SonarlogError], args: tuple[object, ...], facts: dict[str, object]) -> SonarlogError:
    error = kind.__new__(kind, *args)  # sets args
    vars(error).update(facts)
    return error
