"""Values of a mapping file by key, each checked."""

import math
from collections.abc import Iterable
from collections.abc import Mapping as Dict
from typing import Any

from ...errors import DataError
from ..words import listed, nearest


def known(content: Dict[str, Any], keys: Iterable[str], where: str) -> None:
    """Refuse a key that is none of `keys`."""
    keys = list(keys)
    for key in content:
        if key not in keys:
            raise DataError(f"{where}: key `{key}` is not known{nearest(key, keys)}; there are {listed(keys)}")


def table(content: Dict[str, Any], key: str, where: str) -> Dict[str, Any]:
    """A table; empty where there is none."""
    value = content.get(key, {})
    if not isinstance(value, Dict):
        raise DataError(f"{where}: {key} is {value!r}; expected a table [{key}]")
    return value


def text(content: Dict[str, Any], key: str, where: str, usual: str | None = None) -> str:
    """A text; `usual` where there is none, and without it a refusal."""
    value = content.get(key, usual)
    if not isinstance(value, str) or not value:
        raise DataError(f"{where}: {key} is {'missing' if value is None else repr(value)}; expected a text")
    return value


def flag(content: Dict[str, Any], key: str, where: str, usual: bool) -> bool:
    """true or false."""
    value = content.get(key, usual)
    if not isinstance(value, bool):
        raise DataError(f"{where}: {key} is {value!r}; expected true or false")
    return value


def number(content: Dict[str, Any], key: str, where: str, usual: float) -> float:
    """A finite number; `usual` where there is none."""
    value = content.get(key, usual)
    if not _is_number(value):
        raise DataError(f"{where}: {key} is {value!r}; expected a number")
    return float(value)


def positive(content: Dict[str, Any], key: str, where: str) -> float | None:
    """A number above zero; None where there is none."""
    if key not in content:
        return None
    value = number(content, key, where, 0.0)
    if value <= 0:
        raise DataError(f"{where}: {key} is {value:g}; expected a number above 0")
    return value


def numbers(content: Dict[str, Any], key: str, where: str) -> tuple[float, ...]:
    """A list of numbers, or one."""
    value = content[key]
    values = value if isinstance(value, list) else [value]
    if not values or not all(_is_number(each) for each in values):
        raise DataError(f"{where}: {key} is {value!r}; expected a number or a list of numbers")
    return tuple(float(each) for each in values)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
