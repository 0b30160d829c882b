"""Which fields of a log are which sensors and actuators of a model."""

import difflib
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

from ..log import Topic
from ..model import Model, Sensor
from ..units import ANGLE, ATTITUDE, LENGTH, PRESSURE, PULSE, RATIO, UNITS, VELOCITY
from .messages import COMMAND, Group, groups
from .names import unit_of
from .shapes import shapes

#: Similarity of names that is enough where the message's type says nothing.
SIMILAR = 0.6
#: What instruments are called, by type of sensor.
CALLED = {
    "velocimeter": ("dvl", "velocity", "vel"),
    "framelinvel": ("velocity", "vel"),
    "gyro": ("gyro", "gyr", "omega", "rates"),
    "accelerometer": ("acc", "accel"),
    "framepos": ("position", "pos"),
    "framequat": ("attitude", "orientation", "quat", "q"),
    "magnetometer": ("mag", "compass"),
}
#: Type of a ROS message of joints, and its field for a type of sensor.
JOINT_STATE = "sensor_msgs/JointState"
JOINT_FIELDS = {"jointpos": "position", "jointvel": "velocity", "jointactuatorfrc": "effort"}


@dataclass(frozen=True)
class Match:
    """Fields that are proposed. why: in words."""

    topic: Topic
    group: Group
    fields: tuple[str, ...]
    why: str


def sensors(model: Model, topics: dict[str, Topic]) -> dict[str, Match]:
    """A match for each sensor that has one: by quantity and frame, then by name, then by rate."""
    found = {}
    for sensor in model.sensors.values():
        matches = [*_by_type(sensor, topics.values()), *_joints(sensor, model, topics.values())]
        if not matches:
            matches = _by_shape(sensor, topics.values())
        if matches:
            found[sensor.name] = max(matches, key=lambda match: _score(sensor.name, match))
    for sensor in model.sensors.values():
        turned = _turned(sensor, model, found, topics.values()) if sensor.name not in found else []
        if turned:
            found[sensor.name] = max(turned, key=lambda match: _score(sensor.name, match))
    return found


def actuators(model: Model, topics: dict[str, Topic]) -> dict[str, Match]:
    """A match for each actuator: a topic or a field of its name, else an array of commands by order."""
    names = list(model.actuators)
    found = {}
    for topic in topics.values():
        for group in groups(topic.type) or shapes(topic.fields):
            if len(group.fields) > 1 or group.quantity not in ("", COMMAND) or group.fields[0] not in topic.fields:
                continue
            for name in names:
                if group.names:
                    if name.lower() in group.names and name not in found:
                        found[name] = Match(topic, group, group.fields, f"by the channels of {topic.type}")
                    continue
                close = max(similarity(name, topic.name), similarity(name, group.fields[0]))
                exact = _same(name, group.fields[0]) or _same(name, topic.name.strip("/").split("/")[-1])
                if exact or (close > 0.85 and name not in found and group.quantity == COMMAND):
                    unit = group.unit if group.unit is None or UNITS[str(group.unit)][0] in (PULSE, RATIO) else None
                    found[name] = Match(topic, replace(group, unit=unit), group.fields, "by name")
    missing = [name for name in names if name not in found]
    if missing:
        arrays = [(topic, _commands(topic)) for topic in topics.values()]
        arrays = [(topic, commands) for topic, commands in arrays if len(commands) >= len(names)]
        if arrays:
            topic, commands = max(arrays, key=lambda pair: (_is_command(pair[0].name), pair[0].count))
            found |= {
                name: Match(topic, commands[names.index(name)], commands[names.index(name)].fields, "by order")
                for name in missing
            }
    return found


def similarity(one: str, other: str) -> float:
    """Likeness of names, 0 to 1; words of the one that stand in the other count."""
    one_words, other_words = _words(one), _words(other)
    shared = len(one_words & other_words) / max(len(one_words), 1)
    return max(shared, difflib.SequenceMatcher(None, "".join(sorted(one_words)), "".join(sorted(other_words))).ratio())


def _by_type(sensor: Sensor, topics: Iterable[Topic]) -> list[Match]:
    matches = []
    for topic in topics:
        for group in groups(topic.type) or ():
            if not all(field in topic.fields for field in group.fields):
                continue
            if group.quantity == sensor.quantity and group.frame_kind == sensor.frame:
                matches.append(Match(topic, group, group.fields, f"{sensor.quantity} of {topic.type}"))
            elif group.quantity == PRESSURE and (sensor.quantity, sensor.frame) == (LENGTH, "world"):
                matches.append(
                    Match(topic, group, ("", "", *group.fields), f"the height, by the pressure of {topic.type}")
                )
    whole = [match for match in matches if all(match.fields)]
    return whole or matches


def _turned(sensor: Sensor, model: Model, found: dict[str, Match], topics: Iterable[Topic]) -> list[Match]:
    """Velocities in the world for a sensor of a body, or the other way.

    One attitude of that body is matched, and no velocity yet: the same one twice would count as two measurements.
    """
    same = [model.sensors[name] for name in found if model.sensors[name].body == sensor.body]
    attitudes = sum(other.type == "framequat" for other in same)
    if not sensor.turns or attitudes != 1 or any(other.quantity == VELOCITY for other in same):
        return []
    other = "world" if sensor.frame == "body" else "body"
    return [
        Match(topic, group, group.fields, f"velocity in the {other} of {topic.type}, turned by the attitude")
        for topic in topics
        for group in groups(topic.type) or shapes(topic.fields)
        if all(field in topic.fields for field in group.fields)
        and (group.quantity, group.frame_kind) == (VELOCITY, other)
    ]


def _joints(sensor: Sensor, model: Model, topics: Iterable[Topic]) -> list[Match]:
    """The element of a sensor's joint in messages of joints."""
    if sensor.type not in JOINT_FIELDS:
        return []
    joint = model.compiled.joint(int(model.compiled.sensor(sensor.name).objid[0])).name
    field = JOINT_FIELDS[sensor.type]
    kinds = [
        topic for topic in topics if topic.type.replace("/msg/", "/") == JOINT_STATE and f"{field}[0]" in topic.fields
    ]
    group = Group(sensor.quantity or "", None, (f"{field}[{joint}]",))
    return [Match(topic, group, group.fields, f"{sensor.quantity} of {topic.type}") for topic in kinds]


def _by_shape(sensor: Sensor, topics: Iterable[Topic]) -> list[Match]:
    """Fields of unknown messages, by what their names say."""
    sizes = {3, 4} if sensor.quantity == ATTITUDE else {sensor.dim}
    matches = []
    for topic in topics:
        if groups(topic.type) is not None:
            continue
        for group in shapes(topic.fields):
            if len(group.fields) not in sizes:
                continue
            if group.quantity:
                if (group.quantity, group.frame_kind) == (sensor.quantity, sensor.frame):
                    matches.append(Match(topic, group, group.fields, "by the ends of the names"))
                continue
            if max(_near(sensor, _stem(group)), _near(sensor, topic.name)) >= SIMILAR:
                measured = ANGLE if sensor.quantity == ATTITUDE else sensor.quantity
                fits = group.unit is None or UNITS[str(group.unit)][0] == measured
                matches.append(Match(topic, group if fits else replace(group, unit=None), group.fields, "by name"))
    return matches


def _near(sensor: Sensor, name: str) -> float:
    """Likeness of a name to a sensor's, or to what instruments of its type are called."""
    return max(similarity(word, name) for word in (sensor.name, *CALLED.get(sensor.type, ())))


def _score(name: str, match: Match) -> tuple[float, float]:
    near = max(similarity(name, match.topic.name), similarity(name, _stem(match.group)))
    # Names that are hardly alike say nothing: the faster one then.
    return near if near >= SIMILAR else 0.0, match.topic.rate or 0.0


def _stem(group: Group) -> str:
    """What the names of a group's fields have in common."""
    first = unit_of(group.fields[0])[0]
    return first if len(group.fields) == 1 else re.sub(r"[._\[ ]?(roll|0|[xw])\]?$", "", first)


def _commands(topic: Topic) -> list[Group]:
    return [
        g for g in groups(topic.type) or () if g.quantity == COMMAND and not g.names and g.fields[0] in topic.fields
    ]


def _is_command(name: str) -> bool:
    return bool(
        _words(name)
        & {"thruster", "thrusters", "actuator", "actuators", "motors", "command", "commands", "cmd", "rcou"}
    )


def _same(one: str, other: str) -> bool:
    return one.lower() in {re.sub(r"_(ctrl|cmd|command)$", "", name.lower()) for name in (other, unit_of(other)[0])}


def _words(name: str) -> set[str]:
    return set(re.findall(r"[a-z]+|\d+", re.sub(r"([a-z])([A-Z])", r"\1 \2", name).lower()))
