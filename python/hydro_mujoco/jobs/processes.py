"""Jobs in worker processes of this machine."""

import gc
import multiprocessing
import os
import signal
import threading
from collections.abc import Hashable, Mapping
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import connection
from typing import Any

from . import JobError
from .executor import Executor, Work

#: Jobs under way for each worker: one that it does, one that it finds when it is done.
AHEAD = 2
#: What is said of a job whose worker is gone; those beside it are lost with it.
KILLED = (
    "a worker process was killed, at this job or at one beside it. The system kills one where memory is full: `dmesg` "
    "tells, and fewer workers need less"
)


class Processes(Executor):
    """`workers` processes, started afresh (`spawn`): no thread or handle of this process leaks into them."""

    def __init__(self, workers: int):
        self.workers = workers

    @property
    def description(self) -> str:
        return f"{self.workers} workers"

    def start(self, work: Work) -> None:
        context = multiprocessing.get_context("spawn")
        # Workers drop their jobs when the writing end is closed.
        self._reader, self._writer = context.Pipe(duplex=False)
        self._pool = ProcessPoolExecutor(
            self.workers, mp_context=context, initializer=_begin, initargs=(work, self._reader)
        )

    def window(self) -> int:
        return AHEAD * self.workers

    def submit(self, name: str, job: Any) -> Hashable:
        # Ctrl-C on a terminal reaches every process: workers begin with it held back.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            return self._pool.submit(_do, job)
        except BrokenProcessPool as error:
            raise JobError(f"{name}: {KILLED}") from error
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def first(self, running: Mapping[Any, str]) -> Hashable:
        return next(iter(wait(running, return_when=FIRST_COMPLETED).done))

    def result(self, handle: Any) -> bytes:
        try:
            return handle.result()
        except BrokenProcessPool as error:
            raise JobError(KILLED) from error

    def stop(self, running: Mapping[Hashable, str]) -> None:
        if running:
            self._writer.close()
        self._pool.shutdown(wait=True, cancel_futures=True)
        self._reader.close()
        self._writer.close()


class _Worker:
    """What a worker process does, and whether it is to stop."""

    def __init__(self, work: Work, alive: connection.Connection):
        self._work, self._alive = work, alive
        self._is_at_work = self._is_to_stop = False
        signal.signal(signal.SIGINT, self._stop)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        threading.Thread(target=self._follow, daemon=True).start()

    def do(self, job: Any) -> bytes:
        """The result of a job."""
        if self._is_to_stop:
            raise KeyboardInterrupt
        self._is_at_work = True
        try:
            return self._work(job)
        finally:
            self._is_at_work = False

    def _stop(self, *_: object) -> None:
        # Not while a result is sent: half of one would leave the parent waiting for the rest.
        self._is_to_stop = True
        # The process ends sooner where Python does not go through all objects once more.
        gc.freeze()
        if self._is_at_work:
            raise KeyboardInterrupt

    def _follow(self) -> None:
        """Drop the job when the parent wants no more results; die with the parent, however it dies."""
        parent = multiprocessing.parent_process()
        assert parent is not None
        if parent.sentinel not in connection.wait([parent.sentinel, self._alive]):
            os.kill(os.getpid(), signal.SIGINT)
            connection.wait([parent.sentinel])
        os._exit(1)


_WORKER: _Worker | None = None


def _begin(work: Work, alive: connection.Connection) -> None:
    """Make this process a worker. alive: ends where the parent wants no more results."""
    global _WORKER
    _WORKER = _Worker(work, alive)


def _do(job: Any) -> bytes:
    assert _WORKER is not None
    return _WORKER.do(job)
