"""Trial files: `.npz` with the arrays that `mujoco.sysid`'s `SystemTrajectory.save_to_disk` writes."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

# `mujoco.sysid`'s `SignalType.MjSensor`. A trial without actuators needs no mapping of its controls.
MJ_SENSOR = 0


@dataclass(frozen=True)
class Trial:
    """A measured run of a model with one joint, no actuator.

    name: the file's stem.
    time: [n] seconds since the first sample.
    sensors: the readings by the sensor's name in the MJCF, each [n].
    position, velocity: of the joint at `time[0]` [rad, rad/s] or [m, m/s].
    """

    name: str
    time: np.ndarray
    sensors: dict[str, np.ndarray]
    position: float
    velocity: float

    def summary(self) -> str:
        """One line for people."""
        start = f"starts at {self.position:.5g}, {self.velocity:.4g} a second"
        return f"{len(self.time)} rows, {self.time[-1]:.2f} s, {start}"


def write(trial: Trial, folder: Path, timestep: float) -> Path:
    """Write `folder/<name>.npz`; `timestep` [s] is that of the nominal model.

    `mj_step` reads sensors at the start of a step and labels the row with the time at its end, so the sample
    of time t is labelled t + timestep. The full-physics state of the model is (time, qpos, qvel).
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{trial.name}.npz"
    labels = trial.time - trial.time[0] + timestep
    mapping = {name: [MJ_SENSOR, [column]] for column, name in enumerate(trial.sensors)}
    np.savez(
        path,
        control_times=labels,
        control_data=np.zeros((len(labels), 0)),
        sensordata_times=labels,
        sensordata_data=np.stack(list(trial.sensors.values()), axis=1),
        sensordata_signal_mapping=np.asarray(json.dumps(mapping)),
        initial_state=np.array([0.0, trial.position, trial.velocity]),
    )
    return path
