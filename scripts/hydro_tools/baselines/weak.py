"""The regression problem of a case: weak-form residual of the nominal against weak-form columns.

Row by row the residual is what inverse dynamics leaves, M a + c - passive - actuator [nv] (a free joint's force in
the base frame), and measured less predicted of every load cell. Test functions (1 - s^2)^2 of `test_s` seconds,
half overlapping, integrate both sides: the mean of a central difference against a test function is minus the mean
against that function's own difference, so that no acceleration is trusted at a point. A channel is divided by its
noise; what the nominal's uncertainty (3 %) can explain is filtered out by its covariance.
"""

import copy
from collections.abc import Callable
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from . import BaselineError, kinematics, library
from .library import Column


@dataclass
class Problem:
    """A regression problem of m rows, p columns and q nuisance parameters; all rows in units of their noise.

    design: [m, p] and response: [m], whitened by the nuisance parameters; raw_design and raw_response: before that;
    nuisance_columns: [m, q], change of the response by one standard deviation of each nuisance parameter;
    trial: [m], the row's trial; labels: effect, parameter, target and unit of each column;
    size: [p], divisor of the column; wave_hz: frequency of the wave columns [Hz]; scale: scale of the controls.
    """

    design: np.ndarray
    response: np.ndarray
    raw_design: np.ndarray
    raw_response: np.ndarray
    nuisance_columns: np.ndarray
    trial: np.ndarray
    labels: list[Column]
    size: np.ndarray
    wave_hz: float
    scale: np.ndarray

    def with_trials(self, trials: set[int]) -> "Problem":
        """The rows of some trials."""
        rows = np.isin(self.trial, list(trials))
        return replace(
            self,
            design=self.design[rows],
            response=self.response[rows],
            raw_design=self.raw_design[rows],
            raw_response=self.raw_response[rows],
            nuisance_columns=self.nuisance_columns[rows],
            trial=self.trial[rows],
        )

    def nuisance_amounts(self, coefficients: np.ndarray) -> np.ndarray:
        """Nuisance parameters [q] that best explain what the columns leave, in standard deviations."""
        columns = self.nuisance_columns
        gram = columns.T @ columns + np.eye(columns.shape[1])
        return np.linalg.solve(gram, columns.T @ (self.raw_response - self.raw_design @ coefficients))


class Equations:
    """Residuals and columns of a nominal along motions."""

    def __init__(self, model: mujoco.MjModel):
        self.model, self.data = model, mujoco.MjData(model)
        self.free = next(
            (int(model.jnt_dofadr[j]) for j in range(model.njnt) if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_FREE),
            None,
        )
        self.cells = [
            i
            for i in range(model.nsensor)
            if int(model.sensor_type[i]) in (mujoco.mjtSensor.mjSENS_FORCE, mujoco.mjtSensor.mjSENS_TORQUE)
        ]
        self.actuators = [model.actuator(i).name for i in range(model.nu)]
        self.joints = [model.joint(j).name for j in kinematics.single_joints(model)]
        floors = [g for g in range(model.ngeom) if model.geom_type[g] == mujoco.mjtGeom.mjGEOM_PLANE]
        self.floor_z = float(model.geom_pos[floors[0], 2]) if floors else None

    def residual(self, motion, model: mujoco.MjModel | None = None) -> np.ndarray:
        """[n, nv + 3 cells]: missing generalised force, then measured less predicted of the load cells."""
        model = model or self.model
        data = self.data
        out = np.zeros((len(motion.time), model.nv + 3 * len(self.cells)))
        for row, (q, v, a, u) in enumerate(zip(motion.qpos, motion.qvel, motion.qacc, motion.control)):
            data.qpos[:], data.qvel[:], data.qacc[:], data.ctrl[:] = q, v, a, u
            mujoco.mj_inverse(model, data)
            mujoco.mj_fwdActuation(model, data)
            force = data.qfrc_inverse - data.qfrc_actuator
            if self.free is not None:
                turn = np.zeros(9)
                mujoco.mju_quat2Mat(turn, q[self._quaternion() : self._quaternion() + 4])
                part = slice(self.free, self.free + 3)
                force[part] = turn.reshape(3, 3).T @ force[part]
            out[row, : model.nv] = force
            for i, cell in enumerate(self.cells):
                at = slice(model.sensor_adr[cell], model.sensor_adr[cell] + 3)
                out[row, model.nv + 3 * i : model.nv + 3 * i + 3] = motion.readings[row, at] - data.sensordata[at]
        # A lost reading of a load cell says nothing: it is filled with its neighbours.
        for column in out.T:
            bad = ~np.isfinite(column)
            if bad.any() and not bad.all():
                column[bad] = np.interp(np.flatnonzero(bad), np.flatnonzero(~bad), column[~bad])
            elif bad.all():
                column[:] = 0.0
        return out

    def _quaternion(self) -> int:
        joint = next(j for j in range(self.model.njnt) if self.model.jnt_type[j] == mujoco.mjtJoint.mjJNT_FREE)
        return int(self.model.jnt_qposadr[joint]) + 3

    def response_of(self, column: Column, motion, k) -> np.ndarray:
        """[n, nv + 3 cells]: what a column adds to the residual."""
        model = self.model
        out = np.zeros((len(motion.time), model.nv + 3 * len(self.cells)))
        if column.force is not None:
            force = column.force.copy()
        else:
            body = next(b for b in k.bodies if b.index == column.body)
            force = np.einsum("nij,ni->nj", body.jacobian, column.wrench)
            self._felt(column, body, out)
        if self.free is not None:
            base = k.bodies[0]
            part = slice(self.free, self.free + 3)
            force[:, part] = np.einsum("nji,nj->ni", base.rotation, force[:, part])
        out[:, : model.nv] = force
        return out

    def _felt(self, column: Column, body, out: np.ndarray) -> None:
        """Load cells above the body: they read minus the wrench that acts below them, here for cells at rest
        relative to the world or to a body without rotation (a mount, a carriage).
        """
        model = self.model
        for i, cell in enumerate(self.cells):
            site = int(model.sensor_objid[cell])
            holder, up = int(model.site_bodyid[site]), body.index
            while up != holder and up != 0:
                up = int(model.body_parentid[up])
            if up != holder:
                continue
            push = np.einsum("nij,nj->ni", body.rotation, column.wrench[:, :3])
            twist = np.einsum("nij,nj->ni", body.rotation, column.wrench[:, 3:])
            if holder == body.index:
                arm = np.einsum("nij,j->ni", body.rotation, -model.site_pos[site])
            else:
                # The holder's place relative to the body, from the nominal's rest: it only slides or is fixed.
                arm = body.place - (body.place[:1] * 0 + self._rest(site))
            if model.sensor_type[cell] == mujoco.mjtSensor.mjSENS_FORCE:
                out[:, model.nv + 3 * i : model.nv + 3 * i + 3] = -push
            else:
                out[:, model.nv + 3 * i : model.nv + 3 * i + 3] = -(twist + np.cross(arm, push))

    def _rest(self, site: int) -> np.ndarray:
        data = mujoco.MjData(self.model)
        mujoco.mj_kinematics(self.model, data)
        return data.site_xpos[site].copy()

    def wind(self, motion) -> list[np.ndarray]:
        """Change of the residual by a unit of current along x, y, z [n, ...]: the nominal's own drag, linearised."""
        if self.model.opt.density == 0 and self.model.opt.viscosity == 0:
            return []
        before, step = self.residual(motion), 0.02
        out = []
        for axis in range(3):
            kept = self.model.opt.wind.copy()
            self.model.opt.wind[axis] += step
            out.append((before - self.residual(motion)) / step)
            self.model.opt.wind[:] = kept
        return out


#: A trial has so many lengths of a test function at least: three half overlapping windows.
LEAST_LENGTHS = 2.0

#: Moves a nuisance parameter of a model by z standard deviations.
Nuisance = Callable[[mujoco.MjModel, float], None]


def nuisances(model: mujoco.MjModel, spread: dict[str, float]) -> list[Nuisance]:
    """Uncertain parameters: masses, inertias, centres, fluid, gains, damping; parts of many bodies are tied."""
    out: list[Nuisance] = []

    def scaled(names: tuple[str, ...], at, share: float) -> None:
        def turn(m, z):
            for name in names:
                getattr(m, name)[at] *= 1 + share * z

        out.append(turn)

    solid = [b for b in range(1, model.nbody) if model.body_mass[b] > 1e-3]
    for bodies in [[b] for b in solid] if len(solid) <= 3 else [solid]:
        scaled(("body_mass",), bodies, spread.get("mass", 0.03))
        for axis in range(3):
            scaled(("body_inertia",), (bodies, axis), spread.get("inertia", 0.03))

            def shift(m, z, bodies=bodies, axis=axis):
                m.body_ipos[bodies, axis] += spread.get("com_m", 0.002) * z

            out.append(shift)
    if model.geom_fluid[:, 0].any():
        for slot in range(1, 5):
            scaled(("geom_fluid",), (slice(None), slot), spread.get("fluid", 0.03))
    for each in [[i] for i in range(model.nu)] if model.nu <= 8 else [list(range(model.nu))]:
        scaled(("actuator_gainprm", "actuator_biasprm"), each, spread.get("gain", 0.03))
    if np.any(model.dof_damping > 0):
        scaled(("dof_damping",), slice(None), spread.get("damping", 0.03))
    return out


def turned(model: mujoco.MjModel, spread: dict[str, float], amounts: np.ndarray) -> mujoco.MjModel:
    """A copy with every nuisance parameter moved by its amount [standard deviations]."""
    other = copy.copy(model)
    for nuisance, amount in zip(nuisances(model, spread), amounts):
        nuisance(other, float(amount))
    mujoco.mj_setConst(other, mujoco.MjData(other))
    return other


def integrated(values: np.ndarray, period: float, test_s: float) -> np.ndarray:
    """Means against the test functions [n, c] -> [windows, c]."""
    length = max(5, round(test_s / period))
    s = np.linspace(-1, 1, length + 2)[1:-1]
    test = (1 - s**2) ** 2
    test /= np.sqrt(np.sum(test**2))
    starts = range(0, len(values) - length + 1, max(1, length // 2))
    return np.stack([test @ values[a : a + length] for a in starts])


def peak_frequency(residuals: list[np.ndarray], period: float, highest: float = 0.8) -> float:
    """The frequency [Hz] of the largest common line of residual forces, between 0.08 and `highest`."""
    grid = np.linspace(0.08, highest, 90)
    power = np.zeros(len(grid))
    for values in residuals:
        rest = values - values.mean(0)
        rest = rest / np.maximum(rest.std(0), 1e-12)
        t = np.arange(len(rest)) * period
        power += np.abs(np.exp(-2j * np.pi * grid[:, None] * t) @ rest).sum(1)
    return float(grid[power.argmax()])


def problem(equations: Equations, motions: list, spread: dict[str, float], test_s: float) -> Problem:
    """Assemble a case's regression."""
    model = equations.model
    shortest = min(motion.time[-1] - motion.time[0] for motion in motions)
    if shortest < LEAST_LENGTHS * test_s:
        raise BaselineError(
            f"test functions of {test_s:g} s are too long for a trial of {shortest:.3g} s: it must have "
            f"{LEAST_LENGTHS:g} lengths, for their noise is told from neighbours"
        )
    residuals = [equations.residual(motion) for motion in motions]
    wave_hz = peak_frequency(residuals, motions[0].period)
    paths = [kinematics.along(model, equations.data, motion) for motion in motions]
    scale = np.quantile(np.abs(np.concatenate([k.thrust for k in paths])), 0.95, axis=0) if model.nu else np.zeros(0)
    scale = np.maximum(scale, 1e-9)
    count = len(nuisances(model, spread))
    others = [turned(model, spread, row) for row in np.eye(count)]
    responses, designs, spoils, trials, labels = [], [], [], [], []
    for index, (motion, residual, k) in enumerate(zip(motions, residuals, paths)):
        found = library.columns(
            k, equations.actuators, equations.joints, wave_hz=wave_hz, floor_z=equations.floor_z, scale=scale
        )
        strong = [equations.response_of(column, motion, k) for column in found]
        for axis, value in enumerate(equations.wind(motion)):
            found.append(Column("current", "xyz"[axis], k.bodies[0].name, "m/s"))
            strong.append(value)
        labels = [Column(c.effect, c.parameter, c.target, c.unit, c.body) for c in found]
        weak = integrated(residual, motion.period, test_s)
        responses.append(weak)
        designs.append(np.stack([integrated(value, motion.period, test_s) for value in strong], -1))
        spoils.append(
            np.stack(
                [integrated(residual - equations.residual(motion, other), motion.period, test_s) for other in others],
                -1,
            )
        )
        trials.append(np.full(weak.size, index))
    noise = _noise(responses)
    y = np.concatenate([(r / noise).ravel() for r in responses])
    x = np.concatenate([(d / noise[:, None]).reshape(-1, d.shape[-1]) for d in designs])
    n = np.concatenate([(s / noise[:, None]).reshape(-1, s.shape[-1]) for s in spoils])
    raw_design, raw_response = x, y
    x, y = _without(n, x, y)
    size = np.sqrt(np.mean(x**2, axis=0))
    keep = size > 1e-6 * max(float(size.max()), 1e-12)
    if not keep.any():
        raise BaselineError("nothing moves: every column is zero")
    return Problem(
        x[:, keep] / size[keep],
        y,
        raw_design[:, keep] / size[keep],
        raw_response,
        n,
        np.concatenate(trials),
        [c for c, use in zip(labels, keep) if use],
        size[keep],
        wave_hz,
        scale,
    )


def _noise(responses: list[np.ndarray]) -> np.ndarray:
    """Noise of a channel: spread of what a window differs from the mean of its neighbours by."""
    odd = np.concatenate([r[1:-1] - 0.5 * (r[2:] + r[:-2]) for r in responses])
    spread = 1.4826 * np.median(np.abs(odd), axis=0) / np.sqrt(1.5)
    return np.maximum(spread, 1e-9 + 1e-3 * spread.max())


def _without(spoil: np.ndarray, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Whiten by I + N N^T: directions that the nominal's uncertainty explains count little."""
    u, s, _ = np.linalg.svd(spoil, full_matrices=False)
    shrink = 1 - 1 / np.sqrt(1 + s**2)
    return x - u @ (shrink[:, None] * (u.T @ x)), y - u @ (shrink * (u.T @ y))
