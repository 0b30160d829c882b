"""Progress of long work on stderr: a bar on a terminal and in a notebook, a plain line now and then in a log."""

import sys
import time
from typing import TextIO

from tqdm.auto import tqdm

#: Seconds between lines in a log.
LOG_EVERY = 10.0


def has_bars(stream: TextIO) -> bool:
    """True on a terminal and in a notebook."""
    return stream.isatty() or any(base.__module__ == "tqdm.notebook" for base in tqdm.__mro__)


class Progress:
    """Counts `total` units named `unit`; `advance` may be called from the main thread only."""

    def __init__(self, total: int, unit: str, *, done: int = 0, stream: TextIO | None = None):
        stream = stream or sys.stderr
        self.total, self.unit, self.done, self.stream = total, unit, done, stream
        self._resumed, self._start, self._last_line = done, time.monotonic(), -LOG_EVERY
        self._bar = None
        if done:
            stream.write(f"going on after {done} of {total} {unit}\n")
        if has_bars(stream):
            self._bar = tqdm(total=total, initial=done, unit=f" {unit}", file=stream, dynamic_ncols=True)

    def advance(self, units: int = 1) -> None:
        """Count `units` more and show it."""
        self.done += units
        if self._bar is not None:
            self._bar.update(units)
            if self.done >= self.total:
                self._bar.close()
            return
        elapsed = time.monotonic() - self._start
        if elapsed - self._last_line < LOG_EVERY and self.done < self.total:
            return
        self._last_line = elapsed
        rate = (self.done - self._resumed) / max(elapsed, 1e-9)
        left = (self.total - self.done) / max(rate, 1e-9)
        self.stream.write(f"{self.done}/{self.total} {self.unit}, {elapsed:.0f} s, {left:.0f} s left\n")
        self.stream.flush()
