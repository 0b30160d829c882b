"""Fields of messages that are not known, grouped by the ends of their names."""

import re
from collections.abc import Iterable

from .messages import Group

#: Ends of the fields of a vector, of an attitude as angles, and of a quaternion.
_ENDS = (
    ("x", "y", "z", "w"),
    ("w", "x", "y", "z"),
    ("0", "1", "2", "3"),
    ("x", "y", "z"),
    ("0", "1", "2"),
    ("roll", "pitch", "yaw"),
)
_SPLIT = re.compile(r"(.*?)[._\[ ]?(roll|pitch|yaw|\d+|[xyzw])\]?", re.IGNORECASE)


def shapes(fields: Iterable[str]) -> list[Group]:
    """Single fields, and vectors of three or four by the ends of their names; of no known quantity."""
    fields = list(fields)
    stems: dict[str, dict[str, str]] = {}
    for field in fields:
        if match := _SPLIT.fullmatch(field):
            stems.setdefault(match[1], {})[match[2].lower()] = field
    found = [Group("", None, (field,)) for field in fields]
    for parts in stems.values():
        for ends in _ENDS:
            if all(end in parts for end in ends):
                order = "xyzw" if ends[-1] == "w" else None
                found.append(Group("", None, tuple(parts[end] for end in ends), order=order))
                break
    return found
