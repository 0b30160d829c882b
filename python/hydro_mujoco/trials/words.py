"""Names and numbers in messages."""

import difflib
from collections.abc import Iterable

#: Names that a message lists at most, and characters of a text of others that it repeats.
LISTED, REPEATED = 24, 80


def cut(text: object) -> str:
    """A text of others in a message: on one line, and not all of a long one."""
    line = " ".join(str(text).split())
    return line if len(line) <= REPEATED else f"{line[:REPEATED]}... ({len(line)} characters)"


def listed(names: Iterable[str]) -> str:
    """Names in a message; "none" where there are none."""
    names = list(names)
    shown = ", ".join(f"`{name}`" for name in names[:LISTED])
    return shown + (f", ... ({len(names)} in all)" if len(names) > LISTED else "") if names else "none"


def nearest(name: str, names: Iterable[str]) -> str:
    """A question after the most similar name, with a leading space; empty where none is similar."""
    close = difflib.get_close_matches(name, list(names), n=1, cutoff=0.6)
    return f" (is `{close[0]}` meant?)" if close else ""


def seconds(value: float) -> str:
    """A time in words."""
    return f"{value:.6g} s" if abs(value) >= 1e-3 else f"{value * 1e6:.4g} us"


def counted(number: int, noun: str) -> str:
    """`1 sample`, `2 samples`."""
    return f"{number} {noun}{'' if number == 1 else 's'}"
