"""Writes and reads trials with `mujoco.sysid`; tests/gap/trial/exchange.rs runs it.

Usage: sysid_trials.py write FOLDER   files of one rollout, as that library writes them; prints the state's length
       sysid_trials.py check FOLDER   rust.npz must load there and equal rollout.npz
"""

from __future__ import annotations

import argparse
import pathlib

import mujoco
import numpy as np
from mujoco.sysid import SystemTrajectory, TimeSeries, create_initial_state, sysid_rollout

SCENE = """
<mujoco>
  <option timestep="0.004" gravity="0 0 0"/>
  <worldbody>
    <body name="hull">
      <freejoint/>
      <geom size="0.2" mass="5"/>
      <site name="imu"/>
      <body pos="0.3 0 0">
        <joint name="hip" axis="0 1 0" damping="0.1"/>
        <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.03" mass="0.5"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="left" joint="hip"/>
    <motor name="right" site="imu" gear="1 0 0 0 0 0"/>
  </actuator>
  <sensor>
    <gyro name="imu_gyro" site="imu"/>
    <framequat name="imu_quat" objtype="site" objname="imu"/>
    <jointpos name="hip" joint="hip"/>
    <velocimeter name="speed" site="imu"/>
  </sensor>
</mujoco>
"""


def rollout(model: mujoco.MjModel) -> SystemTrajectory:
    """A run of 0.4 s under two sine commands [N m, N]."""
    times = np.arange(100) * model.opt.timestep
    data = np.stack([np.sin(20 * times), 3 * np.cos(9 * times)], axis=1)
    control = TimeSeries.from_control_names(times, data, model)
    start = create_initial_state(model, np.array([0, 0, 0, 1, 0, 0, 0, 0.3]), np.full(7, 0.1))
    return sysid_rollout(model, mujoco.MjData(model), control, start)[0]


def write(folder: pathlib.Path, model: mujoco.MjModel) -> None:
    """Writes the rollout in every way that a user of the library may have."""
    run = rollout(model)
    run.save_to_disk(folder / "rollout.npz")
    with np.load(folder / "rollout.npz", allow_pickle=False) as npz:
        arrays = dict(npz)
    np.savez_compressed(folder / "compressed.npz", **arrays)
    plain = {name: value for name, value in arrays.items() if not name.endswith("mapping")}
    np.savez(folder / "plain.npz", **plain)
    fortran = plain | {
        "sensordata_data": np.asfortranarray(plain["sensordata_data"].astype(">f4")),
        "control_data": np.round(plain["control_data"]).astype(np.int16),
    }
    np.savez(folder / "fortran.npz", **fortran)
    # Two sensors of four, in another order, among a position, at half the rate, without states.
    columns = [7, 0, 1, 2, 0]
    some = TimeSeries.from_names(
        run.sensordata.times[::2],
        run.sensordata.data[::2][:, columns],
        model,
        ["hip", "imu_gyro", "hip_qpos"],
    )
    run.replace(sensordata=some, state=None).save_to_disk(folder / "some.npz")
    run.replace(initial_state=None).save_to_disk(folder / "pickled.npz")


def check(folder: pathlib.Path, model: mujoco.MjModel) -> None:
    """The library's own reader must see the same in rust.npz and in rollout.npz."""
    theirs, ours = (
        SystemTrajectory.load_from_disk(folder / name, model) for name in ("rollout.npz", "rust.npz")
    )
    for part in ("control", "sensordata", "state"):
        one, other = getattr(theirs, part), getattr(ours, part)
        np.testing.assert_array_equal(one.times, other.times)
        np.testing.assert_array_equal(one.data, other.data)
    np.testing.assert_array_equal(theirs.initial_state, ours.initial_state)
    for part in ("control", "sensordata"):
        one, other = getattr(theirs, part).signal_mapping, getattr(ours, part).signal_mapping
        assert one.keys() == other.keys(), (one, other)
        for name, (kind, columns) in one.items():
            assert other[name][0] == kind, name
            np.testing.assert_array_equal(other[name][1], columns)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("task", choices=["write", "check"])
    parser.add_argument("folder", type=pathlib.Path)
    arguments = parser.parse_args()
    model = mujoco.MjModel.from_xml_string(SCENE)
    if arguments.task == "write":
        write(arguments.folder, model)
        print(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS.value))
    else:
        check(arguments.folder, model)


if __name__ == "__main__":
    main()
