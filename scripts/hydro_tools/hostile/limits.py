"""What a case may take."""

import resource
import signal
from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """Address space [byte] and processor time [s] of a case."""

    memory: int
    seconds: float

    def set(self) -> None:
        """Hold this process to the memory, and let SIGINT end it."""
        resource.setrlimit(resource.RLIMIT_AS, (self.memory, self.memory))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        # A campaign in the background of a shell ignores SIGINT, and its children would inherit that.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
