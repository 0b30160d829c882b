"""The base of every executor: it hands out jobs as places become free and yields results as they come.

Jobs begin only while fewer than `window()` results are under way or waiting to be taken, so memory does not grow
with the number of jobs, however slow their receiver is.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Hashable, Mapping
from itertools import islice
from typing import Any, Self

from . import JobError

Work = Callable[[Any], bytes]


class Executor(ABC):
    """A place where jobs run: `with Kind(...) as executor`. Users call `run`; a kind implements the rest."""

    #: Whether jobs may run on other machines, whose files, packages and processors differ.
    other_machines = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def run(self, work: Work, jobs: Mapping[str, Any]) -> Generator[tuple[str, bytes], None, None]:
        """Yield (name, result) of every job, in any order; JobError names the first that fails.

        Close the iterator (`contextlib.closing`) to stop early: jobs under way are dropped.
        """
        waiting = iter(jobs.items())
        running: dict[Hashable, str] = {}
        self.start(work)
        try:
            while True:
                for name, job in islice(waiting, max(0, self.window() - len(running))):
                    running[self.submit(name, job)] = name
                if not running:
                    return
                handle = self.first(running)
                name = running.pop(handle)
                try:
                    result = self.result(handle)
                except JobError as error:
                    raise JobError(f"{name}: {error}") from error
                except Exception as error:
                    raise JobError(f"{name}: {type(error).__name__}: {error}") from error
                # A handle may keep its result alive where it was made.
                del handle
                yield name, result
        finally:
            self.stop(running)

    @abstractmethod
    def start(self, work: Work) -> None:
        """Make workers ready to do `work`."""

    @abstractmethod
    def window(self) -> int:
        """Jobs that may be under way now."""

    @abstractmethod
    def submit(self, name: str, job: Any) -> Hashable:
        """Begin a job; returns a handle."""

    @abstractmethod
    def first(self, running: Mapping[Hashable, str]) -> Hashable:
        """Wait until one of these handles is done, well or badly; returns it."""

    @abstractmethod
    def result(self, handle: Hashable) -> bytes:
        """The result of a handle that is done, or the error of its job."""

    @abstractmethod
    def stop(self, running: Mapping[Hashable, str]) -> None:
        """Drop the jobs that are still under way and the work."""

    def close(self) -> None:  # noqa: B027 - most kinds hold nothing
        """Let go of what the executor holds between runs."""

    @property
    @abstractmethod
    def description(self) -> str:
        """The workers that did the jobs, for a summary."""
