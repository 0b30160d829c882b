"""Jobs in worker processes of this machine."""

import multiprocessing
import os
import threading
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import connection

from . import JobError
from .executor import Executor

#: Jobs under way for each worker: one that it does, one that it finds when it is done.
AHEAD = 2


class Processes(Executor):
    """`workers` processes, started afresh (`spawn`): no thread or handle of this process leaks into them."""

    def __init__(self, workers: int):
        self.workers = workers

    @property
    def description(self) -> str:
        return f"{self.workers} workers"

    def start(self, work):
        self._pool = ProcessPoolExecutor(
            self.workers, mp_context=multiprocessing.get_context("spawn"), initializer=_begin, initargs=(work,)
        )

    def window(self):
        return AHEAD * self.workers

    def submit(self, name, job):
        try:
            return self._pool.submit(_do, job)
        except BrokenProcessPool as error:
            raise JobError(f"{name}: a worker process was killed") from error

    def first(self, running):
        return next(iter(wait(running, return_when=FIRST_COMPLETED).done))

    def result(self, handle):
        try:
            return handle.result()
        except BrokenProcessPool as error:
            raise JobError("a worker process was killed") from error

    def stop(self, running):
        self._pool.shutdown(wait=True, cancel_futures=True)


_WORK = None


def _begin(work) -> None:
    """Keep the work once a process; die with the parent, however it dies."""
    global _WORK
    _WORK = work
    parent = multiprocessing.parent_process()

    def follow() -> None:
        connection.wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


def _do(job) -> bytes:
    return _WORK(job)
