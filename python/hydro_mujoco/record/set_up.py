"""From a model and options to a recorder and the head of its manifest."""

import hashlib
import math
import os
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np

from ..errors import DataError
from ..plugin import built_library
from ..recording import kinematics
from ..recording.features import FRAMES, OUTPUT_UNITS, OUTPUTS, FreeBase, Joint, Layout
from ..recording.kinematics import below, name_of
from ..recording.system import Compiled, Lift, System
from ..version import __version__
from . import drives, recorder, scene, water
from .excitation import Robot
from .recorder import AnyRobot
from .scene import listed
from .water import Water

#: Longest sample period [s]: the motion of a robot is not seen at a longer one.
LONGEST = 10.0


@dataclass(frozen=True)
class Options:
    """What is recorded, as `record` explains it."""

    seed: int
    samples: int
    body: str | None
    water: str | None
    buoyancy: bool
    density: tuple[float, float] | None
    sample_period: float | None
    noise: float
    effort: float
    frequency: tuple[float, float] | None
    contacts: bool
    plugin: Path | None

    def check(self) -> None:
        """Refuse what can be refused without the model."""
        if self.seed < 0:
            raise DataError(f"seed is {self.seed}; expected 0 or more")
        if self.samples < 2:
            raise DataError(f"samples is {self.samples}; a trajectory has at least 2")
        if self.sample_period is not None and not 0 < self.sample_period <= LONGEST:
            raise DataError(
                f"the sample period is {self.sample_period} s; expected a positive time, {LONGEST:g} s at most"
            )
        if not (math.isfinite(self.noise) and self.noise >= 0):
            raise DataError(f"noise is {self.noise}; expected a share of the wrench's deviation, 0 or more")
        if not (math.isfinite(self.effort) and 0 < self.effort <= 1):
            raise DataError(f"effort is {self.effort}; expected a share above 0, 1 at most")
        for name, pair, unit in (("density", self.density, "kg/m^3"), ("frequency", self.frequency, "Hz")):
            if pair is not None and len(pair) != 2:
                raise DataError(f"{name} is {pair}; expected two numbers, lowest and highest [{unit}]")
            if pair is not None and not (np.all(np.isfinite(pair)) and 0 < pair[0] <= pair[1]):
                raise DataError(f"{name} is {pair[0]} to {pair[1]}; expected lowest and highest, above 0 [{unit}]")


@dataclass(frozen=True)
class Ready:
    """A recorder, its manifest but for name and shards, the noise on each output, and what is to be said.

    lacks_library: the model needs the plugin, and nobody knows its file, so other processes cannot load it.
    """

    recorder: AnyRobot
    head: dict
    noise_std: np.ndarray
    notes: list[str]
    lacks_library: bool


def set_up(model: str | os.PathLike | mujoco.MjSpec, options: Options) -> Ready:
    """Read and check the model, try it, and make its recorder."""
    notes: list[str] = []
    source = scene.read(model, options.plugin)
    given = source.compiled()
    scene.refuse_nan(given)
    period = scene.sample_period(given, options.sample_period)
    found = water.instances(source, given)
    base = scene.base_body(given, options.body, [instance.body for instance in found])
    bases = [b for b in range(given.nbody) if _is_free(given, b)]
    if options.body is None and len(bases) > 1:
        names = listed([name_of(given, b) for b in bases if b != base])
        notes.append(f"body `{name_of(given, base)}` is recorded; other bodies with a free joint: {names}")
    wet = water.find(source, given, options.water, options.buoyancy)
    density = _density(given, wet, options.density)
    tree = below(given, base)
    joints, balls = scene.joints_below(given, base)
    if balls:
        notes.append(f"ball joints are no features, so the model does not know their angles: {listed(balls)}")
    layout = Layout(joints, scene.base(given, base), has_density=options.density is not None)
    notes += _says(wet)

    named = options.plugin or built_library()
    library = named if found and named.is_file() else None
    model_spec = source.spec.copy()
    water.at_rest(model_spec, wet)
    _prepare(model_spec, options.contacts)
    compiled = source.compiled(model_spec)
    if not options.contacts and _can_touch(given):
        notes.append("contacts are off: bodies do not touch each other or the ground")
    buoyant = any(wet.learns(effect) and effect.get("effect") in water.BUOYANCY for effect in wet.effects)
    if options.buoyancy and not buoyant and not np.any(given.body_gravcomp[tree]):
        raise DataError("buoyancy is asked for, but the robot has neither gravcomp nor effects of buoyancy")
    system = System(
        Compiled(compiled, library),
        period,
        base,
        layout,
        has_fluid=wet.has_fluid,
        lift=_lift(compiled, tree) if options.buoyancy else None,
        meter=water.gauge(source, given, wet, base, tree, library) if wet.has_effects else None,
        still_meter=water.gauge(source, given, wet, base, tree, library, still=True) if buoyant else None,
        bounds=recorder.bounds(recorder.length(given, base)),
    )
    driven, guessed = drives.find(compiled, joints, tree)
    if guessed:
        notes.append(recorder.warn_of_guesses(guessed))
    if not driven:
        notes.append("no actuator moves the robot: it is pushed alone")
    robot = Robot(
        layout.base,
        joints,
        tuple(driven),
        _ranges(compiled, joints),
        compiled.qpos0.copy(),
        compiled.nv,
        compiled.nu,
        is_closed=_is_closed(compiled),
    )
    middle = float(np.mean(density))
    sizes, limits = recorder.scales(system, robot, middle, effort=options.effort, frequency=options.frequency)
    notes += limits
    maker = AnyRobot(system, robot, sizes, options.seed, options.samples, density)
    tried = recorder.pilot(maker)
    weight = 9.81 * float(given.body_subtreemass[base])
    varying, std = recorder.outputs(tried, layout.base.outputs, recorder.length(given, base), weight)
    constant = [OUTPUTS[i] for i in layout.base.outputs if i not in varying]
    if constant:
        notes.append(f"these components of the wrench never change and are no outputs: {listed(constant)}")
    system = replace(system, outputs=varying)
    maker = replace(maker, system=system)
    links, why = _links(compiled, wet, base)
    if why:
        notes.append(f"the manifest has no `kinematics` ({why}): --encoding links is not to be had")
    head = {
        "features": layout.names(),
        "feature_units": layout.units(),
        "outputs": [OUTPUTS[i] for i in varying],
        "output_units": [OUTPUT_UNITS[i] for i in varying],
        "frames": FRAMES
        if isinstance(layout.base, FreeBase)
        else {k: FRAMES[k] for k in ("wrench", "linear_velocity")},
        **({"kinematics": links} if links else {}),
        "sample_period": period,
        "physics_timestep": compiled.opt.timestep,
        "samples": options.samples,
        "seed": options.seed,
        "generator": f"hydro_mujoco.record {__version__}",
        "mujoco": mujoco.__version__,
        "numpy": np.__version__,
        "model": source.name,
        "model_sha256": _fingerprint(compiled),
        "body": name_of(given, base),
        "water": water.described(wet),
        **({"density": list(density)} if wet.has_fluid else {}),
        "contacts": options.contacts,
        "excitation": sizes.recorded(),
        "perturbation": options.noise,
        "wrench_std": [float(std[i]) for i in varying],
        "notes": notes,
    }
    noise = options.noise * std[list(varying)]
    return Ready(maker, head, noise, notes, lacks_library=bool(found) and library is None)


def _can_touch(model: mujoco.MjModel) -> bool:
    """True where two bodies have geoms that collide, and contacts are on."""
    touching = model.geom_bodyid[(model.geom_contype != 0) | (model.geom_conaffinity != 0)]
    return len(set(touching)) > 1 and not model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_CONTACT)


def _is_free(model: mujoco.MjModel, body: int) -> bool:
    first, count = model.body_jntadr[body], model.body_jntnum[body]
    return bool(count) and int(model.jnt_type[first]) == scene.FREE


def _density(model: mujoco.MjModel, wet: Water, asked: tuple[float, float] | None) -> tuple[float, float]:
    """Lowest and highest density of the water [kg/m^3]."""
    if asked is None:
        return (float(model.opt.density),) * 2
    if wet.has_effects:
        raise DataError("the density can be varied in MuJoCo's own fluid alone, not with effects: leave density out")
    if model.opt.density <= 0:
        raise DataError("the fluid's density is 0 in the model, so it cannot be varied")
    return asked


def _says(wet: Water) -> list[str]:
    """Notes on the water."""
    notes = []
    effects = [str(effect.get("effect")) for effect in wet.effects]
    still = {str(effect.get("effect")) for effect in wet.effects if not wet.learns(effect)}
    beside = sorted(still & (water.NEEDS_MORE | water.BUOYANCY))
    if wet.has_effects and beside:
        notes.append(f"not in the label, to be kept beside the checkpoint: {', '.join(beside)}")
    moving = sorted({name for name in effects if name in water.MOVES_WATER})
    moving += [key for i in wet.instances for key in water.MOVING if key in i.config and key not in moving]
    if moving:
        notes.append(f"recorded in water at rest, to be kept beside the checkpoint: {', '.join(moving)}")
    if any(water.SURFACE in instance.config for instance in wet.instances):
        notes.append("the label is that of a submerged body; a waterline fades the checkpoint when it is loaded")
    return notes


def _prepare(spec: mujoco.MjSpec, contacts: bool) -> None:
    """Options of a recording: sensors cost time and feed nothing back."""
    disable, enable = mujoco.mjtDisableBit, mujoco.mjtEnableBit
    spec.option.disableflags |= int(disable.mjDSBL_SENSOR) | (0 if contacts else int(disable.mjDSBL_CONTACT))
    spec.option.enableflags &= ~int(enable.mjENBL_SLEEP)


def _lift(model: mujoco.MjModel, tree: list[int]) -> Lift:
    """`gravcomp` of the robot in proportion to the density, where the fluid has one."""
    by_density = np.zeros(model.nbody)
    if model.opt.density > 0:
        by_density[tree] = model.body_gravcomp[tree] / model.opt.density
    return Lift(model.body_gravcomp - by_density * model.opt.density, by_density)


def _ranges(model: mujoco.MjModel, joints: tuple[Joint, ...]) -> np.ndarray:
    """Limits of the joints [nj, 2]."""
    out = np.full((len(joints), 2), [-np.inf, np.inf])
    for i, joint in enumerate(joints):
        number = model.joint(joint.name).id
        if model.jnt_limited[number]:
            out[i] = model.jnt_range[number]
    return out


def _is_closed(model: mujoco.MjModel) -> bool:
    """True where an equality constraint ties joints together."""
    return bool(np.any(model.eq_active0))


def _links(model: mujoco.MjModel, wet: Water, base: int) -> tuple[dict | None, str]:
    """The tree of wet links, or why there is none."""
    places: dict[int, tuple[list[float], list[float]]] = {}
    boxes = kinematics.boxes(model, base)
    if wet.has_fluid:
        places |= boxes | kinematics.hulls(model, base)
    if wet.has_effects:
        names = {effect.get("target") for effect in wet.effects if wet.learns(effect)}
        carriers = {instance.body for instance in wet.instances if instance.has_checkpoint}
        places |= {b: box for b, box in boxes.items() if b in carriers or name_of(model, b) in names}
    # What hangs between wet bodies is a link too.
    for body in list(places):
        while (body := int(model.body_parentid[body])) and body != base:
            places.setdefault(body, ([0.0] * 3, [1.0, 0.0, 0.0]))
    try:
        return kinematics.tree(model, base, places), ""
    except DataError as error:
        return None, str(error)


def _fingerprint(model: mujoco.MjModel) -> str:
    """sha256 of the compiled model, whatever files it came from."""
    content = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, content)
    return hashlib.sha256(content.tobytes()).hexdigest()
