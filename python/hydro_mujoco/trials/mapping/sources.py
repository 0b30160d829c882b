"""One source of a mapping file, checked against what it is for."""

from collections.abc import Mapping as Dict
from dataclasses import dataclass
from typing import Any

from ...errors import DataError
from .. import frames
from ..log.table import TOPIC
from ..units import ANGLE, ATTITUDE, LENGTH, PRESSURE, PULSE, RATIO, quantity, units_of
from .schema import Source
from .values import flag, known, number, numbers, text

SOURCE_KEYS = (
    *(
        "topic",
        "fields",
        "field",
        "unit",
        "frame",
        "order",
        "direction",
        "scale",
        "offset",
        "table",
        "pulse",
        "constant",
    ),
    *("clock", "delay", "filter", "attitude"),
)
#: Units of latitude, longitude and height.
GEODETIC_UNITS = ("deg", "deg", "m")
#: Widths of a servo's pulse at -1, 0 and 1 [us], as ArduSub has them.
USUAL_PULSE = (1100.0, 1500.0, 1900.0)


@dataclass(frozen=True)
class Target:
    """What numbers are for. quantity: None for any; frame: `world`, `body`, `any` of them, `attitude`, or None.

    turns: a frame of the other kind is turned by an attitude.
    """

    dim: int
    quantity: str | None
    frame: str | None
    may_be_constant: bool = False
    turns: bool = False


def source(content: Any, where: str, target: Target) -> Source:
    """A source from its table."""
    if not isinstance(content, Dict):
        raise DataError(f"{where}: {content!r} found; expected a table with topic and fields")
    known(content, SOURCE_KEYS, where)
    if "constant" in content:
        if not target.may_be_constant:
            raise DataError(f"{where}: constant is for actuators alone; give topic and fields")
        return Source(where, constant=number(content, "constant", where, 0.0))
    fields = _fields(content, where, target)
    frame = _frame(content, where, target, fields)
    if "attitude" in content and not target.turns:
        raise DataError(f"{where}: attitude given, which turns velocities alone")
    units = _units(content, where, target, len(fields), frame)
    if frame == "NED" and any(unit and quantity(unit, where) == PRESSURE for unit in units):
        raise DataError(f"{where}: frame `NED` given; a pressure becomes a height, which is up: leave frame out")
    order, inverse = _quaternion(content, where, target, len(fields))
    table, pulse = _table(content, where), _pulse(content, where, units)
    if table and (pulse or "unit" in content):
        raise DataError(f"{where}: table and {'pulse' if pulse else 'unit'} both given; a table takes raw values")
    return Source(
        where,
        target.quantity,
        text(content, "topic", where, TOPIC),
        fields,
        units,
        frame,
        order,
        inverse,
        _per_field(content, "scale", where, len(fields), 1.0),
        _per_field(content, "offset", where, len(fields), 0.0),
        table,
        pulse,
        None,
        text(content, "clock", where) if "clock" in content else None,
        number(content, "delay", where, 0.0),
        flag(content, "filter", where, True),
    )


def _fields(content: Dict[str, Any], where: str, target: Target) -> tuple[str, ...]:
    if "field" in content and "fields" in content:
        raise DataError(f"{where}: field and fields both given; one of them is enough")
    given = content.get("fields", content.get("field"))
    fields = [given] if isinstance(given, str) else given
    if not isinstance(fields, list) or not fields or not all(isinstance(path, str) for path in fields):
        raise DataError(
            f'{where}: fields are {given!r}; expected a list of {target.dim} paths, "" for one the log lacks'
        )
    allowed = {3, 4} if target.quantity == ATTITUDE else {target.dim}
    if len(fields) not in allowed:
        expected = "4 of a quaternion, or roll, pitch and yaw" if target.quantity == ATTITUDE else str(target.dim)
        raise DataError(
            f'{where}: {len(fields)} fields given; expected {expected}, "" for a component that the log lacks'
        )
    if target.quantity == ATTITUDE and not all(fields):
        empty = ", ".join(str(number) for number, path in enumerate(fields, 1) if not path)
        raise DataError(f"{where}: fields are {fields!r}, number {empty} empty; an attitude needs all {len(fields)}")
    if not any(fields):
        raise DataError(f'{where}: fields are {fields!r}; expected one at least that is not ""')
    return tuple(fields)


def _units(
    content: Dict[str, Any], where: str, target: Target, count: int, frame: str | None
) -> tuple[str | None, ...]:
    """Units of the fields; SI where none is given, radians for roll, pitch and yaw, degrees for latitudes."""
    is_geodetic = frame == frames.GEODETIC
    if "unit" not in content:
        return GEODETIC_UNITS if is_geodetic else (None,) * count
    given = content["unit"]
    units = given if isinstance(given, list) else [given] * count
    if len(units) != count or not all(isinstance(unit, str) for unit in units):
        raise DataError(f"{where}: unit is {given!r}; expected a text, or a list of {count}")
    wanted = "angle" if target.quantity == ATTITUDE else target.quantity
    if target.quantity == ATTITUDE and count == 4:
        raise DataError(
            f"{where}: unit `{given}` given, and a quaternion has none; roll, pitch and yaw are three fields"
        )
    if is_geodetic:
        if [quantity(unit, where) for unit in units] != [ANGLE, ANGLE, LENGTH]:
            raise DataError(
                f"{where}: unit is {given!r}; latitude, longitude and height have three, such as "
                '["degE7", "degE7", "mm"]'
            )
        return tuple(units)
    for unit in units:
        measured = quantity(unit, where)
        if wanted is None or measured in (wanted, RATIO) or (wanted, measured) == (LENGTH, PRESSURE):
            continue
        raise DataError(
            f"{where}: unit `{unit}` is of {measured}, but this is {wanted}; expected one of "
            f"{', '.join(units_of(wanted))}"
        )
    return tuple(units)


def _frame(content: Dict[str, Any], where: str, target: Target, fields: tuple[str, ...]) -> str | None:
    if "frame" not in content:
        return None
    frame = text(content, "frame", where)
    kind = target.frame
    if frame == frames.GEODETIC and (target.quantity, target.frame) == (LENGTH, "world"):
        if not all(fields[:2]):
            raise DataError(f'{where}: frame `{frame}` needs latitude and longitude; the height alone may be ""')
        return frame
    if target.turns and frame in {**frames.WORLD, **frames.BODY}:
        return frame
    if kind == "any":
        kind = "body" if frame in frames.BODY else "world"
    frames.check(frame, kind, where)
    return frame


def _quaternion(content: Dict[str, Any], where: str, target: Target, count: int) -> tuple[str, bool]:
    given = [key for key in ("order", "direction") if key in content]
    if given and (target.quantity != ATTITUDE or (count == 3 and "order" in given)):
        raise DataError(f"{where}: {given[0]} given, and this is no quaternion")
    order = text(content, "order", where, "wxyz")
    direction = text(content, "direction", where, "world_from_body")
    if order not in ("wxyz", "xyzw"):
        raise DataError(f"{where}: order `{order}`; expected wxyz or xyzw, the order that the fields are listed in")
    if direction not in ("world_from_body", "body_from_world"):
        raise DataError(f"{where}: direction `{direction}`; expected world_from_body or body_from_world")
    return order, direction == "body_from_world"


def _per_field(content: Dict[str, Any], key: str, where: str, count: int, usual: float) -> tuple[float, ...]:
    if key not in content:
        return (usual,) * count
    values = numbers(content, key, where)
    if len(values) not in (1, count):
        raise DataError(f"{where}: {key} has {len(values)} numbers; expected one, or {count}")
    return values * count if len(values) == 1 else values


def _table(content: Dict[str, Any], where: str) -> tuple[tuple[float, float], ...]:
    if "table" not in content:
        return ()
    rows = content["table"]
    pairs = [numbers({"table": row}, "table", where) for row in rows] if isinstance(rows, list) else []
    rising = all(one[0] < other[0] for one, other in zip(pairs, pairs[1:]))
    if len(pairs) < 2 or not all(len(pair) == 2 for pair in pairs) or not rising:
        raise DataError(f"{where}: table is {rows!r}; expected pairs of raw and wanted value, raw values rising")
    return tuple((pair[0], pair[1]) for pair in pairs)


def _pulse(content: Dict[str, Any], where: str, units: tuple[str | None, ...]) -> tuple[float, float, float] | None:
    """Widths at -1, 0 and 1, where the unit is that of a pulse."""
    is_pulse = any(unit is not None and quantity(unit, where) == PULSE for unit in units)
    if "pulse" not in content:
        return USUAL_PULSE if is_pulse else None
    widths = numbers(content, "pulse", where)
    if len(widths) != 3 or not (widths[0] < widths[1] < widths[2] or widths[0] > widths[1] > widths[2]):
        raise DataError(
            f"{where}: pulse is {content['pulse']!r}; expected the widths at -1, 0 and 1, such as [1100, 1500, 1900]"
        )
    return widths
