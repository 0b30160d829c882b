"""A card tied to a compiled model: where its features are read, what limits them, where its outputs act."""

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np
import warp as wp

from ...errors import DataError
from ...recording.kinematics import name_of
from .card import Card

JOINT = mujoco.mjtJoint
#: Kinds of features.
POSITION, VELOCITY, QUATERNION, ANGULAR, LINEAR, DENSITY = range(6)
VELOCITIES = (VELOCITY, ANGULAR, LINEAR)
AXES, PARTS = "xyz", "wxyz"


@wp.struct
class Reading:
    """Where features are read."""

    kind: wp.array[int]  # n
    place: wp.array[int]  # in qpos or qvel, or component
    quaternion: int  # first of four among the features; -1 without
    density: float  # [kg/m^3]
    body: int
    row: int
    water: int
    free_qpos: int  # of the base's free joint; -1 where slides alone hold it
    free_dof: int
    attitude: wp.quat  # of a base on slides, world from base
    slide_dof: wp.array[int]
    slide_axis: wp.array[wp.vec3]  # world


@wp.struct
class Limits:
    """What holds the network to its range (crates/model/src/envelope.rs)."""

    least: wp.array[float]  # of each feature
    most: wp.array[float]
    least_force: wp.array[float]  # of each output [N, N m]
    most_force: wp.array[float]
    drag_at: wp.array[int]  # for each output, the velocity along it; -1 without
    drag_width: wp.array[float]
    drag_force: wp.array[float]


@wp.struct
class Places:
    """Where outputs act."""

    component: wp.array[int]  # of the wrench; -1: none
    dof: wp.array[int]  # -1: none
    scale: wp.array[float]


@dataclass(frozen=True)
class Feature:
    """A feature: its kind, and the joint or component that it is of."""

    kind: int
    of: str

    @property
    def component(self) -> int:
        """Number of the component of a vector or quaternion."""
        return (PARTS if self.kind == QUATERNION else AXES).index(self.of)


def feature(name: str) -> Feature:
    """A feature by its name in a card."""
    kind, _, of = name.partition(".")
    names = ("position", "velocity", "quaternion", "angular_velocity", "linear_velocity", "density")
    return Feature(names.index(kind), of)


def joint_of(model: mujoco.MjModel, card: Card, names: list[str], joint: str) -> int:
    """Number of a card's joint in a model; names: what the card's are called there, if otherwise."""
    name = names[card.joints.index(joint)] if names and joint in card.joints else joint
    return int(model.joint(name).id)


Put = Callable[[object, type], wp.array]


def reading(model: mujoco.MjModel, card: Card, names: list[str], *, body: int, density: float, put: Put) -> Reading:
    """Where a card's features are read; `row` and `water` are left to the caller.

    Raises:
        DataError: a joint between the base and the world is neither free nor a slide, though a feature is of the base.
    """
    features = [feature(name) for name in card.features]
    place = []
    for each in features:
        if each.kind in (POSITION, VELOCITY):
            joint = joint_of(model, card, names, each.of)
            place.append(int((model.jnt_qposadr if each.kind == POSITION else model.jnt_dofadr)[joint]))
        else:
            place.append(0 if each.kind == DENSITY else each.component)
    out = Reading()
    kinds = [each.kind for each in features]
    out.kind, out.place = put(kinds, int), put(place, int)
    out.quaternion = kinds.index(QUATERNION) if QUATERNION in kinds else -1
    out.density, out.body = density, body
    needs_base = any(kind in (QUATERNION, ANGULAR, LINEAR) for kind in kinds)
    _put_base(out, model, body, needs_base, put)
    return out


def _put_base(out: Reading, model: mujoco.MjModel, body: int, needs_base: bool, put: Put) -> None:
    attitude, dofs, axes = np.array([1.0, 0, 0, 0]), [], []
    out.free_qpos = out.free_dof = -1
    chain = [body]
    while chain[0]:
        chain.insert(0, int(model.body_parentid[chain[0]]))
    for link in chain[1:]:
        turned = np.zeros(4)
        mujoco.mju_mulQuat(turned, attitude, model.body_quat[link])
        attitude = turned
        for joint in range(model.body_jntadr[link], model.body_jntadr[link] + model.body_jntnum[link]):
            kind = JOINT(model.jnt_type[joint])
            if kind == JOINT.mjJNT_FREE:
                out.free_qpos, out.free_dof = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
            elif kind == JOINT.mjJNT_SLIDE:
                axis = np.zeros(3)
                mujoco.mju_rotVecQuat(axis, model.jnt_axis[joint], attitude)
                dofs.append(int(model.jnt_dofadr[joint]))
                axes.append(axis)
            elif needs_base:
                name = model.joint(joint).name
                raise DataError(f"joint `{name}` lies between body `{name_of(model, body)}` and the world")
    w, x, y, z = attitude
    out.attitude = wp.quat(float(x), float(y), float(z), float(w))
    out.slide_dof = put(np.array(dofs, dtype=int), int)
    out.slide_axis = put(np.reshape(axes, (-1, 3)), wp.vec3)


def limits(card: Card, put: Put) -> Limits:
    """What holds a card's network to its range: velocities, forces, and a drag beyond."""
    features = [feature(name) for name in card.features]
    is_velocity = np.array([each.kind in VELOCITIES for each in features])
    # Rest counts as inside.
    least = np.where(is_velocity, np.minimum(card.range[0], 0), -np.inf)
    most = np.where(is_velocity, np.maximum(card.range[1], 0), np.inf)
    at, width = [], []
    for name in card.outputs:
        along = _velocity_along(name)
        kind = [each.kind == along.kind for each in features]
        widest = float(0.5 * np.max((most - least)[kind], initial=0.0))
        is_there = along in features and 0 < widest < np.inf
        at.append(features.index(along) if is_there else -1)
        width.append(widest if is_there else 1.0)
    out = Limits()
    out.least, out.most = put(least, float), put(most, float)
    out.least_force, out.most_force = put(card.forces[0], float), put(card.forces[1], float)
    out.drag_at, out.drag_width = put(at, int), put(width, float)
    out.drag_force = put(np.abs(card.forces).max(axis=0), float)
    return out


def _velocity_along(output: str) -> Feature:
    """The velocity along an output."""
    kind, _, of = output.partition(".")
    return Feature({"force": LINEAR, "torque": ANGULAR, "joint_torque": VELOCITY}[kind], of)


def places(model: mujoco.MjModel, card: Card, names: list[str], outputs: str, scale: np.ndarray, put: Put) -> Places:
    """Where a card's outputs act.

    Args:
        names: of the card's joints in the model, if otherwise.
        outputs: attribute of that name; `wrench` leaves torques of joints out.
        scale: factors on the components of the wrench, shape (6,).
    """
    component, dof, factor = [], [], []
    for name in card.outputs:
        kind, _, of = name.partition(".")
        if kind == "joint_torque":
            joint = joint_of(model, card, names, of)
            component.append(-1)
            dof.append(-1 if outputs == "wrench" else int(model.jnt_dofadr[joint]))
            factor.append(1.0)
        else:
            component.append(AXES.index(of) + (3 if kind == "torque" else 0))
            dof.append(-1)
            factor.append(float(scale[component[-1]]))
    out = Places()
    out.component, out.dof, out.scale = put(component, int), put(dof, int), put(factor, float)
    return out
