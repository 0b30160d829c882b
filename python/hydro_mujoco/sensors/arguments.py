"""Arguments of sensors, checked."""

import numpy as np

from ..errors import DataError


def real(value: float) -> float:
    """The value as a number; not a number where it is none."""
    try:
        return float(value)
    except (TypeError, ValueError):
        return np.nan


def at_least(name: str, value: float, least: float, unit: str = "") -> float:
    """The value, a finite number not below `least`.

    Raises:
        DataError: it is not.
    """
    found = real(value)
    if not np.isfinite(found) or found < least:
        raise DataError(f"{name} is {value}{unit}; expected at least {least:g}{unit}")
    return found


def whole(name: str, value: int, least: int) -> int:
    """The value, a whole number not below `least`.

    Raises:
        DataError: it is not.
    """
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise DataError(f"{name} is {value}; expected a whole number, at least {least}")
    return int(value)


def numbers(name: str, values: tuple[float, ...] | np.ndarray, size: int) -> tuple[float, ...]:
    """The values, `size` numbers.

    Raises:
        DataError: they are not.
    """
    try:
        found = tuple(float(value) for value in values)
    except (TypeError, ValueError):
        found = ()
    if len(found) != size:
        raise DataError(f"{name} is {values!r}; expected {size} numbers")
    return found


def span(name: str, values: tuple[float, float], unit: str) -> tuple[float, float]:
    """Two finite numbers, the first at least 0, the second greater.

    Raises:
        DataError: they are not.
    """
    least, most = numbers(name, values, 2)
    if not 0 <= least < most < np.inf:
        raise DataError(f"{name} is {least:g} to {most:g}{unit}; expected 0 <= least < most")
    return least, most
