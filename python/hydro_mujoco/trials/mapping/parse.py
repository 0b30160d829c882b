"""Mapping files: TOML into `Mapping`, checked against a model."""

import os
import tomllib
from collections.abc import Mapping as Dict
from pathlib import Path
from typing import Any

from ...errors import DataError
from ...reading import read_text
from .. import frames
from ..model import Model
from ..units import ATTITUDE, LENGTH, RATE, TIMES, VELOCITY
from ..words import listed, nearest
from .schema import SCHEMA, Mapping, Source, Time, Trials, Water
from .sources import SOURCE_KEYS, Target, source
from .turns import with_turns
from .values import flag, known, number, numbers, positive, table, text

_PARTS = ("schema", "time", "trials", "water", "model", "sensors", "actuators", "joints", "state")
#: Parts of the state of a free body.
_BODY_STATE = {
    "position": Target(3, LENGTH, "world"),
    "attitude": Target(4, ATTITUDE, "attitude"),
    "linear_velocity": Target(3, VELOCITY, "any"),
    "angular_velocity": Target(3, RATE, "body"),
}


def parse(mapping: str | os.PathLike | Dict[str, Any], model: Model) -> Mapping:
    """A mapping from a TOML file's path, or from its content as a dict.

    Raises:
        DataError: it is no mapping of this schema, or names what the model lacks.
    """
    if isinstance(mapping, Dict):
        return _mapping(mapping, "mapping", model)
    path = Path(mapping)
    name = f"mapping {path}"
    if not os.path.exists(path):
        raise DataError(f"{name}: no such file; --dry-run proposes one")
    try:
        content = tomllib.loads(read_text(path, name))
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise DataError(f"{name}: no TOML ({error})") from error
    return _mapping(content, name, model)


def _mapping(content: Dict[str, Any], name: str, model: Model) -> Mapping:
    known(content, _PARTS, name)
    if content.get("schema") != SCHEMA:
        raise DataError(f'{name}: schema is {content.get("schema")!r}; expected `schema = "{SCHEMA}"`')
    sensors = _named(content, "sensors", "sensor", model.sensors, name)
    actuators = _named(content, "actuators", "actuator", model.actuators, name)
    joints = _named(content, "joints", "joint", model.joints, name)
    if not sensors and not joints:
        raise DataError(f"{name}: no sensor is mapped; the model's are {_sensors(model)}")
    if missing := [actuator for actuator in model.actuators if actuator not in actuators]:
        raise DataError(
            f"{name}: a trial needs a command for every actuator of the model, and {listed(missing)} are not mapped; "
            "one that stands still: `constant = 0`"
        )
    read = {
        key: source(value, f"{name}, [sensors.{key}]", _sensor_target(model, key)) for key, value in sensors.items()
    }
    axes = table(content, "model", name)
    return Mapping(
        name,
        with_turns(read, sensors, model),
        {
            key: source(value, f"{name}, [actuators.{key}]", Target(1, None, None, may_be_constant=True))
            for key, value in actuators.items()
        },
        {
            key: source(value, f"{name}, [joints.{key}]", Target(1, model.joints[key].quantities[0], None))
            for key, value in joints.items()
        },
        _state(content, name, model),
        _time(table(content, "time", name), f"{name}, [time]"),
        _trials(table(content, "trials", name), f"{name}, [trials]"),
        _water(table(content, "water", name), f"{name}, [water]"),
        _frames(axes, f"{name}, [model]"),
        _origin(axes, f"{name}, [model]"),
    )


def _named(content: Dict[str, Any], part: str, what: str, there: Dict[str, Any], name: str) -> dict[str, Any]:
    """A table of tables by names of the model."""
    named = table(content, part, name)
    for key, value in named.items():
        if key not in there:
            raise DataError(
                f"{name}, [{part}.{key}]: the model has no {what} `{key}`{nearest(key, there)}; it has {listed(there)}"
            )
        if not isinstance(value, Dict):
            raise DataError(
                f"{name}, [{part}.{key}]: {value!r} found; expected a table with the keys {listed(SOURCE_KEYS)}"
            )
    return dict(named)


def _sensor_target(model: Model, name: str) -> Target:
    sensor = model.sensors[name]
    return Target(sensor.dim, sensor.quantity, sensor.frame, turns=sensor.turns)


def _sensors(model: Model) -> str:
    return ", ".join(f"`{sensor.name}` ({sensor.type})" for sensor in model.sensors.values()) or "none"


def _state(content: Dict[str, Any], name: str, model: Model) -> dict[str, dict[str, Source]]:
    found = {}
    for key, parts in table(content, "state", name).items():
        where = f"{name}, [state.{key}]"
        if key in model.free:
            targets = _BODY_STATE
        elif key in model.joints:
            position, velocity = model.joints[key].quantities
            targets = {"position": Target(1, position, None), "velocity": Target(1, velocity, None)}
        else:
            there = [*model.free, *model.joints]
            raise DataError(
                f"{where}: no free body, hinge or slide is called `{key}`{nearest(key, there)}; there are "
                f"{listed(there)}"
            )
        if not isinstance(parts, Dict):
            raise DataError(f"{where}: {parts!r} found; expected the tables {listed(targets)}")
        known(parts, targets, where)
        if missing := [part for part in targets if part not in parts]:
            raise DataError(f"{where}: {listed(missing)} missing; a state is whole, or left out and estimated")
        found[key] = {part: source(parts[part], f"{where} {part}", target) for part, target in targets.items()}
    there = [*model.free, *model.joints]
    if found and (missing := [key for key in there if key not in found]):
        raise DataError(
            f"{name}, [state]: {listed(missing)} missing; the start needs every free body and joint, or leave "
            "[state] out and `hydro gap` estimates it"
        )
    return found


def _time(content: Dict[str, Any], where: str) -> Time:
    known(content, ("clock", "unit", "align", "period", "control_period"), where)
    unit = text(content, "unit", where, "s")
    if unit not in TIMES:
        raise DataError(f"{where}: unit `{unit}` is no unit of time; expected one of {', '.join(TIMES)}")
    return Time(
        text(content, "clock", where, "log"),
        unit,
        flag(content, "align", where, False),
        positive(content, "period", where),
        positive(content, "control_period", where),
    )


def _trials(content: Dict[str, Any], where: str) -> Trials:
    known(content, ("gap", "windows", "mode", "shortest", "length"), where)
    usual = Trials()
    given = content.get("windows", [])
    windows = [numbers({"windows": pair}, "windows", where) for pair in (given if isinstance(given, list) else [0])]
    for pair in windows:
        if len(pair) != 2 or not pair[0] < pair[1]:
            raise DataError(
                f"{where}: window {list(pair)}; expected pairs of seconds such as `windows = [[10, 40], [60, 95]]`"
            )
    return Trials(
        positive(content, "gap", where) or usual.gap,
        tuple((start, stop) for start, stop in windows),
        _mode(content["mode"], f"{where} mode") if "mode" in content else None,
        positive(content, "shortest", where) or usual.shortest,
        positive(content, "length", where),
    )


def _mode(content: Any, where: str) -> tuple[str, str, tuple[float | str, ...]]:
    if not isinstance(content, Dict):
        raise DataError(f"{where}: {content!r} found; expected {{topic, field, values}}")
    known(content, ("topic", "field", "values"), where)
    values = content.get("values")
    if not isinstance(values, list) or not values or not all(isinstance(v, str | int | float) for v in values):
        raise DataError(f"{where}: values are {values!r}; expected a list of the modes that are a trial")
    return text(content, "topic", where), text(content, "field", where), tuple(values)


def _water(content: Dict[str, Any], where: str) -> Water:
    known(content, ("density", "gravity", "surface_pressure", "surface"), where)
    usual = Water()
    return Water(
        positive(content, "density", where) or usual.density,
        positive(content, "gravity", where) or usual.gravity,
        number(content, "surface_pressure", where, usual.surface_pressure),
        number(content, "surface", where, usual.surface),
    )


def _frames(content: Dict[str, Any], where: str) -> tuple[str, str]:
    known(content, ("world", "body", "origin"), where)
    world, body = text(content, "world", where, "ENU"), text(content, "body", where, "FLU")
    for value, kind in ((world, frames.WORLD), (body, frames.BODY)):
        if value not in kind:
            raise DataError(f"{where}: frame `{value}`; expected {' or '.join(kind)}")
    return world, body


def _origin(content: Dict[str, Any], where: str) -> tuple[float, float, float] | None:
    if "origin" not in content:
        return None
    values = numbers(content, "origin", where)
    if len(values) != 3 or not (abs(values[0]) <= 90 and abs(values[1]) <= 360):
        raise DataError(f"{where}: origin is {list(values)}; expected latitude, longitude [degrees] and height [m]")
    return values[0], values[1], values[2]
