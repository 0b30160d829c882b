"""Jobs in worker processes of this machine."""

import multiprocessing
import os
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


class Processes(Executor):
    """`workers` processes, started afresh (`spawn`): no thread or handle of this process leaks into them."""

    def __init__(self, workers: int):
        self.workers = workers

    @property
    def description(self) -> str:
        return f"{self.workers} workers"

    def start(self, work: Work) -> None:
        self._pool = ProcessPoolExecutor(
            self.workers, mp_context=multiprocessing.get_context("spawn"), initializer=_begin, initargs=(work,)
        )

    def window(self) -> int:
        return AHEAD * self.workers

    def submit(self, name: str, job: Any) -> Hashable:
        try:
            return self._pool.submit(_do, job)
        except BrokenProcessPool as error:
            raise JobError(f"{name}: a worker process was killed") from error

    def first(self, running: Mapping[Any, str]) -> Hashable:
        return next(iter(wait(running, return_when=FIRST_COMPLETED).done))

    def result(self, handle: Any) -> bytes:
        try:
            return handle.result()
        except BrokenProcessPool as error:
            raise JobError("a worker process was killed") from error

    def stop(self, running: Mapping[Hashable, str]) -> None:
        self._pool.shutdown(wait=True, cancel_futures=True)


_WORK: Work | None = None


def _begin(work: Work) -> None:
    """Keep the work once a process; die with the parent, however it dies."""
    global _WORK
    _WORK = work
    parent = multiprocessing.parent_process()

    assert parent is not None

    def follow() -> None:
        connection.wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


def _do(job: Any) -> bytes:
    assert _WORK is not None
    return _WORK(job)
