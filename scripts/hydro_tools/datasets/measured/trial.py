"""Trial files: `.npz` with the arrays that `mujoco.sysid`'s `SystemTrajectory.save_to_disk` writes."""

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

# `mujoco.sysid`'s `SignalType.MjSensor`. Controls need no mapping: their columns are in the model's order.
MJ_SENSOR = 0


@dataclass(frozen=True)
class Trial:
    """A measured run.

    name: the file's stem.
    time: [n] seconds since the first sample.
    sensors: the readings by the sensor's name in the MJCF, each [n].
    position, velocity: of the only joint at `time[0]` [rad, rad/s] or [m, m/s]; None where that is not known.
    controls: the commands by actuator, in the model's order, each [n].
    """

    name: str
    time: np.ndarray
    sensors: dict[str, np.ndarray]
    position: float | None = None
    velocity: float | None = None
    controls: dict[str, np.ndarray] = field(default_factory=dict)

    def summary(self) -> str:
        """One line for people."""
        start = "" if self.position is None else f", starts at {self.position:.5g}, {self.velocity:.4g} a second"
        return f"{len(self.time)} rows, {self.time[-1]:.2f} s{start}"


def write(trial: Trial, folder: Path, timestep: float) -> Path:
    """Write `folder/<name>.npz`; `timestep` [s] is that of the nominal model.

    `mj_step` reads sensors at the start of a step and labels the row with the time at its end, so the sample
    of time t is labelled t + timestep. The full-physics state of the model is (time, qpos, qvel).
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{trial.name}.npz"
    labels = trial.time - trial.time[0] + timestep
    mapping = {name: [MJ_SENSOR, [column]] for column, name in enumerate(trial.sensors)}
    # A command acts from the sample's own time.
    controls = [np.asarray(values, float)[:, None] for values in trial.controls.values()]
    state = {} if trial.position is None else {"initial_state": np.array([0.0, trial.position, trial.velocity])}
    np.savez(
        path,
        control_times=labels - timestep if controls else labels,
        control_data=np.hstack([np.zeros((len(labels), 0)), *controls]),
        sensordata_times=labels,
        sensordata_data=np.stack(list(trial.sensors.values()), axis=1),
        sensordata_signal_mapping=np.asarray(json.dumps(mapping)),
        **state,
    )
    return path
