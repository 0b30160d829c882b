"""Patched models of `hydro gap`, scored like the baselines: same trials, starts, horizons and measure.

The nominal and the patched model run alike: from a measured start, after three seconds of the log along which the
state is set row by row (less near its beginning, where the first row is held for a second), so that the memories of
water, delays and lags are those of the motion. Corrections of sensors (`patch.sensors`) come after.
"""

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from hydro_mujoco import DataError
from hydro_mujoco.plugin import built_library, load_plugin
from hydro_mujoco.reading import read_json, read_text
from hydro_tools.datasets import trial_replay

from . import BaselineError, motion, rollout

PAST_S, HELD_S = 3.0, 1.0


@dataclass(frozen=True)
class Twin:
    """A case of the same motions with sensors that show the state: its model, trials shown and trials kept back."""

    model: mujoco.MjModel
    shown: list[Path]
    others: list[Path]


class Rollouts:
    """Open-loop rollouts of a model in the coordinates and sensors of its nominal."""

    def __init__(self, model: mujoco.MjModel, nominal: mujoco.MjModel, corrections: dict):
        self.model, self.corrections = model, corrections
        joints = [nominal.joint(j).name for j in range(nominal.njnt)]
        self.at_q, self.at_v = (
            trial_replay.places(model, joints, which, trial_replay.SIZES) for which in ("qpos", "qvel")
        )
        self.columns = np.concatenate(
            [
                model.sensor(nominal.sensor(i).name).adr[0] + np.arange(nominal.sensor_dim[i])
                for i in range(nominal.nsensor)
            ]
        )
        self.sensors = {
            nominal.sensor(i).name: slice(nominal.sensor_adr[i], nominal.sensor_adr[i] + nominal.sensor_dim[i])
            for i in range(nominal.nsensor)
        }

    def __call__(self, log: motion.Motion, row: int, rows: int) -> np.ndarray:
        """Readings [rows, ns] at rows row + 1 ... row + rows; NaN from where a rollout diverges."""
        model, data = self.model, mujoco.MjData(self.model)
        steps = round(log.period / model.opt.timestep)
        first = row - round(PAST_S / log.period)
        if first < 0:
            first = -round(HELD_S / log.period)
        data.time = log.time[0] + first * log.period
        for k in range(first, row):
            self._set(data, log, max(k, 0))
            self._step(data, log, max(k, 0), max(k + 1, 0), steps)
        self._set(data, log, row)
        data.time = log.time[row]
        out = np.full((rows + 1, len(self.columns)), np.nan)
        self._read(data, log, row, out[0])
        for k in range(rows):
            before = data.time
            self._step(data, log, row + k, row + k + 1, steps)
            if not np.isfinite(data.qpos).all() or np.abs(data.qvel).max(initial=0) > 1e3 or data.time < before:
                break
            self._read(data, log, row + k + 1, out[k + 1])
        return self._corrected(out, log.period)[1:]

    def _set(self, data, log: motion.Motion, row: int) -> None:
        data.qpos[self.at_q], data.qvel[self.at_v] = log.qpos[row], log.qvel[row]

    @staticmethod
    def _step(data, log: motion.Motion, row: int, following: int, steps: int) -> None:
        change = log.control[following] - log.control[row]
        for step in range(steps):
            data.ctrl[:] = log.control[row] + change * (step / steps)
            mujoco.mj_step(data.model, data)

    def _read(self, data, log: motion.Motion, row: int, out: np.ndarray) -> None:
        data.ctrl[:] = log.control[row]
        mujoco.mj_forward(self.model, data)
        out[:] = data.sensordata[self.columns]

    def _corrected(self, out: np.ndarray, period: float) -> np.ndarray:
        """measured(t) = scale * sensor(t - delay) + bias; before the start the first reading stands."""
        rows = np.arange(len(out))
        for name, correction in self.corrections.items():
            part = self.sensors[name]
            if correction.get("delay"):
                late = rows - correction["delay"] / period
                out[:, part] = np.stack([np.interp(late, rows, column) for column in out[:, part].T], 1)
            if part.stop - part.start == 4:
                continue  # The bias of an attitude is a small rotation: left out here.
            out[:, part] = correction.get("scale", 1.0) * out[:, part] + correction.get("bias", 0.0)
        return out


def models(nominal: Path, verdict: Path) -> tuple[Rollouts, Rollouts, mujoco.MjModel]:
    """(nominal's rollouts, the patched model's, the nominal); where nothing was added both are the nominal's."""
    try:
        patch = read_json(verdict)["patch"]
        path = verdict.parent / patch["model"] if patch else nominal
        if "hydro." in read_text(nominal) + read_text(path):
            load_plugin(built_library("HYDRO_PLUGIN"))
        known = mujoco.MjModel.from_xml_path(str(nominal))
        better = mujoco.MjModel.from_xml_path(str(path))
        return Rollouts(known, known, {}), Rollouts(better, known, patch["sensors"] if patch else {}), known
    except (DataError, ValueError, KeyError) as error:
        raise BaselineError(f"{verdict}: {error}") from error


def twin(case: Path, sealed: Path, regime: str) -> Twin:
    """The case that stands in for the states of another one, with its trials of a regime."""
    path = case / "nominal.xml"
    try:
        if "hydro." in read_text(path):
            load_plugin(built_library("HYDRO_PLUGIN"))
        model = mujoco.MjModel.from_xml_path(str(path))
    except (DataError, ValueError) as error:
        raise BaselineError(f"{path}: {error}") from error
    return Twin(model, motion.trials(case), motion.kept_back(sealed, case.name, (regime,))[regime])


def gap(case: Path, verdict: Path, smooth_s: float, others: list[Path], twin: Twin | None = None):
    """(model, errors before, errors after, variance of the shown trials) on trials `others` that no method has seen."""
    before, after, model = models(case / "nominal.xml", verdict)

    def motions(paths: list[Path], same: list[Path]) -> list[motion.Motion]:
        if twin is None:
            return [motion.load(path, model, smooth_s) for path in paths]
        if len(same) != len(paths):
            raise BaselineError(f"{case.name} has {len(paths)} trials, its twin {len(same)}: not the same motion")
        states = [motion.load(path, twin.model, smooth_s) for path in same]
        return [motion.seen(of, path, model) for of, path in zip(states, paths)]

    variance = rollout.variances(model, motions(motion.trials(case), twin.shown if twin else []))
    logs = motions(others, twin.others if twin else [])
    return model, rollout.scored(model, logs, before), rollout.scored(model, logs, after), variance
