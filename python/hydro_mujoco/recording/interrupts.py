"""Ctrl-C: held back while files are renamed, said in a line, and soon at its end."""

import gc
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def held_back() -> Iterator[None]:
    """Let a Ctrl-C that comes meanwhile count only afterwards. For moments; in another thread than the main one it has
    no effect, for Python takes interrupts in the main one.
    """
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or before is None:
        yield
        return
    came: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _: came.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if came:
        signal.raise_signal(signal.SIGINT)


def ended() -> int:
    """Exit status of a command that Ctrl-C stops, whose objects Python then does not go through once more.

    With MuJoCo and pandas imported that takes most of a second on a machine at work.
    """
    gc.freeze()
    return 130


@contextmanager
def saying(what: str) -> Iterator[None]:
    """Add a line to the KeyboardInterrupt that leaves: what was stopped, and what is left of it."""
    try:
        yield
    except KeyboardInterrupt as stop:
        stop.add_note(what)
        raise
