"""Fields of messages by path: `twist.linear.x`, `data[3]`, `position[left_hip]` (the element of that `name`)."""

import dataclasses
import functools
import numbers
import operator
import re
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from ...errors import DataError
from .base import NUMBER, TEXT, TIME, nanoseconds

#: Elements of an array of numbers, and of an array of messages, that a listing shows at most.
SHOWN_NUMBERS, SHOWN_MESSAGES = 36, 8
_STEP = re.compile(r"([^.\[\]]+)|\[([^\]]+)\]")
_PLAIN = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*")

#: What reading an absent field raises.
ABSENT = (AttributeError, KeyError, IndexError, TypeError, ValueError)


def getter(path: str) -> Callable[[object], object]:
    """A function from a message to the field at `path`; it raises one of ABSENT where there is none."""
    steps = list(_STEP.finditer(path))
    if not steps or "".join(step.group() for step in steps) != path.replace(".", ""):
        raise DataError(f"field `{path}`: expected a path such as `twist.linear.x`, `data[3]` or `position[left_hip]`")
    if len(steps) == 1 and steps[0][1]:
        return lambda message: _part(message, path)
    attributes = operator.attrgetter(path) if _PLAIN.fullmatch(path) else None
    chosen = [_step(step) for step in steps]

    def get(message: object) -> object:
        if attributes is not None and not isinstance(message, dict):
            return attributes(message)
        return functools.reduce(lambda value, step: step(value), chosen, _Within(None, message)).value

    return get


@dataclasses.dataclass(frozen=True)
class _Within:
    """A value, and the message that it is part of."""

    message: Any
    value: Any


def _step(step: re.Match[str]) -> Callable[[_Within], _Within]:
    name, index = step.groups()
    if name is not None:
        return lambda at: _Within(at.value, _part(at.value, name))
    if index.lstrip("-").isdigit():
        return lambda at: _Within(at.value, at.value[int(index)])
    return lambda at: _Within(at.value, at.value[list(_part(at.message, "name")).index(index)])


def _part(value: Any, name: str) -> Any:
    return value[name] if isinstance(value, dict) else getattr(value, name)


def kinds(message: object) -> dict[str, str]:
    """Kind of every field of a message by its path; long arrays are cut."""
    return dict(_walk(message, ""))


def _walk(value: object, path: str) -> Iterator[tuple[str, str]]:
    if isinstance(value, str):
        yield path, TEXT
    elif isinstance(value, numbers.Number | np.generic):
        yield path, NUMBER
    elif path and nanoseconds(value) is not None:
        yield path, TIME
    elif isinstance(value, bytes | bytearray | memoryview):
        return
    elif (parts := _parts(value)) is not None:
        for name, part in parts:
            yield from _walk(part, f"{path}.{name}" if path else name)
    elif hasattr(value, "__len__") and hasattr(value, "__getitem__"):
        most = SHOWN_NUMBERS if len(value) and isinstance(value[0], numbers.Number | np.generic) else SHOWN_MESSAGES
        for index in range(min(len(value), most)):
            yield from _walk(value[index], f"{path}[{index}]")


def _parts(value: object) -> list[tuple[str, object]] | None:
    """Names and values of a message's fields; None where it is no message."""
    if isinstance(value, dict):
        return list(value.items())
    if dataclasses.is_dataclass(value):
        names = [field.name for field in dataclasses.fields(value)]
    elif hasattr(value, "DESCRIPTOR"):
        names = [field.name for field in value.DESCRIPTOR.fields]
    elif hasattr(value, "__slots__"):
        names = list(value.__slots__)
    else:
        return None
    return [(name, getattr(value, name)) for name in names if not name.startswith("_")]
