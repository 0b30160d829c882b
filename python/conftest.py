"""Examples of docstrings run in a folder of their own; those of `trials` beside the logs of a dive."""

from pathlib import Path

import pytest

from hydro_mujoco import plugin

ROS = """schema = "hydro-mapping/1"
[time]
clock = "header.stamp"
[trials]
length = 2
[sensors.imu_gyro]
topic = "/imu/data"
fields = ["angular_velocity.x", "angular_velocity.y", "angular_velocity.z"]
frame = "FLU"
""" + "".join(f'[actuators.t{n + 1}]\ntopic = "/thrusters"\nfield = "data[{n}]"\nclock = "log"\n' for n in range(8))


@pytest.fixture(scope="session")
def dive(tmp_path_factory) -> Path:
    """A folder with a short dive as logs of every kind, its nominal model and a mapping of the ROS logs."""
    import numpy as np
    import pandas

    import dive
    import writers
    from ulog import Ulog

    folder = tmp_path_factory.mktemp("dive")
    nominal = dive.vehicle(dive.KNOWN)
    nominal.compile()
    folder.joinpath("nominal.xml").write_text(nominal.to_xml())
    folder.joinpath("ros.toml").write_text(ROS)
    made = dive.swim(6.0, 5)
    parts = made.times, made.commands, made.readings
    writers.mcap(folder / "dive.mcap", *parts, dive.EPOCH)
    writers.rosbag(folder / "dive_ros2", *parts, dive.EPOCH)
    writers.dataflash(folder / "dive.bin", *parts)
    stamp = [("uint64_t", "timestamp")]
    log = Ulog(
        folder / "dive.ulg",
        {
            "vehicle_angular_velocity": [*stamp, ("float[3]", "xyz")],
            "actuator_motors": [*stamp, ("float[8]", "control")],
        },
    )
    log.subscribe("vehicle_angular_velocity")
    log.subscribe("actuator_motors")
    rates = made.readings["imu_gyro"]
    for time, commands, (x, y, z) in list(zip(made.times, made.commands, rates))[::4]:
        log.write("actuator_motors", round(time * 1e6), *commands)
        log.write("vehicle_angular_velocity", round(time * 1e6), x, -y, -z)
    log.close()
    table = pandas.DataFrame(np.degrees(rates), columns=["gx", "gy", "gz"])
    table.insert(0, "time", made.times)
    table.to_csv(folder / "dive.csv", index=False)
    table.to_parquet(folder / "dive.parquet")
    return folder


@pytest.fixture(autouse=True)
def where_examples_run(request, tmp_path, monkeypatch):
    """The folder of an example; one whose extra or library is missing is left out."""
    if not isinstance(request.node, pytest.DoctestItem):
        return
    if request.node.name.startswith("hydro_mujoco.trials"):
        for name in ("mcap", "rosbags", "pyulog", "pymavlink", "pandas", "pyarrow"):
            pytest.importorskip(name)
        if not plugin.built_library().is_file():
            pytest.skip("no plugin library: cargo build --release")
        monkeypatch.chdir(request.getfixturevalue("dive"))
    else:
        monkeypatch.chdir(tmp_path)
