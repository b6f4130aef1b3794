"""Writing exports: nothing is overwritten unasked, and what cannot be written whole leaves nothing."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TextIO

from sonarlog.errors import SonarlogError

WATCHED_LINES = 1000


class CannotExport(SonarlogError):
    """An export that cannot be made, or that would overwrite something."""


class NotExported(CannotExport):
    """A form that this file has not got."""


def check_free(paths: Sequence[Path], *, force: bool) -> None:
    """Raise CannotExport if one of the files exists and `force` is not given."""
    taken = [path for path in paths if path.exists()]
    if taken and not force:
        raise CannotExport(f"{taken[0]} exists and is not overwritten: name another file, or give --force")


def write_lines(lines: Iterable[str], target: Path | TextIO, watch: Callable[[int], None] | None = None) -> None:
    """Write a text file, or to a stream that is open already. Raises CannotExport for a file.

    `watch` hears now and then how many lines are written.
    """
    if isinstance(target, Path):
        with writing([target]), target.open("w", encoding="utf-8", newline="\n") as stream:
            stream.writelines(_ended(lines, watch))
    else:
        target.writelines(_ended(lines, watch))


def _ended(lines: Iterable[str], watch: Callable[[int], None] | None) -> Iterator[str]:
    for number, line in enumerate(lines):
        if watch and number % WATCHED_LINES == 0:
            watch(number)
        yield f"{line}\n"


@contextmanager
def writing(paths: Sequence[Path]) -> Iterator[None]:
    """If anything goes wrong in the block these files are gone. Raises CannotExport for what the disk refuses."""
    try:
        yield
    except BaseException as error:
        for path in paths:
            with suppress(OSError):
                path.unlink()
        if isinstance(error, OSError):
            raise CannotExport(f"cannot write {paths[0]}: {error.strerror or error}") from None
        raise
