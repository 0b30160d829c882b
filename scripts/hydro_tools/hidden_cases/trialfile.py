"""Trials on disk: `.npz` as `SystemTrajectory.save_to_disk` of `mujoco.sysid` writes it, or `.csv`."""

import csv
import json
from pathlib import Path

import mujoco
import numpy as np

#: `SignalType` of `mujoco.sysid`: a MuJoCo sensor, a control.
SENSOR, CONTROL = 0, 5


def mappings(model: mujoco.MjModel) -> tuple[str, str]:
    """Signal mappings of controls and sensors, in the JSON form of `encode_signal_mapping`."""
    controls = {f"{model.actuator(i).name}_ctrl": [CONTROL, [i]] for i in range(model.nu)}
    sensors = {
        model.sensor(i).name: [SENSOR, list(range(model.sensor_adr[i], model.sensor_adr[i] + model.sensor_dim[i]))]
        for i in range(model.nsensor)
    }
    return json.dumps(controls), json.dumps(sensors)


def write_npz(path: Path, model: mujoco.MjModel, control_times, controls, labels, readings, state) -> None:
    """One trial; the keys of `SystemTrajectory.save_to_disk`, without a state (a rig does not log one)."""
    control_mapping, sensor_mapping = mappings(model)
    np.savez(
        path,
        control_times=control_times,
        control_data=controls,
        sensordata_times=labels,
        sensordata_data=readings,
        initial_state=state,
        control_signal_mapping=np.asarray(control_mapping),
        sensordata_signal_mapping=np.asarray(sensor_mapping),
    )


def write_csv(
    path: Path,
    model: mujoco.MjModel,
    control_times,
    controls,
    labels,
    readings,
    *,
    only: dict[str, tuple[int, ...]] | None = None,
) -> None:
    """One trial: `time`, a column an actuator, a column a sensor component; rows of the readings.

    `only`: components of a sensor that are logged, where not all of them are. With it the commands of time 0 stand in a
    row of their own, since no initial state tells when the trial begins.
    """
    names = ["time"] + [model.actuator(i).name for i in range(model.nu)]
    columns = []
    for i in range(model.nsensor):
        name, width, start = model.sensor(i).name, model.sensor_dim[i], model.sensor_adr[i]
        logged = (only or {}).get(name, range(width))
        names += [name] if width == 1 else [f"{name}[{k}]" for k in logged]
        columns += [start + k for k in logged]
    along = np.stack([np.interp(labels, control_times, column) for column in controls.T], 1)
    with open(path, "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(names)
        if only is not None:
            out.writerow([f"{x:.9g}" for x in (control_times[0], *controls[0])] + [""] * len(columns))
        for t, u, y in zip(labels, along, readings[:, columns]):
            out.writerow([f"{t:.9g}"] + [f"{x:.9g}" for x in (*u, *y)])
