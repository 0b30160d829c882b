"""What of a model a mapping names: sensors, actuators, joints, free bodies."""

import os
from dataclasses import dataclass

import mujoco
import numpy as np

from ..record.scene import read
from .units import ACCELERATION, ANGLE, ATTITUDE, FIELD, FORCE, LENGTH, RATE, TORQUE, VELOCITY

_SENSOR = mujoco.mjtSensor
#: Type of a sensor -> quantity, and the kind of frame that it reads in.
_QUANTITIES = {
    _SENSOR.mjSENS_ACCELEROMETER: (ACCELERATION, "body"),
    _SENSOR.mjSENS_VELOCIMETER: (VELOCITY, "body"),
    _SENSOR.mjSENS_GYRO: (RATE, "body"),
    _SENSOR.mjSENS_FORCE: (FORCE, "body"),
    _SENSOR.mjSENS_TORQUE: (TORQUE, "body"),
    _SENSOR.mjSENS_MAGNETOMETER: (FIELD, "body"),
    _SENSOR.mjSENS_TOUCH: (FORCE, None),
    _SENSOR.mjSENS_RANGEFINDER: (LENGTH, None),
    _SENSOR.mjSENS_TENDONPOS: (LENGTH, None),
    _SENSOR.mjSENS_TENDONVEL: (VELOCITY, None),
    _SENSOR.mjSENS_BALLQUAT: (ATTITUDE, "attitude"),
    _SENSOR.mjSENS_BALLANGVEL: (RATE, "body"),
    _SENSOR.mjSENS_FRAMEPOS: (LENGTH, "world"),
    _SENSOR.mjSENS_FRAMEQUAT: (ATTITUDE, "attitude"),
    _SENSOR.mjSENS_FRAMEXAXIS: (None, "world"),
    _SENSOR.mjSENS_FRAMEYAXIS: (None, "world"),
    _SENSOR.mjSENS_FRAMEZAXIS: (None, "world"),
    _SENSOR.mjSENS_FRAMELINVEL: (VELOCITY, "world"),
    _SENSOR.mjSENS_FRAMEANGVEL: (RATE, "world"),
    _SENSOR.mjSENS_FRAMELINACC: (ACCELERATION, "world"),
    _SENSOR.mjSENS_SUBTREECOM: (LENGTH, "world"),
    _SENSOR.mjSENS_SUBTREELINVEL: (VELOCITY, "world"),
}
#: By the joint's type: slide, then hinge.
_JOINT_QUANTITIES = {
    _SENSOR.mjSENS_JOINTPOS: (LENGTH, ANGLE),
    _SENSOR.mjSENS_JOINTVEL: (VELOCITY, RATE),
    _SENSOR.mjSENS_JOINTACTFRC: (FORCE, TORQUE),
}
_HINGE, _SLIDE, _FREE = (
    int(kind) for kind in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_FREE)
)


@dataclass(frozen=True)
class Sensor:
    """A sensor. quantity: None for any unit; frame: `body`, `world`, `attitude`, or None for a single number.

    body: that it is on, -1 for none; axes: rotation (3, 3) from its own to those of that body.
    """

    name: str
    type: str
    dim: int
    quantity: str | None
    frame: str | None
    noise: float
    body: int
    axes: np.ndarray

    @property
    def turns(self) -> bool:
        """Whether a log's velocity may be of the world for one of a body, or the other way: an attitude turns it."""
        return (self.type, self.frame) in (("velocimeter", "body"), ("framelinvel", "world"))


@dataclass(frozen=True)
class Actuator:
    """An actuator; low and high: its range of control, infinite where it is not limited."""

    name: str
    low: float
    high: float


@dataclass(frozen=True)
class Joint:
    """A hinge or slide: places in qpos and qvel, quantity of its position and velocity."""

    name: str
    qpos: int
    qvel: int
    quantities: tuple[str, str]


@dataclass(frozen=True)
class Model:
    """A nominal model, and what of it can be mapped, by name. free: places in qpos and qvel of free bodies."""

    compiled: mujoco.MjModel
    name: str
    sensors: dict[str, Sensor]
    actuators: dict[str, Actuator]
    joints: dict[str, Joint]
    free: dict[str, tuple[int, int]]

    @property
    def timestep(self) -> float:
        """Step [s]."""
        return float(self.compiled.opt.timestep)


def load(model: str | os.PathLike | mujoco.MjSpec) -> Model:
    """Read an MJCF, or take a spec.

    Raises:
        DataError: it cannot be read or compiled.
    """
    source = read(model)
    compiled = source.compiled()
    data = mujoco.MjData(compiled)
    mujoco.mj_kinematics(compiled, data)
    sensors = [_sensor(compiled, data, number) for number in range(compiled.nsensor)]
    joints = [_joint(compiled, j) for j in range(compiled.njnt) if compiled.jnt_type[j] in (_HINGE, _SLIDE)]
    actuators = [_actuator(compiled, number) for number in range(compiled.nu)]
    free = {
        compiled.body(compiled.jnt_bodyid[j]).name: (int(compiled.jnt_qposadr[j]), int(compiled.jnt_dofadr[j]))
        for j in range(compiled.njnt)
        if compiled.jnt_type[j] == _FREE
    }
    return Model(
        compiled,
        source.name,
        {sensor.name: sensor for sensor in sensors if sensor.name},
        {actuator.name: actuator for actuator in actuators},
        {joint.name: joint for joint in joints if joint.name},
        free,
    )


def _sensor(model: mujoco.MjModel, data: mujoco.MjData, number: int) -> Sensor:
    kind, about = _SENSOR(int(model.sensor_type[number])), int(model.sensor_objid[number])
    quantity, frame = _QUANTITIES.get(kind, (None, None))
    if kind in _JOINT_QUANTITIES:
        quantity = _JOINT_QUANTITIES[kind][int(model.jnt_type[about] == _HINGE)]
    if kind == _SENSOR.mjSENS_ACTUATORFRC:
        quantity = None
    if frame == "world" and model.sensor_refid[number] >= 0:
        # Read in the frame of its reference.
        frame = "body"
    name = kind.name.removeprefix("mjSENS_").lower()
    return Sensor(
        model.sensor(number).name,
        name,
        int(model.sensor_dim[number]),
        quantity,
        frame,
        float(model.sensor_noise[number]),
        *_mount(model, data, int(model.sensor_objtype[number]), about),
    )


def _mount(model: mujoco.MjModel, data: mujoco.MjData, kind: int, about: int) -> tuple[int, np.ndarray]:
    """The body that an element is on, and the rotation from the element's axes to the body's; -1 where it has none."""
    objects = mujoco.mjtObj
    if kind == objects.mjOBJ_XBODY:
        body, axes = about, data.xmat[about]
    elif kind == objects.mjOBJ_BODY:
        body, axes = about, data.ximat[about]
    elif kind == objects.mjOBJ_GEOM:
        body, axes = int(model.geom_bodyid[about]), data.geom_xmat[about]
    elif kind == objects.mjOBJ_SITE:
        body, axes = int(model.site_bodyid[about]), data.site_xmat[about]
    elif kind == objects.mjOBJ_CAMERA:
        body, axes = int(model.cam_bodyid[about]), data.cam_xmat[about]
    else:
        return -1, np.eye(3)
    return body, data.xmat[body].reshape(3, 3).T @ axes.reshape(3, 3)


def _joint(model: mujoco.MjModel, number: int) -> Joint:
    hinge = model.jnt_type[number] == _HINGE
    return Joint(
        model.joint(number).name,
        int(model.jnt_qposadr[number]),
        int(model.jnt_dofadr[number]),
        (ANGLE, RATE) if hinge else (LENGTH, VELOCITY),
    )


def _actuator(model: mujoco.MjModel, number: int) -> Actuator:
    low, high = model.actuator_ctrlrange[number] if model.actuator_ctrllimited[number] else (-np.inf, np.inf)
    return Actuator(model.actuator(number).name, float(low), float(high))
