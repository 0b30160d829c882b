"""Perturbed parameters of the truth, which the nominal does not have.

3 % of masses, inertias, gains, fluid coefficients and damping; 2 mm of every centre of mass.
"""

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

#: Relative standard deviation, and that of a centre of mass [m].
RELATIVE, COM = 0.03, 0.002
#: Draws are cut at this many standard deviations.
CUT = 2.0

SERVO = mujoco.mjtBias.mjBIAS_AFFINE


@dataclass(frozen=True)
class Nuisance:
    """A nuisance parameter: `turn(model, z)` moves it by z standard deviations; `group` ties parameters together."""

    name: str
    group: str
    turn: Callable[[mujoco.MjModel, float], None]


def nuisances(model: mujoco.MjModel, com: float = COM, tie: Callable[[str], str] | None = None) -> list[Nuisance]:
    """Every nuisance of a model. `tie` gives the class of a body by its name; else the last word of it."""
    out = []
    root_first = {}
    light = min(1e-3, 1e-3 * float(model.body_mass.sum()))
    for body in range(1, model.nbody):
        name = model.body(body).name
        if name.endswith("_buoyancy") or model.body_mass[body] < light:
            continue
        # Nuisances of the heaviest part stand alone, those of small parts are tied by class.
        kind = name if model.nv <= 6 or not root_first else name.rsplit("_", 1)[-1]
        root_first.setdefault("root", body)
        if tie is not None:
            kind = tie(name)
        out.append(Nuisance(f"mass {name}", f"mass {kind}", _mass(body)))
        for axis in range(3):
            out.append(Nuisance(f"com {name} {axis}", f"com {kind} {axis}", _com(body, axis, com)))
            out.append(Nuisance(f"inertia {name} {axis}", f"inertia {kind} {axis}", _inertia(body, axis)))
    for geom in range(model.ngeom):
        if model.geom_fluid[geom, 0] > 0 and model.geom_fluid[geom, 1:5].any():
            kind = model.geom(geom).name.rsplit("_", 2)[-2] if "_" in model.geom(geom).name else "hull"
            for slot in range(1, 5):
                out.append(Nuisance(f"fluid {geom} {slot}", f"fluid {kind} {slot}", _fluid(geom, slot)))
    if not model.geom_fluid[:, 0].any():
        # MuJoCo's fluid by inertia boxes has no coefficients but these.
        for field in ("density", "viscosity"):
            if getattr(model.opt, field) > 0:
                out.append(Nuisance(f"fluid {field}", f"fluid {field}", _option(field)))
    for actuator in range(model.nu):
        name = model.actuator(actuator).name
        kind = name if model.nu <= 8 or tie is not None else name.split("_", 1)[-1]
        out.append(Nuisance(f"gain {name}", f"gain {kind}", _gain(actuator)))
    for dof in range(model.nv):
        if np.any(model.dof_damping[dof] > 0):
            out.append(Nuisance(f"damping {dof}", f"damping {dof}", _damping(dof)))
    return out


def perturbed(
    model: mujoco.MjModel, rng: np.random.Generator, com: float = COM, tie: Callable[[str], str] | None = None
) -> dict[str, float]:
    """Move every nuisance parameter of `model` by a random amount; returns the amounts [standard deviations]."""
    amounts = {}
    for nuisance in nuisances(model, com, tie):
        z = float(np.clip(rng.normal(), -CUT, CUT))
        nuisance.turn(model, z)
        amounts[nuisance.name] = z
    settle(model)
    return amounts


def settle(model: mujoco.MjModel) -> None:
    """Recompute what the engine derives from masses."""
    mujoco.mj_setConst(model, mujoco.MjData(model))


def groups(
    model: mujoco.MjModel, com: float = COM, tie: Callable[[str], str] | None = None
) -> dict[str, list[Nuisance]]:
    """Nuisances tied by group: those of a fluid, of actuators and of joints first, then of the bodies that move."""
    fixed = {model.body(body).name for body in range(1, model.nbody) if model.body_weldid[body] == 0}
    of_bodies: list[Nuisance] = []
    others: list[Nuisance] = []
    for nuisance in nuisances(model, com, tie):
        quantity, name = nuisance.name.split()[:2]
        if quantity not in ("mass", "com", "inertia"):
            others.append(nuisance)
        elif name not in fixed:
            of_bodies.append(nuisance)
    out: dict[str, list[Nuisance]] = {}
    for nuisance in others + of_bodies:
        out.setdefault(nuisance.group, []).append(nuisance)
    return out


def _mass(body):
    def turn(model, z):
        model.body_mass[body] *= 1 + RELATIVE * z
        # Its buoyancy stays as it is.
        model.body_gravcomp[body] /= 1 + RELATIVE * z

    return turn


def _inertia(body, axis):
    def turn(model, z):
        model.body_inertia[body, axis] *= 1 + RELATIVE * z

    return turn


def _com(body, axis, com):
    def turn(model, z):
        # Gravity compensation acts at the centre of mass and would move with it, but a hull's buoyancy does not.
        if model.body_gravcomp[body] == 0:
            model.body_ipos[body, axis] += com * z

    return turn


def _fluid(geom, slot):
    def turn(model, z):
        model.geom_fluid[geom, slot] *= 1 + RELATIVE * z

    return turn


def _option(field):
    def turn(model, z):
        setattr(model.opt, field, getattr(model.opt, field) * (1 + RELATIVE * z))

    return turn


def _gain(actuator):
    def turn(model, z):
        model.actuator_gainprm[actuator] *= 1 + RELATIVE * z
        model.actuator_biasprm[actuator] *= 1 + RELATIVE * z

    return turn


def _damping(dof):
    def turn(model, z):
        model.dof_damping[dof] *= 1 + RELATIVE * z

    return turn
