"""The catalogue's force columns: for every effect the forces that a unit of each of its parameters would give.

A column is a wrench on a body (its frame, about its origin) or a generalised force. Columns of what needs a
number inside (a pole, a depth scale, a deadband, a frequency) take one in the middle of what is usual. Effects
on sensors put no force on anything: a method on force columns cannot name them.
"""

from dataclasses import dataclass

import numpy as np

from .kinematics import RATES, Body, Kinematics

AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
UNITS = {
    "linear_drag": ("N s/m", "N m s/rad"),
    "quadratic_drag": ("N s^2/m^2", "N m s^2/rad^2"),
    "added_mass": ("kg", "kg m^2"),
}
DEPTH_SCALE_M, DEADBAND, STRIPS = 0.45, 0.05, 7
SURFACE_Z_M = 0.0


@dataclass
class Column:
    """Force of one unit of one parameter. `wrench` [n, 6] on `body`, or `force` [n, nv]; `inertia` [6, 6] is
    the part of the wrench that multiplies the body's acceleration, already in `wrench` where rates are known.
    """

    effect: str
    parameter: str
    target: str
    unit: str
    body: int = -1
    wrench: np.ndarray | None = None
    force: np.ndarray | None = None
    inertia: np.ndarray | None = None


def _cross(i: int) -> np.ndarray:
    e = np.eye(3)[i]
    return np.array([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])


def _wrench(n: int, force: np.ndarray | None = None, torque: np.ndarray | None = None) -> np.ndarray:
    out = np.zeros((n, 6))
    if force is not None:
        out[:, :3] = force
    if torque is not None:
        out[:, 3:] = torque
    return out


def _inertial(b: Body, inertia: np.ndarray) -> np.ndarray:
    """-(M a + C(nu) nu) of a symmetric 6 x 6 mass matrix (Kirchhoff) [n, 6]."""
    momentum = b.nu @ inertia
    linear, angular = momentum[:, :3], momentum[:, 3:]
    v, w = b.nu[:, :3], b.nu[:, 3:]
    return -(b.rate @ inertia) - _wrench(len(v), np.cross(w, linear), np.cross(w, angular) + np.cross(v, linear))


def _body(b: Body, wave_hz: float, time: np.ndarray, floor_z: float | None, only: set[str] | None):
    """Columns of one body."""
    n, nu = len(b.nu), b.nu
    v, w = nu[:, :3], nu[:, 3:]
    up = b.rotation[:, 2, :]
    eye = np.eye(6)

    def make(effect: str, parameter: str, wrench: np.ndarray, unit: str, inertia: np.ndarray | None = None):
        return Column(effect, parameter, b.name, unit, b.index, wrench, None, inertia)

    def wanted(effect: str) -> bool:
        return only is None or effect in only

    for i in range(6):
        side = i // 3
        if wanted("linear_drag"):
            yield make("linear_drag", AXES[i], -nu[:, i : i + 1] * eye[i], UNITS["linear_drag"][side])
        if wanted("quadratic_drag"):
            yield make(
                "quadratic_drag", AXES[i], -(np.abs(nu) * nu)[:, i : i + 1] * eye[i], UNITS["quadratic_drag"][side]
            )
        if wanted("added_mass"):
            inertia = np.outer(eye[i], eye[i])
            yield make("added_mass", AXES[i], _inertial(b, inertia), UNITS["added_mass"][side], inertia)
        if wanted("wake_memory"):
            yield make("wake_memory", AXES[i], -b.memory[:, 2, i : i + 1] * eye[i], "")
        if wanted("basset_history"):
            # 1/sqrt(t) as a sum of exponentials; the integral of a exp(-rate s) is nu - rate z.
            kernel = sum(
                np.sqrt(rate) * (nu[:, i] - rate * b.memory[:, j, i]) for j, rate in enumerate(RATES) if j != 2
            )
            yield make("basset_history", AXES[i], -kernel[:, None] * eye[i], "")
    if wanted("cross_flow_drag"):
        spots = np.linspace(-0.5, 0.5, STRIPS) * b.length
        for across in [axis for axis in range(3) if axis != b.along]:
            out = np.zeros((n, 6))
            for spot in spots:
                arm = np.eye(3)[b.along] * spot
                speed = (v + np.cross(w, arm))[:, across]
                push = -(speed * np.abs(speed))[:, None] * np.eye(3)[across] / STRIPS
                out += _wrench(n, push, np.cross(arm, push))
            yield make("cross_flow_drag", AXES[across], out, "N s^2/m^2")
    if wanted("munk_moment"):
        for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
            yield make("munk_moment", AXES[3 + i], _wrench(n, None, (v[:, j] * v[:, k])[:, None] * np.eye(3)[i]), "kg")
    if wanted("lift"):
        for across in [axis for axis in range(3) if axis != b.along]:
            push = -(np.abs(v[:, b.along]) * v[:, across])[:, None] * np.eye(3)[across]
            yield make("lift", AXES[across], _wrench(n, push), "N s^2/m^2")
    if wanted("net_buoyancy"):
        yield make("net_buoyancy", "force", _wrench(n, up, np.cross(b.centre, up)), "N")
    if wanted("buoyancy_offset"):
        for i in range(3):
            yield make("buoyancy_offset", "xyz"[i], _wrench(n, None, np.cross(np.eye(3)[i], up)), "N m")
    if wanted("payload"):
        for i in range(4):
            inertia = np.zeros((6, 6))
            if i == 0:
                inertia[:3, :3] = np.eye(3)
                weight = _wrench(n, -9.81 * up)
            else:
                inertia[:3, 3:], inertia[3:, :3] = -_cross(i - 1), _cross(i - 1)
                weight = _wrench(n, None, np.cross(np.eye(3)[i - 1], -9.81 * up))
            yield make(
                "payload",
                ("mass", "mx", "my", "mz")[i],
                _inertial(b, inertia) + weight,
                "kg" if i == 0 else "kg m",
                inertia,
            )
    near = {"free_surface": np.exp(-np.maximum(SURFACE_Z_M - b.place[:, 2], 0) / DEPTH_SCALE_M)}
    if floor_z is not None:
        near["wall_proximity"] = np.exp(-np.maximum(b.place[:, 2] - floor_z, 0) / DEPTH_SCALE_M)
    for effect, closeness in near.items():
        if wanted(effect):
            for i in range(3):
                yield make(effect, AXES[i], -(closeness * np.abs(nu[:, i]) * nu[:, i])[:, None] * eye[i], "N s^2/m^2")
    for effect, factors in (
        ("constant_force", (("", np.ones(n)),)),
        ("waves", (("cos", np.cos(2 * np.pi * wave_hz * time)), ("sin", np.sin(2 * np.pi * wave_hz * time)))),
    ):
        if wanted(effect):
            for tag, factor in factors:
                # A vertical constant force is called net_buoyancy.
                for i in range(2 if effect == "constant_force" else 3):
                    yield make(effect, f"{tag}{'xyz'[i]}", _wrench(n, b.rotation[:, i, :] * factor[:, None]), "N")


def columns(
    k: Kinematics,
    actuators: list[str],
    joints: list[str],
    *,
    wave_hz: float,
    floor_z: float | None,
    scale: np.ndarray,
    only: set[str] | None = None,
) -> list[Column]:
    """Every column along a motion; `scale` [nu]: a large force of each actuator; `only`: effects wanted."""
    out = [column for b in k.bodies for column in _body(b, wave_hz, k.time, floor_z, only)]
    dead = np.clip(k.thrust, -DEADBAND * scale, DEADBAND * scale)
    per_actuator = {
        "actuator_gain": k.thrust,
        "actuator_deadband": -dead,
        "actuator_lag": k.lagged - k.thrust,
        "actuator_delay": k.delayed - k.thrust,
        "inflow_thrust_loss": -k.thrust * np.abs(k.inflow),
    }
    for effect, values in per_actuator.items():
        if only is None or effect in only:
            out += [
                Column(effect, "share", name, "1", force=values[:, i : i + 1] * k.moment[:, i])
                for i, name in enumerate(actuators)
            ]
    per_joint = {
        "joint_friction": (-np.tanh(k.velocity / 0.05), "N m"),
        "joint_damping": (-k.velocity, "N m s/rad"),
        "joint_stiffness": (-k.position, "N m/rad"),
    }
    nv = k.moment.shape[2]
    for effect, (values, unit) in per_joint.items():
        if only is None or effect in only:
            out += [
                Column(effect, "coefficient", name, unit, force=values[:, i : i + 1] * np.eye(nv)[k.dofs[i]])
                for i, name in enumerate(joints)
            ]
    return out
