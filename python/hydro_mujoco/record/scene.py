"""A model as its user gives it: read, its base body found, its joints listed."""

import math
import os
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from ..errors import DataError
from ..plugin import WRENCH, built_library, load_plugin
from ..reading import check
from ..recording.features import Carriage, FreeBase, Joint
from ..recording.kinematics import below, name_of

#: Seconds between samples, where nothing else is asked for.
SAMPLE_PERIOD = 0.01
#: Folders above an MJCF's own in which `models` is looked for.
ABOVE = 3
#: Names that a message lists at most.
LISTED = 12

#: Fields in which a NaN of an MJCF may end.
NUMBERS = (
    *("qpos0", "body_mass", "body_inertia", "body_pos", "body_quat", "body_ipos", "body_gravcomp"),
    *("jnt_pos", "jnt_axis", "jnt_stiffness", "jnt_range", "dof_damping", "dof_armature", "dof_frictionloss"),
    *("geom_pos", "geom_size", "geom_fluid", "site_pos", "actuator_gear", "actuator_gainprm", "actuator_biasprm"),
    *("actuator_ctrlrange", "actuator_forcerange"),
)

FREE, BALL, SLIDE, HINGE = (
    int(kind)
    for kind in (
        mujoco.mjtJoint.mjJNT_FREE,
        mujoco.mjtJoint.mjJNT_BALL,
        mujoco.mjtJoint.mjJNT_SLIDE,
        mujoco.mjtJoint.mjJNT_HINGE,
    )
)


@dataclass(frozen=True)
class Source:
    """A spec, the name to call it by, and the folder that its files are relative to."""

    spec: mujoco.MjSpec
    name: str
    folder: Path

    def compiled(self, spec: mujoco.MjSpec | None = None) -> mujoco.MjModel:
        """The model of this spec, or of a changed copy of it."""
        try:
            return (spec or self.spec).compile()
        except ValueError as error:
            raise DataError(f"model {self.name}: {one_line(error)}") from error


def one_line(error: Exception) -> str:
    """MuJoCo's message without its line breaks."""
    return " ".join(str(error).split())


def listed(names: list[str]) -> str:
    """Names in a message; "none" where there are none."""
    shown = ", ".join(f"`{name}`" for name in names[:LISTED])
    return shown + (f", ... ({len(names)} in all)" if len(names) > LISTED else "") if names else "none"


def read(model: str | os.PathLike | mujoco.MjSpec, library: Path | None = None) -> Source:
    """Read an MJCF, or take a copy of a spec. The plugin library is loaded where the model asks for it."""
    if isinstance(model, mujoco.MjSpec):
        return Source(model.copy(), model.modelname or "(a spec)", Path(model.modelfiledir or "."))
    path = Path(model)
    check(path, f"model {path}")
    try:
        spec = _parsed(path, library)
    except ValueError as error:
        raise DataError(f"model {path}: {one_line(error)}") from error
    folder = path.resolve().parent
    for plugin in spec.plugins:
        if plugin.plugin_name == WRENCH:
            plugin.config = {key: _absolute(key, value, folder) for key, value in dict(plugin.config).items()}
    return Source(spec, path.name, folder)


def _absolute(key: str, value: str, folder: Path) -> str:
    """A path that an attribute gives, absolute where the plugin, which is not told the MJCF's folder, would miss it."""
    value = value.strip()
    if key not in ("checkpoint", "effects") or not value or value.startswith("{") or Path(value).is_absolute():
        return value
    known = [Path(place) for place in os.environ.get("HYDRO_PATH", "").split(":") if place]
    if any((place / value).exists() for place in (*known, Path.cwd(), built_library().parent)):
        return value
    project = next((place for place in [folder, *folder.parents][: ABOVE + 1] if (place / "models").is_dir()), folder)
    places = [folder / value, project / value, project / "models" / value]
    return next((str(place) for place in places if place.exists()), value)


def _parsed(path: Path, library: Path | None) -> mujoco.MjSpec:
    try:
        return mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        if "plugin hydro." not in str(error):
            raise
    load_plugin(library)
    return mujoco.MjSpec.from_file(str(path))


def refuse_nan(model: mujoco.MjModel) -> None:
    """Refuse a model with a number that is none, which MuJoCo itself only warns of."""
    for field in NUMBERS:
        if np.any(np.isnan(getattr(model, field))):
            raise DataError(f"the model's {field} holds a number that is not finite (nan)")


def sample_period(model: mujoco.MjModel, asked: float | None) -> float:
    """A multiple of the model's timestep: the one asked for, else the one nearest to SAMPLE_PERIOD [s]."""
    step = model.opt.timestep
    if not (math.isfinite(step) and step > 0):
        raise DataError(f"the model's timestep is {step:g} s; expected a positive time: <option timestep=...>")
    steps = max(1, round((asked or SAMPLE_PERIOD) / step))
    period = round(steps * step, 12)
    if asked is not None and abs(period - asked) > 1e-9 * max(1.0, asked / step):
        near = sorted({max(1, math.floor(asked / step)), math.ceil(asked / step)})
        raise DataError(
            f"a sample period of {asked:g} s is no multiple of the model's timestep of {step:g} s; "
            f"nearest: {' and '.join(f'{n * step:g} s' for n in near)}"
        )
    return period


def base_body(model: mujoco.MjModel, asked: str | None, preferred: list[int]) -> int:
    """Number of the body whose motion is recorded.

    The one asked for, else the first of the `preferred` with a free joint, else the first with one.
    """
    free = [body for body in range(1, model.nbody) if _joints(model, body) and _kind(model, body) == FREE]
    if asked is None:
        if not free:
            sliding = [name_of(model, b) for b in range(1, model.nbody) if _slides_to_world(model, b)]
            more = f"; or name a body that slides alone hold: {listed(sliding)}" if sliding else ""
            raise DataError(
                "no body of the model has a free joint, so none floats: add <freejoint/> to the robot's first body"
                f"{more}"
            )
        return next((body for body in preferred if body in free), free[0])
    named = {name_of(model, body): body for body in range(1, model.nbody)}
    if asked not in named:
        raise DataError(f"no body is called `{asked}`; there are: {listed(list(named))}")
    body = named[asked]
    if body not in free and not _slides_to_world(model, body):
        raise DataError(
            f"body `{asked}` has no free joint, and not slides alone between it and the world; "
            f"bodies with a free joint: {listed([name_of(model, b) for b in free])}"
        )
    return body


def base(model: mujoco.MjModel, body: int) -> FreeBase | Carriage:
    """How the base moves."""
    if _joints(model, body) and _kind(model, body) == FREE:
        joint = model.body_jntadr[body]
        return FreeBase(int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint]))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    turn = data.xmat[body].reshape(3, 3)
    joints = _slides_to_world(model, body)
    ways = np.array([turn.T @ data.xaxis[joint] for joint in joints])
    if not np.allclose(ways @ ways.T, np.eye(len(ways)), atol=1e-9):
        raise DataError(f"the slides of body `{name_of(model, body)}` are not at right angles")
    # A component is felt where the slides span its whole axis.
    axes = tuple(axis for axis in range(3) if abs(np.sum(ways[:, axis] ** 2) - 1) < 1e-9)
    if not axes:
        raise DataError(f"the slides of body `{name_of(model, body)}` lie along none of its axes")
    directions = tuple((float(x), float(y), float(z)) for x, y, z in ways)
    return Carriage(tuple(int(model.jnt_dofadr[joint]) for joint in joints), directions, axes)


def joints_below(model: mujoco.MjModel, body: int) -> tuple[tuple[Joint, ...], list[str]]:
    """Hinges and slides of the bodies below the base, and the names of the ball joints, which are no features."""
    found, balls = [], []
    for link in below(model, body)[1:]:
        for joint in _joints(model, link):
            name = model.joint(joint).name
            if not name:
                raise DataError(
                    f"a joint of body `{name_of(model, link)}` has no name, and hydro.wrench finds joints by name: "
                    "give it one, <joint name=...>"
                )
            kind = int(model.jnt_type[joint])
            if kind == BALL:
                balls.append(name)
            else:
                position, velocity = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
                found.append(Joint(name, position, velocity, kind == SLIDE))
    return tuple(found), balls


def _joints(model: mujoco.MjModel, body: int) -> range:
    first = model.body_jntadr[body]
    return range(first, first + model.body_jntnum[body])


def _kind(model: mujoco.MjModel, body: int) -> int:
    return int(model.jnt_type[model.body_jntadr[body]])


def _slides_to_world(model: mujoco.MjModel, body: int) -> list[int]:
    """The joints between a body and the world where all of them are slides, and there are any; world first."""
    chain: list[int] = []
    while body != 0:
        if model.body_mocapid[body] >= 0 or any(model.jnt_type[j] != SLIDE for j in _joints(model, body)):
            return []
        chain = [*_joints(model, body), *chain]
        body = int(model.body_parentid[body])
    return chain
