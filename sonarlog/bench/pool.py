"""Many jobs at once, in processes of their own; a job that takes its process down is an outcome, not the end.

Must not know: what the jobs are.
"""

import multiprocessing
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from functools import partial
from multiprocessing.process import BaseProcess
from typing import TypeVar

PATIENCE_S, ASKED = 1.0, 4
Task = TypeVar("Task")
Result = TypeVar("Result")


def run(
    call: Callable[[Task], Result], tasks: Sequence[Task], processes: int
) -> Iterator[tuple[Task, Result | Exception]]:
    """Call with each task, in order of completion; what a call raised is its result.

    With one process all is done in this one. Whoever stops iterating stops the work.
    """
    if processes == 1:
        for task in tasks:
            yield task, _tried(partial(call, task))
        return
    # Spawned, not forked: a fork of a process with threads may hang.
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(min(processes, len(tasks) or 1), context, initializer=_take_signals)
    try:
        waiting: dict[Future[Result], Task] = {pool.submit(call, task): task for task in tasks}
        for future in as_completed(waiting):
            yield waiting[future], _tried(future.result)
    finally:
        children = list(multiprocessing.active_children())
        pool.shutdown(wait=False, cancel_futures=True)
        if any(not future.done() for future in waiting):
            _end(children)
        pool.shutdown(wait=True)


def _tried(call: Callable[[], Result]) -> Result | Exception:
    try:
        return call()
    except Exception as error:
        return error


def _end(children: Sequence[BaseProcess]) -> None:
    """Ask until they are gone: one that is asked tidies up, and may then find another task waiting for it."""
    for _ in range(ASKED):
        for child in children:
            child.terminate()
        for child in children:
            child.join(PATIENCE_S)
    for child in children:
        child.kill()


def _take_signals() -> None:
    """Ctrl-C is the parent's; being ended is a way out that leaves no temporary files."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda _number, _frame: sys.exit(1))
