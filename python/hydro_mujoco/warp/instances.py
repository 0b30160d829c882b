"""Instances of `hydro.wrench` in a compiled model: the body that carries each, and what its attributes say."""

import ctypes
import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import mujoco
import numpy as np

from ..errors import DataError
from ..packaged import root
from ..plugin import WRENCH, built_library, mujoco_library
from ..recording.kinematics import name_of
from .current import Current, current
from .support import ATTRIBUTES, CURRENTS, EFFECTS, WITHOUT, refuse
from .waves import Waves, waves

T = TypeVar("T")

#: Density of fresh water [kg/m^3].
FRESH_WATER = 1000.0


@dataclass(frozen=True)
class Instance:
    """The water of one instance.

    Attributes:
        name: of the instance. body: number of the body that carries it.
        effects: `{"effect", "target", "parameters"}` each.
        density: of the water [kg/m^3].
        waterline: world z of the still surface [m]; None: everything is submerged.
        current: beside that of effects.
        waves: about the waterline; None: a still surface.
        hull: names of the geoms that displace water; None: those that docs/plugin.md says.
        volume: that the carrying body displaces [m^3], where it is given.
        centre_of_buoyancy: of the carrying body [m, body frame], where it is given.
    """

    name: str
    body: int
    effects: list[dict[str, Any]]
    density: float
    waterline: float | None
    current: Current
    waves: Waves | None
    hull: list[str] | None
    volume: float | None
    centre_of_buoyancy: np.ndarray | None


def instances(model: mujoco.MjModel) -> list[Instance]:
    """The instances of `hydro.wrench` in a model, in their order.

    Raises:
        DataError: there is none, or one has an attribute or effect that MuJoCo Warp does not get.
    """
    found = [
        _instance(model, number, body) for body, number in sorted(carriers(model).items(), key=lambda pair: pair[1])
    ]
    if not found:
        raise DataError(f"the model has no instance of {WRENCH}: hydro_mujoco.add_water puts a body into water")
    return found


def carriers(model: mujoco.MjModel) -> dict[int, int]:
    """Bodies that carry `hydro.wrench`, with the numbers of their plugin instances."""
    slot = _slot()
    numbers = [number for number in range(model.nplugin) if model.plugin[number] == slot]
    return {int(np.flatnonzero(model.body_plugin == number)[0]): number for number in numbers}


@cache
def _library() -> ctypes.CDLL:
    library = ctypes.CDLL(str(mujoco_library()))
    library.mjp_getPlugin.restype = ctypes.c_void_p
    library.mj_getPluginConfig.restype = ctypes.c_char_p
    return library


def _slot() -> int:
    """Number under which MuJoCo knows the plugin; -1 where it does not."""
    slot = ctypes.c_int(-1)
    _library().mjp_getPlugin(WRENCH.encode(), ctypes.byref(slot))
    return slot.value


def _instance(model: mujoco.MjModel, number: int, body: int) -> Instance:
    name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_PLUGIN, number) or f"number {number}"
    where = f"instance `{name}` of {WRENCH}"

    def text(attribute: str) -> str:
        found = _library().mj_getPluginConfig(ctypes.c_void_p(model._address), number, attribute.encode())
        return (found or b"").decode().strip()

    unsupported = [attribute for attribute in WITHOUT if text(attribute)]
    if unsupported:
        refuse(where, f"attribute `{unsupported[0]}`", ATTRIBUTES)
    effects = _effects(text("effects"), where)
    for effect in effects:
        if effect["effect"] not in EFFECTS:
            refuse(where, f"effect `{effect['effect']}`", EFFECTS)
    return Instance(
        name=name,
        body=body,
        effects=effects,
        density=_density(text("density"), model),
        waterline=_optional(text("waterline"), float),
        current=_current(text("current"), where),
        waves=_waves(text("waves"), model, where),
        hull=_optional(text("hull"), str.split),
        volume=_optional(text("volume"), float),
        centre_of_buoyancy=_optional(text("centre_of_buoyancy"), _numbers),
    )


def _optional(text: str, read: Callable[[str], T]) -> T | None:
    return read(text) if text else None


def _numbers(text: str) -> np.ndarray:
    return np.array([float(number) for number in text.split()])


def _density(text: str, model: mujoco.MjModel) -> float:
    if text:
        return float(text)
    return float(model.opt.density) if model.opt.density > 0 else FRESH_WATER


def _effects(text: str, where: str) -> list[dict[str, Any]]:
    return list(_document(text, f"{where}, attribute `effects`")["effects"]) if text else []


def _current(text: str, where: str) -> Current:
    where = f"{where}, attribute `current`"
    if not text:
        return Current()
    try:
        return Current(uniform=_numbers(text))
    except ValueError:
        document = _document(text, where)
    for key in document:
        if key not in CURRENTS:
            refuse(where, f"`{key}`", CURRENTS[1:])
    return current(document)


def _waves(text: str, model: mujoco.MjModel, where: str) -> Waves | None:
    if not text:
        return None
    return waves(_document(text, f"{where}, attribute `waves`"), float(np.linalg.norm(model.opt.gravity)))


def _document(value: str, where: str) -> dict[str, Any]:
    """The JSON that an attribute gives, or that the file it names holds; it is looked for where the plugin does."""
    if value.startswith("{"):
        return dict(json.loads(value))
    named = [place for place in os.environ.get("HYDRO_PATH", "").split(":") if place]
    places = [Path(place) for place in [*named, ".", str(built_library().parent), str(root())]]
    for place in places:
        if (place / value).is_file():
            return dict(json.loads((place / value).read_text(encoding="utf-8")))
    raise DataError(f"{where}: `{value}` is no file in {', '.join(map(str, places))}")


def target_body(model: mujoco.MjModel, effect: dict[str, Any], where: str) -> int:
    """Number of the body that an effect names.

    Raises:
        DataError: there is none of that name.
    """
    names = {name_of(model, body): body for body in range(1, model.nbody)}
    name = effect["target"]
    if name not in names:
        there = ", ".join(names)
        raise DataError(f"{where}, effect `{effect['effect']}`: no body is called `{name}`; there are: {there}")
    return names[name]
