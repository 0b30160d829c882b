"""Velocities, attitudes and thrusts of the nominal along a motion, from which force columns are made."""

from dataclasses import dataclass, field

import mujoco
import numpy as np

#: Decay rates [1/s] of the memory states z' = -rate z + nu.
RATES = np.array([0.1, 0.5, 1.5, 2.5, 12.5])
LAG_S, DELAY_S = 0.1, 0.06


@dataclass
class Body:
    """A body that water may act on, along n rows, in its own frame about its origin.

    rotation [n, 3, 3] world_from_body; place [n, 3] m, world; nu [n, 6] and rate [n, 6]: linear, then angular
    velocity and their derivatives by time; jacobian [n, 6, nv]; memory [n, len(RATES), 6].
    """

    index: int
    name: str
    length: float
    along: int
    centre: np.ndarray
    rotation: np.ndarray
    place: np.ndarray
    nu: np.ndarray
    rate: np.ndarray
    jacobian: np.ndarray
    memory: np.ndarray


@dataclass
class Kinematics:
    """All of a motion. thrust, lagged, delayed [n, nu]: actuator forces; inflow [n, nu] m/s (0 for a joint's);
    moment [n, nu, nv]; time [n] s; position, velocity: hinge and slide joints [n, joints].
    """

    time: np.ndarray
    bodies: list[Body]
    thrust: np.ndarray
    lagged: np.ndarray
    delayed: np.ndarray
    inflow: np.ndarray
    moment: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    dofs: list[int] = field(default_factory=list)


def targets(model: mujoco.MjModel) -> list[int]:
    """Bodies that are asked about: that on the free joint; else every jointed body, or the heaviest of many."""
    for joint in range(model.njnt):
        if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE:
            return [int(model.jnt_bodyid[joint])]
    jointed = sorted({int(body) for body in model.jnt_bodyid})
    if len(jointed) <= 3:
        return jointed
    return [int(np.argmax(model.body_mass))]


def single_joints(model: mujoco.MjModel) -> list[int]:
    """Hinges and slides."""
    return [
        j
        for j in range(model.njnt)
        if int(model.jnt_type[j]) in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
    ]


def shape(model: mujoco.MjModel, body: int) -> tuple[float, int]:
    """Length [m] and axis of the longest side of a body's largest geom."""
    geoms = [g for g in range(model.ngeom) if model.geom_bodyid[g] == body]
    if not geoms:
        return 0.5, 0
    size = max((model.geom_aabb[g, 3:] for g in geoms), key=lambda half: float(np.prod(half)))
    return float(2 * size.max()), int(size.argmax())


class Observer:
    """Reads one state of MuJoCo into the quantities of a row."""

    def __init__(self, model: mujoco.MjModel):
        self.model = model
        self.bodies = targets(model)
        self.shapes = [shape(model, body) for body in self.bodies]
        self.joints = single_joints(model)
        self.dofs = [int(model.jnt_dofadr[j]) for j in self.joints]
        self.addresses = [int(model.jnt_qposadr[j]) for j in self.joints]
        self.by_site = model.actuator_trntype == mujoco.mjtTrn.mjTRN_SITE
        self.gear = np.abs(model.actuator_gear).max(axis=1) if model.nu else np.zeros(0)

    def row(self, data: mujoco.MjData):
        """(bodies' (R, p, nu, J), thrust, moment, inflow) at a forwarded state."""
        model, bodies = self.model, []
        for body in self.bodies:
            turn = data.xmat[body].reshape(3, 3)
            linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))
            mujoco.mj_jacBody(model, data, linear, angular, body)
            jacobian = np.concatenate([turn.T @ linear, turn.T @ angular])
            bodies.append((turn.copy(), data.xpos[body].copy(), jacobian @ data.qvel, jacobian))
        moment = np.zeros((model.nu, model.nv))
        if model.nu:
            mujoco.mju_sparse2dense(
                moment, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind
            )
        inflow = np.where(self.by_site, data.actuator_velocity / np.maximum(self.gear, 1e-9), 0.0)
        return bodies, data.actuator_force.copy(), moment, inflow


def _filtered(values: np.ndarray, rate: float, period: float, first: np.ndarray) -> np.ndarray:
    """z' = -rate z + values, from z = first, exactly for values that hold over a row [n, ...]."""
    keep = np.exp(-rate * period)
    take = (1 - keep) / rate
    out, state = np.empty_like(values), first
    for k, value in enumerate(values):
        out[k] = state
        state = keep * state + take * value
    return out


def along(model: mujoco.MjModel, data: mujoco.MjData, motion) -> Kinematics:
    """Kinematics of the nominal along a motion."""
    observer = Observer(model)
    rows, thrusts, moments, inflows = [], [], [], []
    for q, v, u in zip(motion.qpos, motion.qvel, motion.control):
        data.qpos[:], data.qvel[:], data.ctrl[:] = q, v, u
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_fwdActuation(model, data)
        bodies, thrust, moment, inflow = observer.row(data)
        rows.append(bodies)
        thrusts.append(thrust)
        moments.append(moment)
        inflows.append(inflow)
    found = []
    for i, body in enumerate(observer.bodies):
        turn, place, nu, jacobian = (np.stack([row[i][part] for row in rows]) for part in range(4))
        memory = np.stack([_filtered(nu, rate, motion.period, np.zeros(6)) for rate in RATES], 1)
        found.append(
            Body(
                body,
                model.body(body).name,
                *observer.shapes[i],
                model.body_ipos[body].copy(),
                turn,
                place,
                nu,
                np.gradient(nu, motion.period, axis=0),
                jacobian,
                memory,
            )
        )
    thrust = np.stack(thrusts)
    shift = max(1, round(DELAY_S / motion.period))
    delayed = np.concatenate([np.repeat(thrust[:1], shift, 0), thrust[:-shift]])
    lagged = _filtered(thrust, 1 / LAG_S, motion.period, thrust[0] * LAG_S) / LAG_S
    return Kinematics(
        motion.time,
        found,
        thrust,
        lagged,
        delayed,
        np.stack(inflows),
        np.stack(moments),
        motion.qpos[:, observer.addresses] - model.qpos0[observer.addresses],
        motion.qvel[:, observer.dofs],
        observer.dofs,
    )
