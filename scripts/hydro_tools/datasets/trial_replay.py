"""Trials (npz of `mujoco.sysid`) replayed open loop in plain MuJoCo, under a nominal model and under the patched one.

The error of a sensor is an NRMSE: root mean square difference over the spread of the measurement, pooled over trials,
with the sensor noise left in. Nothing of `hydro gap` runs here but the plugin, loaded where the patched model asks for
it.
"""

import json
from pathlib import Path

import mujoco
import numpy as np

from hydro_mujoco.gap.trials import LARGEST
from hydro_mujoco.plugin import built_library, load_plugin
from hydro_mujoco.reading import check, read_json, read_text

#: Before a log begins nothing is known: memories are led through its first motion and command, held so long [s].
HELD = 1.0


class Trial:
    """One log."""

    def __init__(self, path: Path):
        check(path, most=LARGEST[".npz"])
        with np.load(path) as log:
            self.control_times, self.control = log["control_times"], log["control_data"]
            self.times, self.values = log["sensordata_times"], log["sensordata_data"]
            self.state = log["initial_state"]
            self.sensors = {
                name: columns for name, (_, columns) in json.loads(str(log["sensordata_signal_mapping"])).items()
            }

    def command(self, time: float) -> np.ndarray:
        """Linear between rows."""
        return np.array([np.interp(time, self.control_times, column) for column in self.control.T])


def places(model: mujoco.MjModel, names: list[str], which: str, sizes: dict) -> np.ndarray:
    """Indices of the coordinates of some joints in qpos or qvel, in the order of `names`."""
    address = model.jnt_qposadr if which == "qpos" else model.jnt_dofadr
    rows = []
    for name in names:
        joint = model.joint(name)
        rows.extend(range(address[joint.id], address[joint.id] + sizes[which][int(model.jnt_type[joint.id])]))
    return np.array(rows, dtype=int)


SIZES = {"qpos": {0: 7, 1: 4, 2: 1, 3: 1}, "qvel": {0: 6, 1: 3, 2: 1, 3: 1}}


def set_motion(model, data, nominal, trial: Trial) -> None:
    """The nominal's joints as the log has them; a joint that only the patched model has stays in the middle."""
    names = [nominal.joint(j).name for j in range(nominal.njnt)]
    data.qpos[places(model, names, "qpos", SIZES)] = trial.state[1 : 1 + nominal.nq]
    data.qvel[places(model, names, "qvel", SIZES)] = trial.state[1 + nominal.nq : 1 + nominal.nq + nominal.nv]


def rollout(model, nominal, trial: Trial, seconds: float, corrections: dict) -> tuple[np.ndarray, np.ndarray]:
    """Predicted readings of the rows of the first seconds, and these rows (a row reads the state a step before)."""
    data = mujoco.MjData(model)
    step = model.opt.timestep
    start = trial.state[0]
    for at in range(round(HELD / step)):
        set_motion(model, data, nominal, trial)
        data.time = start - (round(HELD / step) - at) * step
        data.ctrl[:] = trial.command(start)
        mujoco.mj_step(model, data)
    set_motion(model, data, nominal, trial)
    data.time = start
    rows = np.flatnonzero((trial.times <= trial.times[0] + seconds) & (trial.times - step >= start - 1e-9))
    count = int(np.ceil((trial.times[rows[-1]] - start) / step)) + 1
    trace = np.empty((count, model.nsensordata))
    for at in range(count):
        data.ctrl[:] = trial.command(start + at * step)
        mujoco.mj_step(model, data)
        trace[at] = data.sensordata
    predicted = np.full((len(rows), trial.values.shape[1]), np.nan)
    state_times = start + step * np.arange(count)
    for name, columns in trial.sensors.items():
        sensor = model.sensor(name)
        correction = corrections.get(name, {})
        first = int(model.sensor_adr[sensor.id])
        late = trial.times[rows] - step - correction.get("delay", 0.0)
        for at, column in enumerate(columns):
            reading = np.interp(late, state_times, trace[:, first + at])
            predicted[:, column] = correction.get("scale", 1.0) * reading
            bias = np.atleast_1d(correction.get("bias", 0.0))
            if len(columns) != 4:  # That of an attitude is a small rotation: left out here.
                predicted[:, column] += bias[min(at, len(bias) - 1)]
    return predicted, rows


def errors(model, nominal, trials: list[Trial], seconds: float, corrections: dict) -> dict[str, float]:
    """NRMSE by sensor."""
    squares, spreads = {}, {}
    for trial in trials:
        predicted, rows = rollout(model, nominal, trial, seconds, corrections)
        for name, columns in trial.sensors.items():
            measured = trial.values[rows][:, columns]
            guess = predicted[:, columns]
            if len(columns) == 4:
                guess = guess * np.sign(np.sum(guess * measured, axis=1, keepdims=True))
            seen = np.isfinite(measured)
            squares[name] = squares.get(name, 0.0) + np.nansum((measured - guess)[seen] ** 2)
            spreads[name] = spreads.get(name, 0.0) + np.nansum(((measured - np.nanmean(measured, axis=0)) ** 2)[seen])
    return {name: float(np.sqrt(squares[name] / max(spreads[name], 1e-300))) for name in squares}


def compare(nominal_path: Path, out: Path, folder: Path, seconds: float) -> dict:
    """Errors by sensor under both models, and pooled."""
    verdict = read_json(out / "verdict.json")
    if not verdict["patch"]:
        raise SystemExit(f"{out}/verdict.json: nothing was added ({verdict['verdict']}), so there is nothing to replay")
    path = out / verdict["patch"]["model"]
    if "hydro." in read_text(path) + read_text(nominal_path):
        load_plugin(built_library("HYDRO_PLUGIN"))
    nominal, patched = (mujoco.MjModel.from_xml_path(str(model)) for model in (nominal_path, path))
    trials = [Trial(file) for file in sorted(folder.glob("*.npz"))]
    if not trials:
        raise SystemExit(f"{folder}: no *.npz; expected trials as mujoco.sysid writes them")
    before = errors(nominal, nominal, trials, seconds, {})
    after = errors(patched, nominal, trials, seconds, verdict["patch"]["sensors"])
    pooled = {
        side: float(np.sqrt(np.mean(np.square(list(by.values())))))
        for side, by in (("before", before), ("after", after))
    }
    return {
        "trials": len(trials),
        "sensors": {name: {"before": before[name], "after": after[name]} for name in before},
        **pooled,
        "reduction": 1.0 - pooled["after"] / pooled["before"],
    }
