"""A trial file as motion: uniform rows of joint states, controls and readings.

Positions and velocities come from the sensors alone, found by type: framepos, framequat, gyro and velocimeter of
the body on the free joint; jointpos and jointvel of hinges and slides. A row labelled t holds the sensors of the
state at t - timestep.
"""

import csv
import json
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np

from hydro_mujoco.gap.trials import LARGEST
from hydro_mujoco.reading import check

from . import BaselineError

#: Trials of sealed/<id>/ that are scored and never fitted.
REGIMES = ("never_shown", "faster")

_S = mujoco.mjtSensor


@dataclass(frozen=True)
class Motion:
    """A trial at uniform rows.

    name: of the trial; time: [n] s, of the state; period: s a row.
    qpos [n, nq], qvel [n, nv], qacc [n, nv]: smoothed states in MuJoCo's coordinates.
    control: [n, nu]; readings: [n, ns] as measured, NaN where a row is lost.
    """

    name: str
    time: np.ndarray
    period: float
    qpos: np.ndarray
    qvel: np.ndarray
    qacc: np.ndarray
    control: np.ndarray
    readings: np.ndarray


def read(path: Path, model: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Control times [c], controls [c, nu], labels [n] and readings [n, ns], in the model's order."""
    readings: np.ndarray
    if path.suffix == ".npz":
        check(path, most=LARGEST[".npz"])
        with np.load(path, allow_pickle=False) as file:
            times, controls = file["control_times"], file["control_data"]
            labels, data = file["sensordata_times"], file["sensordata_data"]
            mapping = (
                json.loads(str(file["sensordata_signal_mapping"])) if "sensordata_signal_mapping" in file else None
            )
        readings = np.full((len(labels), model.nsensordata), np.nan)
        if mapping is None:
            readings[:] = data
        else:
            for name, (_, columns) in mapping.items():
                start = model.sensor(name).adr[0]
                readings[:, start : start + len(columns)] = data[:, columns]
        return times, controls, labels, readings
    check(path, most=LARGEST[".csv"])
    with path.open(newline="") as file:
        rows = list(csv.reader(file))
    head, table = rows[0], np.array([[float(x) if x else np.nan for x in row] for row in rows[1:]])
    place = {name: i for i, name in enumerate(head)}
    labels = table[:, place["time"]]
    controls = (
        np.stack([table[:, place[model.actuator(i).name]] for i in range(model.nu)], 1)
        if model.nu
        else np.zeros((len(labels), 0))
    )
    readings = np.full((len(labels), model.nsensordata), np.nan)
    for i in range(model.nsensor):
        name, start, width = model.sensor(i).name, model.sensor_adr[i], model.sensor_dim[i]
        for k in range(width):
            column = name if width == 1 else f"{name}[{k}]"
            if column in place:
                readings[:, start + k] = table[:, place[column]]
    return labels, controls, labels, readings


def trials(folder: Path) -> list[Path]:
    """The logs of a case, in order."""
    return _logs(folder / "trials")


def _logs(folder: Path) -> list[Path]:
    return sorted(path for path in folder.iterdir() if path.suffix in (".npz", ".csv"))


def kept_back(answers: Path, case_id: str, regimes: tuple[str, ...] = REGIMES) -> dict[str, list[Path]]:
    """Trials by regime that no method was shown, where there are any. The answer itself is not opened."""
    places = {regime: answers / case_id / regime for regime in regimes}
    found = {regime: _logs(place) for regime, place in places.items() if place.is_dir()}
    found = {regime: paths for regime, paths in found.items() if paths}
    if not found:
        raise BaselineError(
            f"{answers / case_id}: no trials that were kept back (*.npz or *.csv in {' or '.join(regimes)}); "
            "--sealed is OUT/sealed of gen_hidden.py"
        )
    return found


def _local(values: np.ndarray, half: int) -> np.ndarray:
    """Local parabolas over 2 half + 1 rows (Savitzky-Golay), the ends by the same parabola."""
    if half < 2:
        return values
    from scipy.signal import savgol_filter

    return savgol_filter(values, 2 * half + 1, 2, axis=0, mode="interp")


def _turned(quaternion: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Rotate `vector` [n, 3] by unit `quaternion` [n, 4]."""
    w, u = quaternion[:, :1], quaternion[:, 1:]
    t = 2 * np.cross(u, vector)
    return vector + w * t + np.cross(u, t)


def load(path: Path, model: mujoco.MjModel, smooth_s: float) -> Motion:
    """Read a trial and estimate its motion; `smooth_s` [s] is the width of the local parabolas."""
    times, controls, labels, raw = read(path, model)
    # Jitter and lost rows aside, a row lasts a whole number of the model's steps.
    period = max(1, round(float(np.median(np.diff(labels))) / model.opt.timestep)) * model.opt.timestep
    measured_at = labels - model.opt.timestep
    time = np.arange(measured_at[0], measured_at[-1] + 0.5 * period, period)
    half = int(round(0.5 * smooth_s / period))

    def even(columns: slice) -> np.ndarray | None:
        values = raw[:, columns]
        out = []
        for column in values.T:
            good = np.isfinite(column)
            if good.sum() < 4:
                return None
            out.append(np.interp(time, measured_at[good], column[good]))
        return np.stack(out, 1)

    found: dict[tuple[int, int], tuple[np.ndarray, int]] = {}
    for i in range(model.nsensor):
        values = even(slice(model.sensor_adr[i], model.sensor_adr[i] + model.sensor_dim[i]))
        kind, thing = int(model.sensor_type[i]), int(model.sensor_objid[i])
        if values is not None:
            if kind in (_S.mjSENS_GYRO, _S.mjSENS_VELOCIMETER):
                found[kind, int(model.site_bodyid[thing])] = values, thing
            else:
                found[kind, thing] = values, thing

    qpos = np.tile(model.qpos0, (len(time), 1))
    qvel = np.zeros((len(time), model.nv))
    for joint in range(model.njnt):
        q, v = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
        body, name = int(model.jnt_bodyid[joint]), model.joint(joint).name
        if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE:
            _free(found, model, body, half, period, qpos[:, q : q + 7], qvel[:, v : v + 6], name)
        elif model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_BALL:
            raise BaselineError(f"joint {name} is a ball: hinges, slides and one free joint are handled")
        else:
            position = found.get((int(_S.mjSENS_JOINTPOS), joint))
            velocity = found.get((int(_S.mjSENS_JOINTVEL), joint))
            if position is None:
                raise BaselineError(f"no jointpos sensor of {name} with readings: its state is not measured")
            qpos[:, q] = _local(position[0][:, 0], half)
            rate = velocity[0][:, 0] if velocity is not None else np.gradient(position[0][:, 0], period)
            qvel[:, v] = _local(rate, half)
    control = (
        np.stack([np.interp(time, times, column) for column in controls.T], 1) if model.nu else np.zeros((len(time), 0))
    )
    readings = _nearest(raw, measured_at, time, period)
    return Motion(path.stem, time, period, qpos, qvel, np.gradient(qvel, period, axis=0), control, readings)


def seen(states: Motion, path: Path, model: mujoco.MjModel) -> Motion:
    """The motion of another log of the same trial, with the readings of this one, which does not show its state."""
    _, _, labels, raw = read(path, model)
    readings = _nearest(raw, labels - model.opt.timestep, states.time, states.period)
    return replace(states, name=path.stem, readings=readings)


def _nearest(raw: np.ndarray, measured_at: np.ndarray, time: np.ndarray, period: float) -> np.ndarray:
    """Readings [n, ns] at even times: the nearest within 0.6 rows, else NaN."""
    readings = np.full((len(time), raw.shape[1]), np.nan)
    for column in range(raw.shape[1]):
        good = np.isfinite(raw[:, column])
        nearest = np.searchsorted(measured_at[good], time - 0.5 * period)
        if good.any():
            nearest = np.clip(nearest, 0, good.sum() - 1)
            close = np.abs(measured_at[good][nearest] - time) < 0.6 * period
            # At the reading's own row: a jitter of a fraction of a row is below the noise for smooth signals.
            readings[close, column] = raw[good, column][nearest][close]
    return readings


def _free(found, model, body: int, half: int, period: float, qpos: np.ndarray, qvel: np.ndarray, name: str) -> None:
    """Fill the free joint's seven positions and six velocities (linear in the world, angular in the body)."""
    position, attitude = (found.get((int(kind), body)) for kind in (_S.mjSENS_FRAMEPOS, _S.mjSENS_FRAMEQUAT))
    gyro, speed = (found.get((int(kind), body)) for kind in (_S.mjSENS_GYRO, _S.mjSENS_VELOCIMETER))
    if position is None or attitude is None or gyro is None:
        raise BaselineError(f"the free joint {name} needs sensors framepos, framequat and gyro with readings")
    quaternion = attitude[0].copy()
    flips = np.cumprod(np.where(np.sum(quaternion[1:] * quaternion[:-1], 1) < 0, -1.0, 1.0))
    quaternion[1:] *= flips[:, None]
    quaternion = _local(quaternion, half)
    quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
    spin = _turned(np.tile(model.site_quat[gyro[1]], (len(quaternion), 1)), gyro[0])
    spin = _local(spin, half)
    qpos[:, :3], qpos[:, 3:] = _local(position[0], half), quaternion
    qvel[:, 3:] = spin
    if speed is None:
        qvel[:, :3] = _local(np.gradient(position[0], period, axis=0), half)
        return
    own = _turned(np.tile(model.site_quat[speed[1]], (len(quaternion), 1)), speed[0])
    own = own - np.cross(spin, model.site_pos[speed[1]])
    qvel[:, :3] = _turned(quaternion, _local(own, half))
