"""Fields of messages that are not known, grouped by the ends of their names."""

import re
from collections.abc import Iterable, Iterator

from ..units import ATTITUDE, LENGTH, UNITS, VELOCITY
from .messages import Group
from .names import unit_of

#: Ends of the fields of a vector and of a quaternion.
_ENDS = (
    ("x", "y", "z", "w"),
    ("w", "x", "y", "z"),
    ("0", "1", "2", "3"),
    ("x", "y", "z"),
    ("0", "1", "2"),
)
_ANGLES = ("roll", "pitch", "yaw")
#: Ends of a vector in the world -> its frame.
_WORLD = {
    ("north", "east", "down"): "NED",
    ("east", "north", "up"): "ENU",
    ("n", "e", "d"): "NED",
    ("e", "n", "u"): "ENU",
}
#: Stems of velocities.
_VELOCITY = re.compile(r"v|vel|velocity|speed", re.IGNORECASE)
_SPLIT = re.compile(r"(.*?)[._\[ ]?(roll|pitch|yaw|north|east|down|up|\d+|[xyzwnedu])\]?", re.IGNORECASE)


def shapes(fields: Iterable[str]) -> list[Group]:
    """Single fields, and vectors of three or four by the ends of their names.

    The quantity is known of roll, pitch and yaw, and of what names north and east; units of what ends with one.
    """
    fields = list(fields)
    stems: dict[str, dict[str, str]] = {}
    for field in fields:
        if match := _SPLIT.fullmatch(unit_of(field)[0]):
            stems.setdefault(match[1], {})[match[2].lower()] = field
    found = [Group("", None, (field,), unit_of(field)[1]) for field in fields]
    for stem, parts in stems.items():
        found += _vectors(stem, parts)
    return found


def _vectors(stem: str, parts: dict[str, str]) -> Iterator[Group]:
    """The vectors whose components have one stem. parts: end -> field; a field is in one vector."""
    for ends in (_ANGLES, *_WORLD, *_ENDS):
        if not all(end in parts for end in ends):
            continue
        fields = tuple(parts.pop(end) for end in ends)
        units = {unit_of(field)[1] for field in fields}
        unit = units.pop() if len(units) == 1 else None
        if ends == _ANGLES:
            yield Group(ATTITUDE, "attitude", fields, unit)
        elif ends in _WORLD:
            measured = UNITS[unit][0] if unit else VELOCITY if _VELOCITY.fullmatch(stem.strip("_. ")) else LENGTH
            yield Group(measured, "world", fields, unit, _WORLD[ends])
        else:
            yield Group("", None, fields, unit, order="xyzw" if ends[-1] == "w" else None)
