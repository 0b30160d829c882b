"""Strength of an effect: the whitened norm of its change of the outputs.

The shadow is the same truth (perturbations included) without the effect, under the same commands. Left to
itself it would drift away and count the drift; so it is restarted from the truth's own state every second,
and the difference is taken over those windows. `raw` is the norm over every row and sensor of a case.
`projected` is what remains once the nominal's uncertainties (3 %, 2 mm, weighted by their prior) have
explained what they can, found by Gauss-Newton from their slopes: the distance from nothing, in the sense of a
confusion distance. The bands of the score use `projected`.
"""

import copy
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from . import perturbation
from .effects import Effect, Readings
from .frames import difference
from .plant import Plant, Recording

#: Seconds after which the shadow starts again from the truth.
WINDOW = 1.0


#: Encoders are digital, the strain gauges of a cell are wider than the servos' ripple (a filter that took it out
#: would by itself be a gap to any nominal), speeds of joints are half of each; the rest has the case's filter.
_BANDWIDTH = {
    mujoco.mjtSensor.mjSENS_JOINTPOS: float("inf"),
    mujoco.mjtSensor.mjSENS_FORCE: float("inf"),
    mujoco.mjtSensor.mjSENS_TORQUE: float("inf"),
    mujoco.mjtSensor.mjSENS_JOINTVEL: 4.0,
}


@dataclass(frozen=True)
class Layout:
    """Sensors of a nominal: columns, noise, which are attitudes."""

    columns: dict[str, slice]
    noise: dict[str, float]
    quaternions: set[str]
    bandwidth: dict[str, float]  # of the sensor's filter, as a multiple of the case's cut-off; inf: none

    @classmethod
    def from_model(cls, model: mujoco.MjModel) -> "Layout":
        columns, noise, quaternions, bandwidth = {}, {}, set(), {}
        for i in range(model.nsensor):
            name = model.sensor(i).name
            columns[name] = slice(model.sensor_adr[i], model.sensor_adr[i] + model.sensor_dim[i])
            noise[name] = float(model.sensor_noise[i])
            if model.sensor_type[i] == mujoco.mjtSensor.mjSENS_FRAMEQUAT:
                quaternions.add(name)
            bandwidth[name] = _BANDWIDTH.get(mujoco.mjtSensor(model.sensor_type[i]), 1.0)
        return cls(columns, noise, quaternions, bandwidth)

    def whitened(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """(a - b) / noise, attitudes as rotation vectors [..., ns']."""
        parts = []
        for name, columns in self.columns.items():
            change = (
                difference(a[..., columns], b[..., columns])
                if name in self.quaternions
                else a[..., columns] - b[..., columns]
            )
            parts.append(change / self.noise[name])
        return np.concatenate(parts, -1)


class Windows:
    """Windows of one second along a recorded truth, from which other models can be started."""

    def __init__(self, record: Recording, period: float, lead: float, *, every: int = 1, most: int | None = None):
        self.record, self.period, self.lead = record, period, lead
        self.rows = round(WINDOW / period)
        trials, total = record.commands.shape[0], record.commands.shape[1] - 1
        firsts = np.arange(0, total - self.rows + 1, self.rows)[::every]
        trial, first = np.repeat(np.arange(trials), len(firsts)), np.tile(firsts, trials)
        if most is not None and len(trial) > most:
            # Spread evenly; a step that does not divide the windows of a trial visits all its parts.
            pick = np.linspace(0, len(trial) - 1, most).astype(int)
            trial, first = trial[pick], first[pick]
        self.trial, self.first = trial, first

    def outputs(self, model: mujoco.MjModel, effects: Sequence, water_of=None) -> np.ndarray:
        """Readings at the rows of every window [windows, rows, ns] of a model that starts as the truth was."""
        rows = self.first[:, None] + np.arange(self.rows + 1)
        commands = self.record.commands[self.trial[:, None], rows]
        water = water_of(self.trial, self.first) if water_of else None
        plant = Plant(
            model,
            effects,
            qpos=self.record.qpos[self.trial, self.first],
            qvel=self.record.qvel[self.trial, self.first],
            start=self.first * self.period,
            water=water,
            act=self.record.act[self.trial, self.first],
        )
        per_row = round(self.period / model.opt.timestep)
        run = plant.run(self.rows, self.period, lambda row, _: commands[:, row], record_every=per_row, lead=self.lead)
        return run.sensors[:, : self.rows]

    def truth(self, rows: np.ndarray) -> np.ndarray:
        """The same windows of recorded rows [trials, K, ns] (row n at index n - 1)."""
        index = self.first[:, None] + np.arange(self.rows)
        return rows[self.trial[:, None], index]


#: Step of a slope, in standard deviations of a nuisance parameter. A whole one turns a hull by half a radian in a
#: window (2 mm between weight and buoyancy), where the curvature would count as unexplained.
SLOPE = 0.02
#: Most that a nuisance parameter is moved, in standard deviations.
FARTHEST = 20.0


class Nuisances:
    """The nominal's uncertainties as columns: slopes of the whitened outputs, per standard deviation."""

    def __init__(
        self,
        windows: Windows,
        layout: Layout,
        model: mujoco.MjModel,
        *,
        water_of=None,
        most: int = 40,
        com: float = perturbation.COM,
        tie=None,
    ):
        self.windows, self.layout, self.model, self.water_of = windows, layout, model, water_of
        self.groups = list(perturbation.groups(model, com, tie).values())[:most]
        slopes = []
        for i in range(len(self.groups)):
            step = np.zeros(len(self.groups))
            step[i] = SLOPE
            slopes.append(layout.whitened(self.outputs(step), self.outputs(-step)) / (2 * SLOPE))
        #: [windows, rows, ns', p]
        self.columns = np.stack(slopes, -1)

    def outputs(self, amounts: np.ndarray) -> np.ndarray:
        """Readings of the model with its nuisance parameters moved [windows, rows, ns]."""
        other = copy.copy(self.model)
        for amount, tied in zip(amounts, self.groups):
            for nuisance in tied:
                nuisance.turn(other, float(amount))
        perturbation.settle(other)
        return self.windows.outputs(other, [], self.water_of)

    def unexplained(self, truth: np.ndarray, shadow: np.ndarray, share: float) -> np.ndarray:
        """Whitened truth - shadow [windows, rows, ns'], linear in the nuisance parameters about their best values.

        Large changes are not linear in them: three Gauss-Newton steps, damped where they do not help.
        `share` weighs the windows against the prior.
        """
        flat = self.columns.reshape(-1, self.columns.shape[-1])
        # The change by the coarser step alone is not for the nuisance parameters to explain.
        stepping = self.layout.whitened(shadow, self.outputs(np.zeros(flat.shape[1])))

        def change_at(amounts):
            return self.layout.whitened(truth, self.outputs(amounts)) - stepping

        def cost(change, amounts):
            return share**2 * float((change**2).sum()) + float(amounts @ amounts)

        amounts, change = np.zeros(flat.shape[1]), self.layout.whitened(truth, shadow)
        for _ in range(3):
            target = change + self.columns @ amounts
            goal = ridge(share * flat, share * target.ravel())
            for damping in (1.0, 0.3, 0.1):
                # Further out a mass would be negative.
                tried = np.clip(amounts + damping * (goal - amounts), -FARTHEST, FARTHEST)
                then = change_at(tried)
                if cost(then, tried) < cost(change, amounts):
                    amounts, change = tried, then
                    break
            else:
                break
        return change + self.columns @ amounts


def effect_columns(
    windows: Windows, layout: Layout, model: mujoco.MjModel, effects: Sequence[Effect], *, scale: float, water_of=None
) -> np.ndarray:
    """Whitened change of the outputs by each of `effects` at a scale [windows, rows, ns', p]."""
    shadow = windows.outputs(model, [], water_of)
    times = np.arange(1, windows.rows + 1) * windows.period
    columns = []
    for effect in effects:
        effect.scale = np.array([[scale]])
        outputs = windows.outputs(model, [effect], water_of)
        for window in outputs:
            effect.sense(Readings(times, window, layout.columns, layout.quaternions))
        columns.append(layout.whitened(outputs, shadow))
    return np.stack(columns, -1)


def remainder(change: np.ndarray, columns: np.ndarray) -> float:
    """Norm of `change` [...] after a ridge fit of `columns` [..., p] with unit prior, the prior's share in it."""
    g, d = columns.reshape(-1, columns.shape[-1]), change.ravel()
    return float(np.sqrt(max(d @ d - d @ (g @ ridge(g, d)), 0.0)))


def ridge(g: np.ndarray, d: np.ndarray) -> np.ndarray:
    """The x that makes |d - g x|^2 + |x|^2 least. `g` [n, p], `d` [n]."""
    gram = g.T @ g + np.eye(g.shape[1])
    # Columns of very different size, some of them the same but for their size: scaled, and solved by rank.
    size = np.sqrt(np.diag(gram))
    return np.linalg.lstsq(gram / np.outer(size, size), (g.T @ d) / size, rcond=1e-12)[0] / size
