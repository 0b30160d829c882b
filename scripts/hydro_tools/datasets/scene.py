"""A scene of B1 in MuJoCo's own water, and how its density is changed."""

import hashlib
import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import mujoco
import numpy as np

from hydro_mujoco.reading import check
from hydro_mujoco.recording.features import FreeBase, Joint, Layout
from hydro_mujoco.recording.system import Compiled, Lift, System

from ..repository import ROOT
from . import DataError

#: The truth of Task 2, relative to the repository.
TRUTH = "mjcf/b1_truth.xml"
#: Seconds between samples.
SAMPLE_PERIOD = 0.01
#: Body whose frame is the base frame.
BASE = "trunk"
#: Suffix of the bodies through which buoyancy acts (`gravcomp`).
BUOYANCY = "_buoyancy"


@dataclass(frozen=True)
class Scene:
    """A loaded truth scene; `path` as the user gave it, relative ones being looked up in the repository."""

    path: str
    sha256: str
    model: mujoco.MjModel
    joints: tuple[str, ...]

    @cached_property
    def layout(self) -> Layout:
        """The 35 features."""
        joints = tuple(Joint(name, 7 + i, 6 + i) for i, name in enumerate(self.joints))
        return Layout(joints, FreeBase(0, 0), has_density=True)

    @cached_property
    def system(self) -> System:
        """The scene, as it is recorded: its fluid and its buoyancy are the water."""
        fixed = lift_at(self.model, np.float64(0.0))
        return System(
            Compiled(self.model),
            SAMPLE_PERIOD,
            self.model.body(BASE).id,
            self.layout,
            lift=Lift(fixed, lift_at(self.model, np.float64(1.0)) - fixed),
        )

    @property
    def joint_range(self) -> np.ndarray:
        """Limits of the joints, [nj, 2] rad."""
        return self.model.jnt_range[1:].copy()


def find(path: str) -> Path:
    """`path` from the working directory, else from the repository: a file that is no larger than a text may be."""
    for candidate in (Path(path), ROOT / path):
        if os.path.exists(candidate):
            check(candidate, f"model {path}")
            return candidate
    raise DataError(f"model {path}: no such file, neither in {Path.cwd()} nor in {ROOT}")


def load(path: str = TRUTH) -> Scene:
    """Load and check a scene: a free joint on `trunk` first, then hinges, each with the servo of its name."""
    file = find(path)
    try:
        model = mujoco.MjModel.from_xml_path(str(file))
    except ValueError as error:
        raise DataError(f"model {path}: {error}") from error
    if model.njnt == 0 or model.jnt_type[0] != mujoco.mjtJoint.mjJNT_FREE or model.body(1).name != BASE:
        raise DataError(f"model {path}: expected a body `{BASE}` with a free joint as the first body")
    joints = tuple(model.joint(i).name for i in range(1, model.njnt))
    servos = tuple(model.actuator(i).name for i in range(model.nu))
    if servos != joints:
        raise DataError(f"model {path}: expected one servo a joint, {list(joints)}; found {list(servos)}")
    substeps = SAMPLE_PERIOD / model.opt.timestep
    if abs(substeps - round(substeps)) > 1e-9:
        raise DataError(
            f"model {path}: its timestep {model.opt.timestep} s does not divide the sample period {SAMPLE_PERIOD} s"
        )
    # Sensors cost time and feed nothing back.
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SENSOR
    return Scene(path, hashlib.sha256(file.read_bytes()).hexdigest(), model, joints)


def lift_at(model: mujoco.MjModel, density: np.ndarray) -> np.ndarray:
    """`body_gravcomp` [..., nbody] of `model` (as loaded) in water of `density` [...] kg/m^3."""
    if model.opt.density <= 0:
        raise DataError("the scene has no fluid (option density is 0): its buoyancy cannot be scaled")
    scale = np.ones((*np.shape(density), model.nbody))
    floats = [i for i in range(model.nbody) if model.body(i).name.endswith(BUOYANCY)]
    scale[..., floats] = np.asarray(density)[..., None] / model.opt.density
    return scale * model.body_gravcomp


def set_density(model: mujoco.MjModel, density: float) -> None:
    """Change the water of one model: drag (`opt.density`) and buoyancy (`body_gravcomp`)."""
    model.body_gravcomp[:] = lift_at(model, np.asarray(density))
    model.opt.density = density
