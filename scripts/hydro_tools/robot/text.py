"""Numbers and attributes as text, the same on every machine."""

from collections.abc import Iterable
from xml.sax.saxutils import quoteattr


def number(value: float) -> str:
    """Shortest of 12 significant digits; never `-0`."""
    text = f"{value:.12g}"
    return "0" if text == "-0" else text


def vector(values: Iterable[float]) -> str:
    """Numbers separated by blanks."""
    return " ".join(number(value) for value in values)


def element(name: str, /, *, close: bool = True, **attributes: object) -> str:
    """`<name a="1"/>`; numbers and sequences of numbers are written by `number` and `vector`.

    A trailing underscore in an attribute's name is dropped (`class_`).
    """
    parts = [name]
    for key, value in attributes.items():
        if isinstance(value, (int, float)):
            value = number(value)
        elif not isinstance(value, str):
            value = vector(value)
        parts.append(f"{key.rstrip('_')}={quoteattr(value)}")
    return f"<{' '.join(parts)}{'/' if close else ''}>"
