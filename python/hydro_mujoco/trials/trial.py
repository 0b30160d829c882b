"""Trials as arrays, and what stands in the file that `hydro gap` and `mujoco.sysid` read.

Time, as in `mujoco.sysid`'s `sysid_rollout`: `mj_step` reads sensors at the start of a step and labels the row with the
time at its end. So a reading of time t is the row labelled t + timestep; commands and start keep their time.
"""

import json
from dataclasses import dataclass, field

import numpy as np

#: `SignalType` of mujoco.sysid.
SENSOR, CONTROL = 0, 5


@dataclass(frozen=True)
class Trial:
    """A trial. Times [s] begin at 0, the trial's `start` in the log.

    control_times: (m,); controls: (m, actuators) under `actuators`; sensor_times: labels of the rows, (n,); readings:
    (n, components), NaN where there is none; signals: name -> columns of readings; initial_state: time, qpos, qvel and
    the rest of the full-physics state, or None.
    """

    name: str
    start: float
    control_times: np.ndarray
    controls: np.ndarray
    actuators: tuple[str, ...]
    sensor_times: np.ndarray
    readings: np.ndarray
    signals: dict[str, list[int]] = field(default_factory=dict)
    initial_state: np.ndarray | None = None

    def sensor(self, name: str) -> np.ndarray:
        """Readings of a sensor or prescribed joint, (n, dim)."""
        return self.readings[:, self.signals[name]]

    def arrays(self) -> dict[str, np.ndarray]:
        """Content of the archive of `SystemTrajectory.save_to_disk`; without `initial_state` where it is not known."""
        mapping = {f"{name}_ctrl": [CONTROL, [column]] for column, name in enumerate(self.actuators)}
        signals = {name: [SENSOR, columns] for name, columns in self.signals.items()}
        arrays = {
            "control_times": self.control_times,
            "control_data": self.controls,
            "control_signal_mapping": np.array(json.dumps(mapping)),
            "sensordata_times": self.sensor_times,
            "sensordata_data": self.readings,
            "sensordata_signal_mapping": np.array(json.dumps(signals)),
        }
        if self.initial_state is not None:
            arrays["initial_state"] = self.initial_state
        return arrays
