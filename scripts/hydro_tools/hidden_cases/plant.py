"""The truth: M simulations in lockstep, with forces, water and actuators that the nominal lacks.

A step of length h: commands (linear between rows, sent every `lead` seconds, the logs' convention) pass the actuators'
effects; forces and moving water are evaluated at the state; inertia that the engine does not know is solved for
implicitly; then the engine steps. Everything is vectorised over the M members.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import mujoco
import numpy as np
from mujoco.batch import Batch

from . import HiddenCaseError
from .frames import cross, turned, turned_back

VEL = mujoco.mjtStage.mjSTAGE_VEL.value
ACCELERATION = mujoco.mjtStage.mjSTAGE_ACC


class Water(Protocol):
    """A nominal water that the engine does not have (the learned one of the free swimmer)."""

    def apply(self, plant: "Plant") -> None:
        """Add its wrench to `plant`."""

    def copy_members(self, members: np.ndarray) -> "Water":
        """Its memory at this moment, of some members."""


@dataclass
class BodyMotion:
    """Motion of one body's frame, M members. `nu` and `omega` in the body's frame."""

    position: np.ndarray  # [M, 3] m, world
    rotation: np.ndarray  # [M, 3, 3] world_from_base
    nu: np.ndarray  # [M, 3] m/s, relative to the water
    nu_ground: np.ndarray  # [M, 3] m/s, relative to the ground
    omega: np.ndarray  # [M, 3] rad/s


@dataclass
class Recording:
    """Record of a run. T fine steps, K rows, M members."""

    sensors: np.ndarray  # [M, T+1, ns] readings at fine steps (or rows only, see `fine`)
    times: np.ndarray  # [T+1] s since the start, of `sensors`
    commands: np.ndarray  # [M, K+1, nu] at rows
    qpos: np.ndarray  # [M, K+1, nq] at rows
    qvel: np.ndarray  # [M, K+1, nv]
    waters: dict = field(default_factory=dict)  # row -> copy of the water's memory
    act: np.ndarray = field(default_factory=lambda: np.zeros((0, 0, 0)))  # [M, K+1, na] activations at rows


class Plant:
    """See the module. `start` is the absolute time at which each member begins, [M] s."""

    def __init__(
        self,
        model: mujoco.MjModel,
        effects: Sequence,
        *,
        qpos: np.ndarray,
        qvel: np.ndarray,
        start: np.ndarray,
        water: Water | None = None,
        act: np.ndarray | None = None,
    ):
        self.model, self.effects, self.water = model, list(effects), water
        self.members = len(qpos)
        self.step_length = model.opt.timestep
        self.batch = Batch(model, self.members, 1, persistent=True)
        bind = self.batch.bind
        self.qpos, self.qvel, self.ctrl = bind("qpos"), bind("qvel"), bind("ctrl")
        self.xfrc, self.qfrc = bind("xfrc_applied"), bind("qfrc_applied")
        self.xpos, self.xmat, self.xipos = bind("xpos"), bind("xmat"), bind("xipos")
        self.cvel, self.com = bind("cvel"), bind("subtree_com")
        self.sensordata = bind("sensordata")
        self.start = np.asarray(start, float)
        self.elapsed = 0.0
        self.current = np.zeros((self.members, 3))
        self._cache: dict[int, BodyMotion] = {}
        self._middles: dict[int, np.ndarray] = {}
        self._inertial: list[tuple[int, np.ndarray, np.ndarray]] = []
        self._memory_nu: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        self.wind = None
        if any(getattr(effect, "moves_water", False) for effect in self.effects):
            self.wind = self.batch.expand("opt.wind").reshape(self.members, 3)
        self.implicit = any(getattr(effect, "implicit", False) for effect in self.effects)
        if self.implicit:
            self.qacc, self.mass_matrix = bind("qacc"), bind("M")
            self._dense = _dense_index(model)
        self.batch.reset(stage=mujoco.mjtStage.mjSTAGE_NONE.value)
        self.qpos[:], self.qvel[:] = qpos, qvel
        self.act = bind("act") if model.na else np.zeros((self.members, 0))
        if act is not None:
            self.act[:] = act
        for effect in self.effects:
            effect.begin(self)

    @property
    def time(self) -> np.ndarray:
        """Absolute time of each member [M] s."""
        return self.start + self.elapsed

    def body(self, body: int) -> BodyMotion:
        """Motion of a body at the present state."""
        if body not in self._cache:
            rotation = self.xmat[:, body].reshape(-1, 3, 3)
            position = self.xpos[:, body]
            spin, linear = self.cvel[:, body, :3], self.cvel[:, body, 3:]
            velocity = linear + cross(spin, position - self.com[:, self.model.body_rootid[body]])
            ground = turned_back(rotation, velocity)
            nu = turned_back(rotation, velocity - self.current) if self.wind is not None else ground
            self._cache[body] = BodyMotion(position, rotation, nu, ground, turned_back(rotation, spin))
        return self._cache[body]

    def hull(self, body: int) -> BodyMotion:
        """The same at the middle of the body's hull, where water acts (a link's frame stands in its joint)."""
        motion, middle = self.body(body), self.middle(body)
        if not middle.any():
            return motion
        turn = cross(motion.omega, middle)
        return BodyMotion(
            motion.position + turned(motion.rotation, np.tile(middle, (self.members, 1))),
            motion.rotation,
            motion.nu + turn,
            motion.nu_ground + turn,
            motion.omega,
        )

    def middle(self, body: int) -> np.ndarray:
        """Centre [3] m of the largest hull of a body in its frame; its origin where it has none."""
        if body not in self._middles:
            model = self.model
            hulls = [g for g in range(model.ngeom) if model.geom_bodyid[g] == body and model.geom_fluid[g, 0]]
            largest = max(hulls, key=lambda g: np.prod(model.geom_size[g]), default=None)
            if largest is None:
                # Where the nominal has no water: the geom BODY_shape, if any.
                named = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, f"{model.body(body).name}_shape")
                largest = None if named < 0 else named
            self._middles[body] = np.zeros(3) if largest is None else model.geom_pos[largest].copy()
        return self._middles[body]

    def add_hull_wrench(self, body: int, force: np.ndarray, torque: np.ndarray | None = None) -> None:
        """A wrench about the middle of a body's hull, in the body's frame."""
        about = cross(self.middle(body), force)
        self.add_wrench(body, force, about if torque is None else about + torque)

    def add_wrench(self, body: int, force: np.ndarray, torque: np.ndarray | None = None) -> None:
        """A wrench [M, 3] N, [M, 3] N m about the body's origin, in the body's frame."""
        motion = self.body(body)
        in_world = turned(motion.rotation, force)
        self.xfrc[:, body, :3] += in_world
        about = cross(motion.position - self.xipos[:, body], in_world)
        self.xfrc[:, body, 3:] += about if torque is None else about + turned(motion.rotation, torque)

    def add_world_force(self, body: int, force: np.ndarray) -> None:
        """A force [M, 3] N in the world at the body's origin."""
        self.add_wrench(body, turned_back(self.body(body).rotation, force))

    def add_inertia(self, body: int, inertia: np.ndarray, bias: np.ndarray) -> None:
        """-(inertia nu_dot + bias): inertia [M, 6, 6] about the origin in the body's frame, bias [M, 6]."""
        self._inertial.append((body, inertia, bias))

    def add_hull_inertia(self, body: int, inertia: np.ndarray, bias: np.ndarray) -> None:
        """The same about the middle of its hull."""
        x, y, z = self.middle(body)
        shift = np.eye(6)
        shift[:3, 3:] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
        self.add_inertia(body, shift.T @ inertia @ shift, bias @ shift)

    def run(
        self,
        rows: int,
        period: float,
        policy,
        *,
        record_every: int = 1,
        lead: float = 0.0,
        keep_water_at: Sequence[int] = (),
    ) -> Recording:
        """Run `rows` rows of `period` s. `policy(row, plant)` gives the commands [M, nu] of a row.

        Readings are kept every `record_every` fine steps, counted so that the instants `lead` s before
        a row are among them.
        """
        per_row = round(period / self.step_length)
        if abs(per_row * self.step_length - period) > 1e-9:
            raise HiddenCaseError(f"the step {self.step_length} s does not divide the row period {period} s")
        hold = max(round(lead / self.step_length), 1)
        offset = (-round(lead / self.step_length)) % record_every
        total = rows * per_row
        kept = np.arange(offset, total + 1, record_every)
        slot = {int(step): i for i, step in enumerate(kept)}
        sensors = np.empty((self.members, len(kept), self.model.nsensordata))
        late = _late_columns(self.model)
        commands = np.empty((self.members, rows + 1, self.model.nu))
        qpos = np.empty((self.members, rows + 1, self.model.nq))
        qvel = np.empty((self.members, rows + 1, self.model.nv))
        act = np.empty((self.members, rows + 1, self.model.na))
        waters: dict[int, Water] = {}
        self.batch.forward(stage=VEL)
        commands[:, 0] = policy(0, self)
        for k in range(total + 1):
            row, part = divmod(k, per_row)
            if part == 0:
                qpos[:, row], qvel[:, row], act[:, row] = self.qpos, self.qvel, self.act
                if row in keep_water_at and self.water is not None:
                    waters[row] = self.water
                    waters[row] = self.water.copy_members(np.arange(self.members))
                if row < rows:
                    commands[:, row + 1] = policy(row + 1, self)
            if k in slot:
                sensors[:, slot[k]] = self.sensordata
                for effect in self.effects:
                    effect.read(self, sensors[:, slot[k]])
            fraction = (part - part % hold) / per_row
            last = min(row + 1, rows)
            asked = commands[:, row] * (1 - fraction) + commands[:, last] * fraction
            felt = self._one_step(asked, late if k in slot else late[:0])
            if k in slot:
                sensors[:, slot[k]][:, late] = felt
        if not np.isfinite(sensors).all() or np.abs(qvel).max() > 1e3:
            raise HiddenCaseError("the truth diverged")
        return Recording(sensors, kept * self.step_length, commands, qpos, qvel, waters, act)

    def _one_step(self, asked: np.ndarray, late: np.ndarray) -> np.ndarray:
        """Step; returns readings that feel acceleration, the columns `late`, as the step began."""
        self._cache.clear()
        if self.wind is not None:
            self.current[:] = 0.0
            for effect in self.effects:
                if getattr(effect, "moves_water", False):
                    self.current += effect.water_velocity(self)
            self.wind[:] = self.current
            # What asked where it is did so before the water moved.
            self._cache.clear()
        for effect in self.effects:
            asked = effect.command(self, asked)
        self.ctrl[:] = asked
        if self.effects or self.water is not None:
            self.xfrc[:] = 0.0
            self.qfrc[:] = 0.0
            if self.water is not None:
                self.water.apply(self)
            for effect in self.effects:
                effect.force(self)
        if self.implicit:
            self._solve_inertia()
        felt = None
        varying = [effect for effect in self.effects if effect.varies is not None]
        if late.size and varying:
            # A force that changes within the step is felt as it was at its start.
            mean = self.qfrc.copy()
            for effect in varying:
                self.qfrc[:, effect.dof] += effect.varies
            self.batch.forward()
            felt = self.sensordata[:, late].copy()
            self.qfrc[:] = mean
        self.batch.step(stage=VEL)
        self.elapsed += self.step_length
        return self.sensordata[:, late] if felt is None else felt

    def _solve_inertia(self) -> None:
        """The wrench of unknown inertia, from accelerations that already include it.

        (M + sum J^T I J) a = M a0 - sum J^T (I b + c), b = the body's acceleration at zero qacc.
        """
        self.batch.forward()
        padded = np.concatenate([self.mass_matrix, np.zeros((self.members, 1))], 1)
        mass = padded[:, self._dense]
        mass = mass.reshape(self.members, self.model.nv, self.model.nv)
        free = self.qacc.copy()
        left = mass.copy()
        right = np.matmul(mass, free[..., None])[..., 0]
        parts = []
        for body, inertia, bias in self._inertial:
            motion = self.body(body)
            jacp, jacr = self.batch.jac(body, motion.position)
            back = motion.rotation.transpose(0, 2, 1)
            jac = np.concatenate([np.matmul(back, jacp), np.matmul(back, jacr)], 1)
            twist = np.matmul(jac, self.qvel[..., None])[..., 0]
            # nu_dot = J qacc + Jdot v; Jdot v from the step before, where both sides are known.
            previous = self._memory_nu.get(body)
            drift = np.zeros_like(twist) if previous is None else (twist - previous[0]) / self.step_length - previous[1]
            load = np.matmul(inertia, drift[..., None])[..., 0] + bias
            left += np.matmul(jac.transpose(0, 2, 1), np.matmul(inertia, jac))
            right -= np.matmul(load[:, None, :], jac)[:, 0]
            parts.append((body, jac, twist, inertia, load))
        acceleration = np.linalg.solve(left, right[..., None])
        for body, jac, twist, inertia, load in parts:
            along = np.matmul(jac, acceleration)
            self._memory_nu[body] = (twist, along[..., 0])
            wrench = -(np.matmul(inertia, along)[..., 0] + load)
            self.add_wrench(body, wrench[:, :3], wrench[:, 3:])
        self._inertial.clear()


def _late_columns(model: mujoco.MjModel) -> np.ndarray:
    """Columns of `sensordata` that belong to the acceleration stage."""
    columns = [
        np.arange(a, a + d)
        for a, d, s in zip(model.sensor_adr, model.sensor_dim, model.sensor_needstage)
        if s == ACCELERATION
    ]
    return np.concatenate(columns) if columns else np.empty(0, int)


def _dense_index(model: mujoco.MjModel) -> np.ndarray:
    """Index [nv * nv] into the sparse mass matrix `M` (lower triangle by rows) with a zero appended,

    which is where -1 points: joints of different branches do not couple.
    """
    index = np.full((model.nv, model.nv), -1)
    for row in range(model.nv):
        start = model.M_rowadr[row]
        for offset in range(model.M_rownnz[row]):
            column = model.M_colind[start + offset]
            index[row, column] = index[column, row] = start + offset
    return index.ravel()
