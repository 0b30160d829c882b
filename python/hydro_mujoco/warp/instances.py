"""Instances of `hydro.wrench` in a compiled model: the body that carries each, and what its attributes say."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from ..errors import DataError
from ..plugin import WRENCH, attribute
from ..recording.kinematics import name_of
from ..sea import attributes
from ..sea.waves import Waves
from .checkpoint.settings import FRESH_WATER, Settings, settings
from .current import Current, current
from .support import ATTRIBUTES, CURRENTS, EFFECTS, WITHOUT, refuse


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
        learned: its checkpoint; the added mass that the card leaves to the inertia is among the effects.
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
    learned: Settings | None


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
    there = attributes.instances(model)
    return {int(np.flatnonzero(model.body_plugin == number)[0]): number for number in there}


def _instance(model: mujoco.MjModel, number: int, body: int) -> Instance:
    name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_PLUGIN, number) or f"number {number}"
    where = f"instance `{name}` of {WRENCH}"

    def text(name: str) -> str:
        return (attribute(model, number, name) or "").strip()

    unsupported = [each for each in WITHOUT if text(each)]
    if unsupported:
        refuse(where, f"attribute `{unsupported[0]}`", ATTRIBUTES)
    effects = list((attributes.document(model, number, "effects") or {"effects": []})["effects"])
    for effect in effects:
        if effect["effect"] not in EFFECTS:
            refuse(where, f"effect `{effect['effect']}`", EFFECTS)
    waves = attributes.document(model, number, "waves")
    density = attributes.number(model, number, "density")
    learned = settings(model, number, where)
    if learned is not None:
        _check_beside(model, where)
        effects += _added_mass(learned)
    return Instance(
        name=name,
        body=body,
        effects=effects,
        density=density if density is not None else _density(model),
        waterline=attributes.number(model, number, "waterline"),
        current=_current(model, number, where),
        waves=None if waves is None else Waves.read(waves, float(np.linalg.norm(model.opt.gravity))),
        hull=text("hull").split() or None,
        volume=attributes.number(model, number, "volume"),
        centre_of_buoyancy=_numbers(text("centre_of_buoyancy")) if text("centre_of_buoyancy") else None,
        learned=learned,
    )


def _check_beside(model: mujoco.MjModel, where: str) -> None:
    """Refuse what a checkpoint does not get beside it."""
    if np.any(model.opt.wind) and (model.opt.density > 0 or model.opt.viscosity > 0):
        refuse(where, "option wind with MuJoCo's own fluid beside `checkpoint`", ("attribute `current`",))


def _added_mass(learned: Settings) -> list[dict[str, Any]]:
    """The added mass that a card leaves to the inertia, as effects."""
    return [
        {"effect": "added_mass", "target": body, "parameters": {"matrix": learned.density * matrix, "point": [0, 0, 0]}}
        for body, matrix in learned.card.added_mass.items()
    ]


def _numbers(text: str) -> np.ndarray:
    return np.array([float(number) for number in text.split()])


def _density(model: mujoco.MjModel) -> float:
    return float(model.opt.density) if model.opt.density > 0 else FRESH_WATER


def _current(model: mujoco.MjModel, number: int, where: str) -> Current:
    text = (attribute(model, number, "current") or "").strip()
    if not text:
        return Current()
    try:
        return Current(uniform=_numbers(text))
    except ValueError:
        document = attributes.document(model, number, "current") or {}
    for key in document:
        if key not in CURRENTS:
            refuse(f"{where}, attribute `current`", f"`{key}`", CURRENTS[1:])
    return current(document)


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
