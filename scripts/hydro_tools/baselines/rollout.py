"""Held-out error: open-loop rollouts from measured starts, without and with what a method has found.

A start every two seconds, the error over the first 0.5, 1 and 2 s of each rollout. A sensor's squared NRMSE is its
squared error less the noise variance, over its measured variance, both summed over its components, the mean over
horizons; the pooled one is the mean over sensors. Before and after share starts and rows.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import mujoco
import numpy as np

from . import BaselineError, kinematics, library
from .kinematics import DELAY_S, LAG_S, RATES, Body, Kinematics
from .sparse import Sparse
from .weak import Equations, Problem, turned

HORIZONS_S = (0.5, 1.0, 2.0)
STRIDE_S = 2.0


class Forcing(Protocol):
    """Forces and readings added to the nominal."""

    def start(self, model: mujoco.MjModel, motion, row: int) -> None:
        """A rollout begins at a row of a motion."""

    def apply(self, model: mujoco.MjModel, data: mujoco.MjData, period: float) -> None:
        """Set applied forces for the next row from a forwarded state."""

    def sensed(self, model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray | float:
        """Correction of the readings [ns] of a forwarded state."""


def simulate(model: mujoco.MjModel, motion, row: int, rows: int, forcing: Forcing | None) -> np.ndarray:
    """Readings [rows, ns] at rows row + 1 ... row + rows of an open-loop rollout from row's state."""
    data = mujoco.MjData(model)
    data.time = motion.time[row]
    data.qpos[:], data.qvel[:] = motion.qpos[row], motion.qvel[row]
    steps = round(motion.period / model.opt.timestep)
    if forcing is not None:
        forcing.start(model, motion, row)
    out = np.full((rows, model.nsensordata), np.nan)
    for k in range(rows):
        data.ctrl[:] = motion.control[row + k]
        if forcing is not None:
            mujoco.mj_forward(model, data)
            forcing.apply(model, data, motion.period)
        change = motion.control[row + k + 1] - motion.control[row + k]
        for step in range(steps):
            data.ctrl[:] = motion.control[row + k] + change * (step / steps)
            mujoco.mj_step(model, data)
        if not np.isfinite(data.qpos).all() or np.abs(data.qvel).max(initial=0) > 1e3 or data.time < motion.time[row]:
            return out
        data.ctrl[:] = motion.control[row + k + 1]
        mujoco.mj_forward(model, data)
        out[k] = data.sensordata + (forcing.sensed(model, data) if forcing is not None else 0.0)
    return out


@dataclass
class Errors:
    """Sums over rollouts: squared error [trials, horizons, channels] and counts of the same shape."""

    squared: np.ndarray
    count: np.ndarray


def difference(model: mujoco.MjModel, predicted: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """Predicted less measured [n, ns]; of an attitude the rotation vector, in its first three channels."""
    out = predicted - measured
    for i in range(model.nsensor):
        if model.sensor_type[i] == mujoco.mjtSensor.mjSENS_FRAMEQUAT:
            at = slice(model.sensor_adr[i], model.sensor_adr[i] + 4)
            a, b = predicted[:, at], measured[:, at]
            scalar = np.sum(a * b, 1)
            vector = b[:, :1] * a[:, 1:] - a[:, :1] * b[:, 1:] - np.cross(b[:, 1:], a[:, 1:])
            turn = 2 * np.arctan2(np.linalg.norm(vector, axis=1), np.abs(scalar))
            size = np.maximum(np.linalg.norm(vector, axis=1), 1e-12)
            out[:, at] = 0.0
            out[:, at.start : at.start + 3] = vector * (np.sign(scalar) * turn / size)[:, None]
    return out


def channels(model: mujoco.MjModel) -> list[tuple[str, list[int]]]:
    """Sensors and their channels; an attitude has three."""
    out = []
    for i in range(model.nsensor):
        width = 3 if model.sensor_type[i] == mujoco.mjtSensor.mjSENS_FRAMEQUAT else int(model.sensor_dim[i])
        out.append((model.sensor(i).name, list(range(model.sensor_adr[i], model.sensor_adr[i] + width))))
    return out


def errors(model: mujoco.MjModel, motions: list, forcing: Forcing | None) -> Errors:
    """Squared errors of a model with what is added to it."""
    return scored(model, motions, lambda motion, row, rows: simulate(model, motion, row, rows, forcing))


def scored(model: mujoco.MjModel, motions: list, predict: Callable[..., np.ndarray]) -> Errors:
    """Squared errors over motions of `predict(motion, row, rows)` -> [rows, ns]; a rollout that diverges counts a
    hundred times its readings' spread.
    """
    ns = model.nsensordata
    squared = np.zeros((len(motions), len(HORIZONS_S), ns))
    count = np.zeros_like(squared)
    for trial, motion in enumerate(motions):
        longest = round(HORIZONS_S[-1] / motion.period)
        spread = variances(model, [motion])
        for row in range(0, len(motion.time) - longest - 1, max(1, round(STRIDE_S / motion.period))):
            predicted = predict(motion, row, longest)
            measured = motion.readings[row + 1 : row + 1 + longest]
            gap = difference(model, predicted, measured)
            good = np.isfinite(measured)
            lost = good & ~np.isfinite(predicted)
            gap = np.where(lost, 10 * np.sqrt(spread), np.where(good, gap, 0.0))
            # Nothing counts more than that: one wild rollout must not be the whole mean.
            gap = np.clip(gap, -10 * np.sqrt(spread), 10 * np.sqrt(spread))
            for h, horizon in enumerate(HORIZONS_S):
                rows = round(horizon / motion.period)
                squared[trial, h] += np.sum(gap[:rows] ** 2, 0)
                count[trial, h] += good[:rows].sum(0)
    if not count.any():
        raise BaselineError(
            f"no rollout of {HORIZONS_S[-1]:g} s fits in these trials; the longest has "
            f"{max((len(m.time) * m.period for m in motions), default=0):.3g} s"
        )
    return Errors(squared, count)


def nrmse(
    model: mujoco.MjModel, found: Errors, variance: np.ndarray, chosen: np.ndarray | None = None
) -> dict[str, float]:
    """NRMSE by sensor, and pooled (""), over the chosen trials; `variance` [ns] of the measured channels."""
    chosen = np.arange(len(found.squared)) if chosen is None else chosen
    mean = found.squared[chosen].sum(0) / np.maximum(found.count[chosen].sum(0), 1)
    out = {}
    for i, (name, columns) in enumerate(channels(model)):
        if found.count[chosen][:, :, columns].sum() == 0:
            continue
        excess = np.maximum(mean[:, columns] - model.sensor_noise[i] ** 2, 0.0)
        out[name] = float(np.sqrt(np.mean(excess.sum(1)) / max(variance[columns].sum(), 1e-12)))
    out[""] = float(np.sqrt(np.mean(np.square(list(out.values()))))) if out else float("nan")
    return out


def variances(model: mujoco.MjModel, motions: list) -> np.ndarray:
    """Measured variance of every channel over all motions [ns], 0 of one without readings; of an attitude, of its
    rotation from the mean.
    """
    readings = np.concatenate([motion.readings for motion in motions])
    read = np.isfinite(readings).any(axis=0)
    out = np.zeros(readings.shape[1])
    out[read] = np.nanvar(readings[:, read], axis=0)
    for i in range(model.nsensor):
        if model.sensor_type[i] == mujoco.mjtSensor.mjSENS_FRAMEQUAT:
            at = slice(model.sensor_adr[i], model.sensor_adr[i] + 4)
            good = readings[np.isfinite(readings[:, at]).all(1)]
            if len(good):
                whole = difference(model, good, np.tile(good[len(good) // 2], (len(good), 1)))
                out[at.start : at.start + 3] = whole[:, at.start : at.start + 3].var(0)
    return out


class SparseForcing:
    """The surviving columns with their coefficients, applied to the simulation; inertia implicitly."""

    def __init__(self, equations: Equations, problem: Problem, sparse: Sparse, spread: dict[str, float]):
        self.equations, self.problem, self.spread = equations, problem, spread
        self.amounts = problem.nuisance_amounts(sparse.coefficients)
        self.values = {
            (label.effect, label.parameter, label.target): w / size
            for label, w, size in zip(problem.labels, sparse.coefficients, problem.size)
            if w != 0
        }
        self.effects = {key[0] for key in self.values} - {"current"}
        self.wind = np.zeros(3)
        for (effect, parameter, _), value in self.values.items():
            if effect == "current":
                self.wind["xyz".index(parameter)] = value
        self.observer = kinematics.Observer(equations.model)

    def model(self) -> mujoco.MjModel:
        """The nominal with the current that was found, and its uncertain numbers as the fit has them."""
        model = turned(self.equations.model, self.spread, self.amounts)
        model.opt.wind[:] = model.opt.wind + self.wind
        return model

    def start(self, model, motion, row):
        data = mujoco.MjData(model)
        first = max(0, row - round(3.0 / motion.period))
        past = kinematics.along(model, data, _part(motion, first, row + 2))
        at = row - first
        self.memory = [body.memory[at] for body in past.bodies]
        self.lagged, self.history = past.lagged[at], list(past.thrust[:at])

    def apply(self, model, data, period):
        rows, thrust, moment, inflow = self.observer.row(data)
        self.history.append(thrust)
        delay = max(1, round(DELAY_S / period))
        bodies = [
            Body(
                index,
                model.body(index).name,
                *shape,
                model.body_ipos[index],
                turn[None],
                place[None],
                nu[None],
                np.zeros((1, 6)),
                jacobian[None],
                memory[None],
            )
            for index, shape, (turn, place, nu, jacobian), memory in zip(
                self.observer.bodies, self.observer.shapes, rows, self.memory
            )
        ]
        k = Kinematics(
            np.array([data.time]),
            bodies,
            thrust[None],
            self.lagged[None],
            self.history[max(0, len(self.history) - 1 - delay)][None],
            inflow[None],
            moment[None],
            (data.qpos[self.observer.addresses] - model.qpos0[self.observer.addresses])[None],
            data.qvel[self.observer.dofs][None],
            self.observer.dofs,
        )
        wrenches = {body: np.zeros(6) for body in self.observer.bodies}
        inertias = {body: np.zeros((6, 6)) for body in self.observer.bodies}
        force = np.zeros(model.nv)
        for column in library.columns(
            k,
            self.equations.actuators,
            self.equations.joints,
            wave_hz=self.problem.wave_hz,
            floor_z=self.equations.floor_z,
            scale=self.problem.scale,
            only=self.effects,
        ):
            value = self.values.get((column.effect, column.parameter, column.target))
            if value is None:
                continue
            if column.force is not None:
                force += value * column.force[0]
            else:
                wrenches[column.body] += value * column.wrench[0]
                if column.inertia is not None:
                    inertias[column.body] += value * column.inertia
        data.qfrc_applied[:] = force
        self._push(data, bodies, wrenches)
        if any(inertia.any() for inertia in inertias.values()):
            # (M + J^T A J) a = M a0: the wrench -A J a is then that of the accelerated water.
            mujoco.mj_forward(model, data)
            full = np.zeros((model.nv, model.nv))
            mujoco.mj_fullM(model, data, full)
            whole = full + sum(b.jacobian[0].T @ inertias[b.index] @ b.jacobian[0] for b in bodies)
            acceleration = np.linalg.lstsq(whole, full @ data.qacc, rcond=None)[0]
            for body in bodies:
                wrenches[body.index] -= inertias[body.index] @ body.jacobian[0] @ acceleration
            self._push(data, bodies, wrenches)
        for i, body in enumerate(bodies):
            keep = np.exp(-RATES * period)[:, None]
            self.memory[i] = keep * self.memory[i] + (1 - keep) / RATES[:, None] * body.nu
        keep = np.exp(-period / LAG_S)
        self.lagged = keep * self.lagged + (1 - keep) * thrust

    def sensed(self, model, data):
        """A force on a body is in the engine's own readings."""
        return 0.0

    @staticmethod
    def _push(data, bodies, wrenches):
        for body in bodies:
            turn, wrench = body.rotation[0], wrenches[body.index]
            push = turn @ wrench[:3]
            # MuJoCo applies at the centre of mass, the column acts at the body's origin.
            data.xfrc_applied[body.index, :3] = push
            data.xfrc_applied[body.index, 3:] = turn @ wrench[3:] + np.cross(
                data.xpos[body.index] - data.xipos[body.index], push
            )


def _part(motion, first: int, last: int):
    part = slice(first, last)
    return replace(
        motion,
        time=motion.time[part],
        qpos=motion.qpos[part],
        qvel=motion.qvel[part],
        qacc=motion.qacc[part],
        control=motion.control[part],
        readings=motion.readings[part],
    )
