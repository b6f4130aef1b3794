"""Many jobs at once, in processes of their own; a job that takes its process down is an outcome, not the end.

Must not know: what the jobs are.
"""

import multiprocessing
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from functools import partial
from typing import TypeVar

Task = TypeVar("Task")
Result = TypeVar("Result")


def run(
    call: Callable[[Task], Result], tasks: Sequence[Task], processes: int, failed: Callable[[Exception], Result]
) -> Iterator[tuple[Task, Result]]:
    """Call with each task, in order of completion; `failed` makes a result of what a call raised.

    With one process all is done in this one. Whoever stops iterating stops the work.
    """
    if processes == 1:
        for task in tasks:
            yield task, _tried(partial(call, task), failed)
        return
    # Spawned, not forked: a fork of a process with threads may hang.
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(min(processes, len(tasks) or 1), context, initializer=_leave_interrupts_to_the_parent)
    try:
        waiting: dict[Future[Result], Task] = {pool.submit(call, task): task for task in tasks}
        for future in as_completed(waiting):
            yield waiting[future], _tried(future.result, failed)
    finally:
        children = list(multiprocessing.active_children())
        pool.shutdown(wait=False, cancel_futures=True)
        if any(not future.done() for future in waiting):
            for child in children:
                child.terminate()
        pool.shutdown(wait=True)


def _tried(call: Callable[[], Result], failed: Callable[[Exception], Result]) -> Result:
    try:
        return call()
    except Exception as error:
        return failed(error)


def _leave_interrupts_to_the_parent() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
