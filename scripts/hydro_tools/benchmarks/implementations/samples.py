"""Single evaluations over recorded inputs, one row after the other, for the implementations of `evaluate`."""

import time

import numpy as np


class OneSample:
    """Subclasses say how a row is evaluated (`evaluate`) and how a past is begun (`restart`)."""

    def __init__(self, rows: list, evict: int = 0):
        """rows: inputs as the library takes them; evict: numbers read between evaluations, to empty the caches."""
        self.rows, self.next = rows, 0
        self.evicted = np.ones(evict, np.float32)

    def restart(self) -> None:
        """Forgets the past."""

    def evaluate(self, row):
        """One row."""
        raise NotImplementedError

    def block(self, count: int) -> dict:
        rows, evaluate, at, total = self.rows, self.evaluate, self.next, len(self.rows)
        if self.evicted.size:
            seconds = 0.0
            for _ in range(count):
                self.evicted.sum()
                begin = time.perf_counter()
                evaluate(rows[at])
                seconds += time.perf_counter() - begin
                at = (at + 1) % total
        else:
            begin = time.perf_counter()
            for _ in range(count):
                evaluate(rows[at])
                at = (at + 1) % total
            seconds = time.perf_counter() - begin
        self.next = at
        return {"seconds": seconds}
