"""The scribe: a thread that writes the recording, so that no disk ever delays the port.

What it is given it does in order, and about once a second it flushes with fsync. Must not know: the line, the robot.
"""

import time
from collections.abc import Callable
from queue import Empty, SimpleQueue
from threading import Event, Thread
from typing import ParamSpec

from sonarlog.errors import SonarlogError
from sonarlog.recording import RecordingWriter

SECOND = 1_000_000_000
FLUSH_EVERY_NS = 900_000_000  # with the flush itself under a second
HUNG_NS = 30 * SECOND
"""So long behind, the recording is given up."""

WAITING = 100_000  # calls in the queue: a quarter of an hour of an AmigoBot, some 20 MB
BACKLOG = 2_000  # where the robot's time can wait for the disk
P = ParamSpec("P")


class WriterHangs(SonarlogError):
    """The disk takes nothing any more."""

    def __init__(self, behind_s: float) -> None:
        super().__init__(
            f"the disk has taken nothing for {behind_s:.0f} s: the robot is stopped and the recording ends; "
            "look at the disk, or record to another one"
        )


class Scribe:
    """Does the calls it is given in a thread of its own, in order.

    `wall_ns`: a monotonic clock. `waits`: the robot's time stands still while nobody reads, so that `do` may wait for
    the disk; else `do` never waits. What a call raises, every later `do` and `close` raise again.
    """

    def __init__(self, writer: RecordingWriter, wall_ns: Callable[[], int], *, waits: bool) -> None:
        self._writer = writer
        self._wall_ns = wall_ns
        self._waits = waits
        self._calls: SimpleQueue[tuple[int, Callable[[], object]] | None] = SimpleQueue()
        self._working_on_ns: int | None = None  # when what is being done now was asked for
        self._failed: BaseException | None = None
        self._done = Event()
        self._thread = Thread(target=self._work, name="scribe", daemon=True)
        self._thread.start()

    def do(self, call: Callable[P, object], *args: P.args, **kwargs: P.kwargs) -> None:
        """Have it done soon. Raises what an earlier call raised, and WriterHangs where too many are waiting."""
        self._raise_failure()
        if self._calls.qsize() >= (BACKLOG if self._waits else WAITING):
            if not self._waits:
                raise WriterHangs(self.behind_ns() / SECOND)
            while self._calls.qsize() > BACKLOG // 2 and self._failed is None:
                time.sleep(0.001)
        self._calls.put((self._wall_ns(), lambda: call(*args, **kwargs)))

    def behind_ns(self) -> int:
        """How long what is being written now has been waiting for it; 0 where that does not matter."""
        since_ns = self._working_on_ns
        return 0 if since_ns is None or self._waits else max(0, self._wall_ns() - since_ns)

    def close(self) -> None:
        """Do what is waiting, flush, and end. Raises what a call raised, WriterHangs. Idempotent."""
        if self._thread.is_alive():
            self._calls.put(None)
            if not self._done.wait(HUNG_NS / SECOND):
                raise WriterHangs(HUNG_NS / SECOND)
            self._thread.join()
        self._raise_failure()

    def _raise_failure(self) -> None:
        if self._failed is not None:
            raise self._failed

    def _work(self) -> None:
        try:
            self._write_all()
        except BaseException as error:  # whatever it is, the recorder's thread has to hear of it
            self._failed = error
        finally:
            self._working_on_ns = None
            self._done.set()

    def _write_all(self) -> None:
        dirty, due_ns = False, self._wall_ns()  # the first flush brings schemas and channels to the disk at once
        while True:
            try:
                job = self._calls.get(timeout=max(0.0, (due_ns - self._wall_ns()) / SECOND) if dirty else None)
            except Empty:
                job = (self._wall_ns(), _nothing)
            if job is not None:
                self._working_on_ns, call = job
                call()
                dirty = dirty or call is not _nothing
            if job is None or (dirty and self._wall_ns() >= due_ns):
                due_ns = self._wall_ns() + FLUSH_EVERY_NS
                self._writer.flush(fsync=True)
                dirty = False
            self._working_on_ns = None
            if job is None:
                return


def _nothing() -> None:
    """Only the time for a flush has come."""
