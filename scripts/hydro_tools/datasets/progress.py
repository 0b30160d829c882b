"""Progress of long work on stderr: a bar on a terminal, a plain line now and then in a log."""

import sys
import time

#: Width of the bar [characters]; seconds between lines in a log.
WIDTH, LOG_EVERY = 30, 10.0


class Progress:
    """Counts `total` units named `unit`; `advance` may be called from the main thread only."""

    def __init__(self, total: int, unit: str, *, done: int = 0, stream=sys.stderr):
        self.total, self.unit, self.done, self.stream = total, unit, done, stream
        self._resumed, self._start, self._last_line = done, time.monotonic(), -LOG_EVERY

    def advance(self, units: int = 1) -> None:
        """Count `units` more and show it."""
        self.done += units
        elapsed = time.monotonic() - self._start
        rate = (self.done - self._resumed) / max(elapsed, 1e-9)
        left = (self.total - self.done) / max(rate, 1e-9)
        text = f"{self.done}/{self.total} {self.unit}, {elapsed:.0f} s, {left:.0f} s left"
        if self.stream.isatty():
            filled = WIDTH * self.done // max(self.total, 1)
            self.stream.write(f"\r[{'#' * filled}{'.' * (WIDTH - filled)}] {text}\033[K")
            if self.done >= self.total:
                self.stream.write("\n")
        elif elapsed - self._last_line >= LOG_EVERY or self.done >= self.total:
            self._last_line = elapsed
            self.stream.write(text + "\n")
        self.stream.flush()
