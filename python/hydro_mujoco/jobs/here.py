"""Jobs in this process, one after the other: the reference for every other executor."""

from collections.abc import Callable

from .executor import Executor


class Here(Executor):
    """Does a job when its result is asked for."""

    description = "1 worker"

    def start(self, work):
        self._work = work

    def window(self):
        return 1

    def submit(self, name, job):
        return _Deferred(lambda: self._work(job))

    def first(self, running):
        return next(iter(running))

    def result(self, handle):
        return handle.call()

    def stop(self, running):
        self._work = None


class _Deferred:
    """A call that waits to be made."""

    def __init__(self, call: Callable[[], bytes]):
        self.call = call
