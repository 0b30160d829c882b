"""Implementations run in turn, block by block, so that a busy machine slows them alike: A B C A B C ..."""

from collections.abc import Callable
from dataclasses import dataclass, field
from statistics import median

import numpy as np

from . import BenchmarkError
from .worker import Worker

#: Blocks at the start that warm caches, clocks and allocators, and are thrown away.
WARM_UP = 1


@dataclass
class Entry:
    """One implementation of a group: its process, its task, how long its blocks are."""

    name: str
    command: list[str]
    task: dict
    #: Units of work in a block.
    count: int
    threads: int = 1
    #: Rounds that it takes part in, for those that would take all day; all without a number.
    rounds: int | None = None
    #: Largest relative difference of its `check` from the group's first, or from `expected`; None: not compared.
    tolerance: float | None = 1e-4


@dataclass
class Outcome:
    """Result of an implementation: seconds a unit by round, and its answers to the other requests."""

    name: str
    seconds: list[float] = field(default_factory=list)
    #: Of all cores, a unit, by round; in ticks of a hundredth of a second a block.
    core_seconds: list[float] = field(default_factory=list)
    #: Numbers of its check.
    check: list[float] = field(default_factory=list)
    #: Largest difference from the expected numbers, relative to their largest.
    difference: float | None = None
    #: Numbers that the blocks gave, in order.
    values: list[float] = field(default_factory=list)
    #: Other numbers of a block, a list each.
    notes: dict[str, list[float]] = field(default_factory=dict)
    idle_bytes: int = 0
    peak_bytes: int = 0


def difference(found: list[float], expected: list[float]) -> float:
    """Largest difference, relative to the largest expected number; infinite where the lengths differ."""
    if len(found) != len(expected) or not expected:
        return float("inf")
    found, expected = np.asarray(found), np.asarray(expected)
    return float(np.abs(found - expected).max() / (np.abs(expected).max() or 1.0))


def elementwise(found: list[float], expected: list[float]) -> float:
    """Largest difference, each relative to its own number: where the numbers are of different kinds."""
    if len(found) != len(expected) or not expected:
        return float("inf")
    found, expected = np.asarray(found), np.asarray(expected)
    return float((np.abs(found - expected) / np.abs(expected)).max())


def run(
    entries: list[Entry],
    rounds: int,
    *,
    expected: list[float] | None = None,
    warm_up: int = WARM_UP,
    compare: Callable[[list[float], list[float]], float] = difference,
    say: Callable[[str], None] = print,
) -> list[dict]:
    """Prepares all, checks that they agree, runs `rounds` rounds of blocks; an `Outcome` each, as a dictionary.

    expected: what each computes; the first implementation's own numbers without it. With `warm_up=0` nothing is
    thrown away, as for training, where every block moves on.
    """
    workers, outcomes = [], []
    try:
        for entry in entries:
            worker = Worker(entry.command, threads=entry.threads)
            workers.append(worker)
            idle = worker.ask(do="peak")["bytes"]
            found = worker.ask(do="prepare", task=entry.task)["values"]
            if expected is None:
                expected = found
            apart = compare(found, expected) if entry.tolerance is not None else None
            if apart is not None and not apart <= entry.tolerance:
                raise BenchmarkError(
                    f"{entry.name} computes something else: {apart:.2g} apart, {entry.tolerance:g} allowed; "
                    f"{found[:6]} against {expected[:6]}"
                )
            outcomes.append(Outcome(entry.name, check=found, difference=apart, idle_bytes=idle))
        for turn in range(warm_up + rounds):
            for entry, worker, outcome in zip(entries, workers, outcomes):
                if entry.rounds is not None and turn >= warm_up + entry.rounds:
                    continue
                before = worker.core_seconds()
                answer = worker.ask(do="block", count=entry.count)
                if turn < warm_up:
                    continue
                outcome.core_seconds.append((worker.core_seconds() - before) / entry.count)
                outcome.seconds.append(answer.pop("seconds") / entry.count)
                outcome.values += answer.pop("values")
                for name, value in answer.items():
                    outcome.notes.setdefault(name, []).append(value)
        for worker, outcome in zip(workers, outcomes):
            outcome.peak_bytes = worker.ask(do="peak")["bytes"]
    finally:
        for worker in workers:
            worker.close()
    for outcome in outcomes:
        middle = 1e6 * median(outcome.seconds) if outcome.seconds else float("nan")
        say(f"  {outcome.name:44} {middle:12.2f} us   peak {outcome.peak_bytes / 2**20:6.0f} MiB")
    return [vars(outcome) for outcome in outcomes]
