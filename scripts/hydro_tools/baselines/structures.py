"""`mujoco.sysid` with a choice of structure: which effect's parameters are free, by the criterion of Schwarz (BIC).

The toolbox fits; what it lacks is the choice. Each structure frees the parameters of MuJoCo that are one effect of the
catalogue. What the uncertain numbers of the nominal would do to the residual is projected out, weighted by their prior,
or every choice would be a payload or a gain. Forward: the best structure, then the best beside it, as long as BIC falls
(G. Schwarz, Estimating the Dimension of a Model, Ann. Statist. 6, 1978).
"""

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco import sysid

from . import identification
from .motion import Motion
from .weak import nuisances, turned

#: Step of the slopes of the uncertain numbers [standard deviations].
SLOPE = 0.1
#: Part of its name by which a parameter of `identification.parameters` belongs to an effect.
OF_NOMINAL = {"inertia": "payload", "fluid": "quadratic_drag", "gain": "actuator_gain", "damping": "joint_damping"}


@dataclass(frozen=True)
class Structure:
    """An effect on a target, and the parameters that are free where it is missing."""

    effect: str
    target: str
    add: Callable[[sysid.parameter.ParameterDict], None]


@dataclass(frozen=True)
class Chosen:
    """What BIC chose: structures, and the model with their parameters."""

    structures: list[Structure]
    model: mujoco.MjModel


def structures(model: mujoco.MjModel) -> list[Structure]:
    """Every effect that MuJoCo has parameters for."""
    out = []
    for name in identification.parameters(model).parameters:
        kind, _, target = name.partition(" ")

        def nominal(free, name=name):
            free.add(identification.parameters(model)[name])

        out.append(Structure(OF_NOMINAL[kind], target, nominal))
    if model.nu > 1:

        def all_gains(free):
            for name, parameter in identification.parameters(model).parameters.items():
                if name.startswith("gain "):
                    free.add(parameter)

        out.append(Structure("actuator_gain", "all", all_gains))
    for joint in range(model.njnt):
        name = model.joint(joint).name
        if name and model.jnt_type[joint] in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE):
            out += _of_joint(name)
    base = next((b for b in range(1, model.nbody) if model.body_dofnum[b] == 6), None)
    if base is not None and model.body(base).name:
        out.append(_buoyancy(model.body(base).name, float(model.body_gravcomp[base])))
    if model.opt.density > 0 or model.opt.viscosity > 0:
        out.append(_current(model.opt.wind.copy()))
    return out


def _one(name: str, nominal, low, high, modifier) -> Callable[[sysid.parameter.ParameterDict], None]:
    def add(free):
        free.add(sysid.parameter.Parameter(name, nominal, low, high, modifier=modifier))

    return add


def _of_joint(name: str) -> list[Structure]:
    def friction(spec, p):
        spec.joint(name).frictionloss = float(p.value[0])

    def spring(spec, p):
        joint = spec.joint(name)
        joint.stiffness, joint.springref = np.array([float(p.value[0]), 0.0, 0.0]), float(p.value[1])

    return [
        Structure("joint_friction", name, _one(f"friction {name}", [0.0], [0.0], [20.0], friction)),
        Structure("joint_stiffness", name, _one(f"spring {name}", [0.0, 0.0], [0.0, -3.0], [200.0, 3.0], spring)),
    ]


def _buoyancy(name: str, nominal: float) -> Structure:
    def lift(spec, p):
        spec.body(name).gravcomp = float(p.value[0])

    return Structure("net_buoyancy", name, _one(f"lift {name}", [nominal], [nominal - 1], [nominal + 1], lift))


def _current(nominal: np.ndarray) -> Structure:
    def wind(spec, p):
        spec.option.wind = p.value

    return Structure("current", "hull", _one("wind", nominal, nominal - 2, nominal + 2, wind))


def choose(
    xml: str,
    model: mujoco.MjModel,
    motions: list[Motion],
    spread: dict[str, float],
    *,
    segments: int,
    iterations: int,
    most: int,
) -> Chosen:
    """The structures that BIC chooses, `most` at most, and the model with them."""
    sequences, divided = identification.measured(xml, model, motions, segments)
    project = _projection(sequences, divided, model, spread)
    whole = sysid.build_residual_fn(models_sequences=sequences, modify_residual=divided)

    def residual(x, params, **more):
        residuals, predicted, records = whole(x, params, **more)
        return [project(np.concatenate(residuals))], predicted, records

    def fitted(chosen: list[Structure]):
        free = sysid.parameter.ParameterDict()
        for structure in chosen:
            structure.add(free)
        best = identification.optimum(free, residual, iterations) if chosen else free
        left = residual(best.as_vector(), best)[0][0]
        return float(left @ left) + best.size * np.log(left.size), best

    everything, chosen = structures(model), []
    least, best = fitted(chosen)
    while len(chosen) < most:
        held = {(of.effect, of.target) for of in chosen}
        tried = [
            (*fitted([*chosen, structure]), structure)
            for structure in everything
            if (structure.effect, structure.target) not in held and not _repeats(structure, chosen)
        ]
        bic, found, structure = min(tried, key=lambda of: of[0])
        if bic >= least:
            break
        least, best, chosen = bic, found, [*chosen, structure]
    return Chosen(chosen, sysid.apply_param_modifiers(best, mujoco.MjSpec.from_file(xml)))


def _repeats(structure: Structure, chosen: list[Structure]) -> bool:
    """True for a gain beside another: the parameters would stand twice."""
    return structure.effect == "actuator_gain" and any(of.effect == "actuator_gain" for of in chosen)


def _projection(sequences, divided, model: mujoco.MjModel, spread: dict[str, float]):
    """(1 + N N')^-1/2 for the slopes N of the residual along the uncertain numbers, per standard deviation."""
    none = sysid.parameter.ParameterDict()

    def at(amounts: np.ndarray) -> np.ndarray:
        residual = sysid.build_residual_fn(
            models_sequences=sequences,
            modify_residual=divided,
            build_model=lambda params, spec: turned(model, spread, amounts),
        )
        return np.concatenate(residual(none.as_vector(), none)[0])

    count = len(nuisances(model, spread))
    base = at(np.zeros(count))
    slopes = np.stack([(at(SLOPE * axis) - base) / SLOPE for axis in np.eye(count)], 1)
    left, sizes, _ = np.linalg.svd(slopes, full_matrices=False)
    shrink = 1 - 1 / np.sqrt(1 + sizes**2)

    def project(residual: np.ndarray) -> np.ndarray:
        return residual - left @ (shrink[:, None] * (left.T @ residual.reshape(len(residual), -1))).reshape(
            left.shape[1], *residual.shape[1:]
        )

    return project
