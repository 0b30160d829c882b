"""Velocities that a log has in the world and the model in a body, or the other way: by which attitude they turn."""

import dataclasses
from collections.abc import Mapping as Dict
from typing import Any

import numpy as np

from ...errors import DataError
from .. import frames
from ..model import Model, Sensor
from ..units import ATTITUDE
from ..words import listed, nearest
from .schema import Source, Turn
from .sources import Target, source


def with_turns(sensors: Dict[str, Source], content: Dict[str, Any], model: Model) -> dict[str, Source]:
    """The sources of sensors, each with the attitude that turns it, where it needs one. content: of [sensors]."""
    return {key: _with_turn(key, each, sensors, content[key], model) for key, each in sensors.items()}


def _with_turn(key: str, found: Source, sensors: Dict[str, Source], content: Dict[str, Any], model: Model) -> Source:
    sensor = model.sensors[key]
    is_other = sensor.turns and found.frame is not None and (found.frame in frames.BODY) != (sensor.frame == "body")
    if not is_other:
        if "attitude" in content:
            raise DataError(
                f"{found.where}: attitude given, which turns a velocity from the world into the body or back; here "
                "`frame` is of the kind that the sensor reads in"
            )
        return found
    if not all(found.fields):
        raise DataError(f"{found.where}: frame `{found.frame}` has to be turned by an attitude, which needs all fields")
    into = "body" if sensor.frame == "body" else "world"
    given = content.get("attitude")
    if isinstance(given, Dict):
        attitude = source(given, f"{found.where} attitude", Target(4, ATTITUDE, "attitude"))
        mount = sensor.axes if into == "body" else np.eye(3)
    else:
        name = _named(given, found, sensor, sensors, model)
        attitude, about = sensors[name], model.sensors[name].axes
        mount = about.T @ (sensor.axes if into == "body" else np.eye(3))
    return dataclasses.replace(found, turn=Turn(attitude, into, tuple(map(tuple, mount.tolist()))))


def _named(given: Any, found: Source, sensor: Sensor, sensors: Dict[str, Source], model: Model) -> str:
    """The sensor whose attitude turns: the one that is named, else the only one on the same body."""
    there = [name for name in sensors if model.sensors[name].type == "framequat" and model.sensors[name].frame]
    fitting = [name for name in there if model.sensors[name].body == sensor.body]
    if given is None and len(fitting) == 1:
        return fitting[0]
    if given is None:
        raise DataError(
            f"{found.where}: frame `{found.frame}`, and `{sensor.name}` ({sensor.type}) reads in the "
            f"{'body' if sensor.frame == 'body' else 'world'}; name the attitude that turns it: "
            f'`attitude = "SENSOR"`, one of {listed(fitting)}, or a table {{topic, fields, order, frame}}'
        )
    if given not in there:
        raise DataError(
            f"{found.where}: attitude `{given}` is no mapped framequat{nearest(str(given), there)}; there are "
            f"{listed(there)}"
        )
    if given not in fitting:
        raise DataError(f"{found.where}: attitude `{given}` is of another body than `{sensor.name}`")
    return str(given)
