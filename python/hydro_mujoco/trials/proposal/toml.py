"""A proposed mapping as a TOML text."""

import json
import re

from ..assemble import LEAST_PERIOD
from ..log import Topic
from ..mapping import SCHEMA
from ..model import Model, Sensor
from ..units import ACCELERATION, ANGLE, ATTITUDE, RATE
from .match import Match
from .names import time_of

#: Length of a trial that is proposed, and the trials that it should leave at least.
LENGTH, LEAST_TRIALS = 10.0, 4
STAMP = "header.stamp"
#: Quantity -> a unit that is common in logs, and the one that is meant where none is given.
UNSAID = {ANGLE: ("deg", "rad"), ATTITUDE: ("deg", "rad"), RATE: ("deg/s", "rad/s"), ACCELERATION: ("g", "m/s^2")}


def text(model: Model, sensors: dict[str, Match], actuators: dict[str, Match], is_table: bool) -> str:
    """The mapping; what has no match is a comment."""
    used = {match.topic.name: match.topic for match in [*sensors.values(), *actuators.values()]}
    stamped = None if is_table else any(STAMP in match.topic.fields for match in sensors.values())
    lines = [
        f'schema = "{SCHEMA}"',
        "",
        *(_time_of_table(used) if is_table else _time(sensors, model, stamped)),
        "",
        *_trials(used),
        "",
        "[model]",
        'world = "ENU"  # the axes of the MJCF: x east, y north, z up; or NWU',
        'body = "FLU"   # x forward, y left, z up; or FRD',
    ]
    for name, sensor in model.sensors.items():
        if name in sensors:
            lines += [
                "",
                f"[sensors.{_key(name)}]  # {sensor.type}: {sensors[name].why}",
                *_source(sensors[name], stamped),
                *(_asked(sensor, sensors[name]) if is_table else ()),
            ]
        else:
            what = f"{sensor.type}, {sensor.quantity or 'any quantity'}"
            lines += ["", f"# [sensors.{_key(name)}]  # {what}: nothing found; a sensor without a log is not compared"]
    for name in model.actuators:
        if name in actuators:
            lines += ["", f"[actuators.{_key(name)}]  # {actuators[name].why}", *_source(actuators[name], stamped)]
        else:
            lines += [
                "",
                f"# [actuators.{_key(name)}]  # nothing found; every actuator needs a command",
                "# constant = 0",
            ]
    return "\n".join(lines) + "\n"


def _time(sensors: dict[str, Match], model: Model, stamped: bool | None) -> list[str]:
    lines = ["[time]"]
    if stamped:
        lines.append(f'clock = "{STAMP}"  # of each message; those without one are on the log\'s')
    elif stamped is not None:
        lines.append('clock = "log"')
    rates = [match.topic.rate for match in sensors.values() if match.topic.rate]
    if rates:
        period = max(round(max(1 / max(rates), LEAST_PERIOD) / model.timestep), 1) * model.timestep
        lines.append(f"period = {period:.6g}  # seconds between rows; the fastest sensor has {max(rates):.4g} Hz")
    return lines


def _time_of_table(used: dict[str, Topic]) -> list[str]:
    found = time_of(name for topic in used.values() for name in topic.fields)
    if found is None:
        return ["[time]", '# clock = "..."  # which column is the time?']
    return ["[time]", f"clock = {json.dumps(found[0])}", f"unit = {json.dumps(found[1])}"]


def _asked(sensor: Sensor, match: Match) -> list[str]:
    """What names of columns do not say, as comments."""
    lines = []
    if match.group.unit is None and (examples := UNSAID.get(sensor.quantity or "")) and len(match.fields) < 4:
        lines.append(f"# unit = {json.dumps(examples[0])}  # if it is not {examples[1]}")
    if match.group.frame is None and sensor.frame:
        other, own = {"body": ("FRD", "FLU"), "world": ("NED", "ENU")}.get(sensor.frame, ("NED/FRD", "ENU/FLU"))
        lines.append(f"# frame = {json.dumps(other)}  # if it is not {own}")
    return lines


def _trials(used: dict[str, Topic]) -> list[str]:
    length = max((topic.seconds or 0.0 for topic in used.values()), default=0.0)
    lines = ["[trials]", "gap = 1.0  # seconds without any sensor that end a trial", "# windows = [[10, 40], [60, 95]]"]
    if length > 2 * LENGTH or not length:
        lines.append(f"length = {LENGTH}  # seconds; longer pieces are cut")
    elif length:
        lines.append(f"length = {max(length / LEAST_TRIALS, 2.0):.3g}  # seconds; longer pieces are cut")
    return lines


def _source(match: Match, stamped: bool | None) -> list[str]:
    """The keys of a source. stamped: whether the mapping's clock is STAMP; None for a table."""
    lines = [] if stamped is None else [f"topic = {json.dumps(match.topic.name)}"]
    lines.append(f"fields = {json.dumps(list(match.fields))}")
    group = match.group
    for key, value in (("unit", group.unit), ("frame", group.frame), ("order", group.order)):
        if value is not None:
            lines.append(f"{key} = {json.dumps(value)}")
    if stamped and STAMP not in match.topic.fields:
        lines.append('clock = "log"')
    return lines


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else json.dumps(name)
