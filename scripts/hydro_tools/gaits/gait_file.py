"""Gait files, `hydro-gait/1`: the numbers of a generator, the robot they are for, and where they were learnt."""

import hashlib
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from hydro_mujoco.reading import read_json
from hydro_mujoco.recording.files import write_json

from ..datasets import DataError
from .generator import PARAMETERS

SCHEMA = "hydro-gait/1"
#: The robot that the generator drives.
ROBOT = "b1"
#: Greatest size of a file [bytes].
LARGEST = 1 << 20
FIELDS = ("schema", "robot", "joints", "water", "seed", "seconds", "episodes", "score", "parameters", "digest")


@dataclass(frozen=True)
class Gait:
    """A gait, and how it came about.

    joints: names of the servos in their order. parameters: by name, in the units of `PARAMETERS`. score: best of
    learning [m/s]; seconds: length of its episodes; episodes: how many there were.
    """

    robot: str
    joints: tuple[str, ...]
    parameters: dict[str, float]
    water: str
    seed: int
    seconds: float
    episodes: int
    score: float

    @property
    def values(self) -> np.ndarray:
        """The parameters [P] in the order of `PARAMETERS`."""
        return np.array([self.parameters[parameter.name] for parameter in PARAMETERS])


def joints_of(model: mujoco.MjModel) -> tuple[str, ...]:
    """Names of the servos."""
    return tuple(model.actuator(number).name for number in range(model.nu))


def made(values: np.ndarray, joints: tuple[str, ...], **learnt: Any) -> Gait:
    """The gait of a vector of parameters [P]."""
    named = {parameter.name: float(value) for parameter, value in zip(PARAMETERS, values)}
    return Gait(ROBOT, joints, named, **learnt)


def write(path: Path, gait: Gait) -> None:
    """Write a gait beside and rename it."""
    write_json(path, _content(gait) | {"digest": _digest(_content(gait))})


def read(path: Path, model: mujoco.MjModel) -> Gait:
    """The gait of a file, for the robot of a model.

    Raises:
        DataError: no such file, not a gait, of another robot, with parameters missing, unknown or out of range, or
            changed since it was written.
    """
    found = read_json(path, f"gait {path}", LARGEST)
    if not isinstance(found, dict) or found.get("schema") != SCHEMA:
        schema = found.get("schema") if isinstance(found, dict) else type(found).__name__
        raise DataError(f"gait {path}: schema is {schema!r}; expected {SCHEMA!r}")
    if missing := [name for name in FIELDS if name not in found]:
        raise DataError(f"gait {path}: no field {missing[0]!r}; expected {', '.join(FIELDS)}")
    joints = joints_of(model)
    if found["robot"] != ROBOT or found["joints"] != list(joints):
        raise DataError(
            f"gait {path}: of the robot {found['robot']!r} with joints {_short(found['joints'])}; "
            f"this one is {ROBOT!r} with {_short(joints)}"
        )
    _check_parameters(path, found["parameters"])
    for name in ("seed", "seconds", "episodes", "score"):
        if not _number(found[name]):
            raise DataError(f"gait {path}: field {name!r} is {_short(found[name])}; expected a number")
    gait = Gait(
        found["robot"],
        joints,
        {name: float(value) for name, value in found["parameters"].items()},
        str(found["water"]),
        found["seed"],
        found["seconds"],
        found["episodes"],
        found["score"],
    )
    if found["digest"] != _digest(_content(gait)):
        raise DataError(f"gait {path}: the digest is not that of its content; it was changed after it was written")
    return gait


def _check_parameters(path: Path, found: object) -> None:
    names = [parameter.name for parameter in PARAMETERS]
    if not isinstance(found, dict):
        raise DataError(f"gait {path}: parameters are {_short(found)}; expected numbers by name")
    odd = [name for name in names if name not in found] + [name for name in found if name not in names]
    if odd:
        where = "lacks" if odd[0] in names else "has an unknown"
        raise DataError(f"gait {path}: {where} parameter {odd[0]!r}; there are: {', '.join(names)}")
    for parameter in PARAMETERS:
        value = found[parameter.name]
        if not _number(value) or not parameter.least <= value <= parameter.most:
            raise DataError(
                f"gait {path}: parameter {parameter.name!r} is {_short(value)}; expected a number from "
                f"{parameter.least:g} to {parameter.most:g} [{parameter.unit}]"
            )


def _number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _short(value: object) -> str:
    text = repr(list(value) if isinstance(value, tuple) else value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _content(gait: Gait) -> dict[str, Any]:
    return {
        "schema": SCHEMA,
        "robot": gait.robot,
        "joints": list(gait.joints),
        "water": gait.water,
        "seed": gait.seed,
        "seconds": gait.seconds,
        "episodes": gait.episodes,
        "score": gait.score,
        "parameters": gait.parameters,
    }


def _digest(content: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
