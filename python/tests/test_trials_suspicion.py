"""What is said of a log whose units, frames, signs or clocks are not what its mapping says; and that a good one is not doubted."""

import copy
import functools
import re

import mujoco
import numpy as np
import pandas
import pytest

import dive
import writers
from hydro_mujoco import plugin, trials
from hydro_mujoco.errors import DataError
from hydro_mujoco.trials import clock, frames
from hydro_mujoco.trials.log import Samples
from hydro_mujoco.trials.mapping.schema import Time
from hydro_mujoco.trials.report import Report

pytestmark = pytest.mark.skipif(not plugin.built_library().is_file(), reason="no plugin library: cargo build --release")
ACTUATORS = [f"t{n}" for n in range(1, 9)]
SIZES = {"imu_gyro": 3, "attitude": 4, "position": 3, "dvl": 3, "velocity": 3, "accel": 3, "compass": 3}


@functools.cache
def model():
    spec = dive.vehicle(dive.KNOWN)
    site = {"objtype": mujoco.mjtObj.mjOBJ_SITE, "objname": "imu"}
    spec.add_sensor(name="accel", type=mujoco.mjtSensor.mjSENS_ACCELEROMETER, **site)
    spec.add_sensor(name="compass", type=mujoco.mjtSensor.mjSENS_MAGNETOMETER, **site)
    return spec


@functools.cache
def log():
    """A dive of 30 s at 50 Hz with noise, a column a number."""
    made = dive.swim(30.0, 3)
    readings = dict(dive.noisy(made, 4))
    turned = frames.matrices(made.readings["attitude"])
    felt = np.gradient(made.readings["velocity"], made.times, axis=0) + [0, 0, 9.81]
    readings["accel"] = np.einsum("nji,nj->ni", turned, felt)
    readings["compass"] = np.einsum("nji,j->ni", turned, np.array([0.2e-4, 0.1e-4, -0.4e-4]))
    columns = {"time": made.times} | {name: made.commands[:, n] for n, name in enumerate(ACTUATORS)}
    columns |= {f"{name}_{k}": values[:, k] for name, values in readings.items() for k in range(values.shape[1])}
    return pandas.DataFrame(columns)[::4].reset_index(drop=True)


def mapping(**sources):
    sensors = {name: {"fields": [f"{name}_{k}" for k in range(size)]} for name, size in SIZES.items()}
    for name, change in sources.items():
        sensors[name] = sensors[name] | change
    return {
        "schema": "hydro-mapping/1",
        "time": {"period": 0.02},
        "sensors": sensors,
        "actuators": {name: {"field": name} for name in ACTUATORS},
    }


def suspicions(frame=None, **sources):
    return trials.from_dataframe(
        log() if frame is None else frame, model=model(), mapping=mapping(**sources)
    ).report.suspicions


def test_a_good_log_is_not_doubted():
    assert suspicions() == []


def flipped(name):
    """Read as NED or FRD, though it is not."""
    frame = {"position": "NED", "velocity": "NED", "attitude": "NED/FRD"}.get(name, "FRD")
    return {name: {"frame": frame}}


SAID = {
    "accelerometer": ({"accel": {"frame": "FRD"}}, "at rest `accel` reads 9.* downwards.*FRD taken for FLU .NED for ENU"),
    "gravity in g": ({"accel": {"scale": 1 / 9.80665}}, '`unit = "g"`'),
    "gravity in mm/s^2": ({"accel": {"scale": 1000}}, '`unit = "mm/s.2"`'),
    "no gravity": ({"accel": {"offset": [0, 0, -9.81]}}, "gravity was taken out of it"),
    "no such gravity": ({"accel": {"scale": 5}}, "which no gravity explains"),
    "attitude": ({"attitude": {"frame": "NED/FLU"}}, "by `attitude` the vehicle is upside down"),
    "order": ({"attitude": {"order": "xyzw"}}, "upside down|with the quaternion in the order wxyz"),
    "direction": ({"attitude": {"direction": "body_from_world"}}, "`imu_gyro` does not turn as `attitude` does.*with the attitude as world_from_body"),
    "gyro in degrees": ({"imu_gyro": {"scale": 180 / np.pi}}, "with the gyro in deg/s it does|reaches"),
    "gyro read as degrees": ({"imu_gyro": {"unit": "deg/s"}}, "with the gyro in rad/s it does"),
    "gyro's frame": ({"imu_gyro": {"frame": "FRD"}}, "with one of them in FRD and the other in FLU it does"),
    "depth": ({"position": {"frame": "NED"}}, "a depth taken for a height.*NED"),
    "heave": ({"position": {"scale": [1, 1, -1], "offset": [0, 0, -5]}}, "the vehicle sinks when its thrusters push up"),
    "velocity": ({"velocity": {"scale": [1, 1, -1]}}, "along z `velocity` goes the other way than `position`"),
    "north and east": ({"velocity": {"frame": "NED"}}, "x and y of `velocity` and `position` are exchanged"),
    "compass": ({"compass": {"frame": "FRD"}}, "`compass` turns the other way than the yaw of `attitude`"),
    "length": ({"attitude": {"scale": 1.5}}, "have a length of 1.5, not 1"),
    "constant": ({"dvl": {"scale": 0}}, "`dvl` never changes"),
}  # fmt: skip


@pytest.mark.parametrize("case", SAID)
def test_what_is_wrong_is_suspected(case):
    sources, expected = SAID[case]
    found = suspicions(**sources)
    assert any(re.search(expected, text) for text in found), found


def test_velocity_by_the_body_is_compared_too():
    """Without `velocity` the velocimeter is held against the position."""
    content = mapping(dvl={"frame": "FRD"})
    del content["sensors"]["velocity"]
    found = trials.from_dataframe(log(), model=model(), mapping=content).report.suspicions
    assert any("along z `dvl` goes the other way than `position`" in text for text in found), found


def test_commands_out_of_range_are_said():
    found = suspicions(log().assign(t1=log().t1 * 400 + 1500, t2=log().t2 * 3))
    assert any("commands of `t1` go from" in text and 'widths of pulses? `unit = "us"`' in text for text in found)
    assert any("commands of `t2` go from" in text and "clips them to -1 to 1" in text for text in found)


def test_an_angle_in_degrees_is_said():
    spec = mujoco.MjSpec.from_string("""<mujoco><worldbody><body><joint name="fin"/><geom size="0.1" mass="1"/></body></worldbody>
      <sensor><jointpos name="angle" joint="fin"/></sensor></mujoco>""")
    times = np.arange(0, 10, 0.02)
    content = {"schema": "hydro-mapping/1", "sensors": {"angle": {"field": "a"}}}
    for wave, said in ((40 * np.sin(times), True), (0.7 * np.sin(times), False), (10 * times, False)):
        frame = pandas.DataFrame({"t": times, "a": wave})
        found = trials.from_dataframe(frame, model=spec, mapping=copy.deepcopy(content)).report
        assert any("`angle` swings to" in text and 'unit = "deg"' in text for text in found.suspicions) == said


@pytest.mark.parametrize(("unit", "factor"), [("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
def test_times_in_another_unit_are_said_and_read(unit, factor):
    frame = log().assign(time=(log().time * factor).round())
    with pytest.raises(DataError) as refusal:
        trials.from_dataframe(frame, model=model(), mapping=mapping())
    assert f'is it in {unit}? `[time] unit = "{unit}"`' in str(refusal.value) and str(refusal.value).count("\n") < 3
    content = mapping() | {"time": {"unit": unit, "period": 0.02}}
    assert trials.from_dataframe(frame, model=model(), mapping=content).report.suspicions == []


def test_seconds_read_as_milliseconds_are_said():
    content = mapping() | {"time": {"unit": "us", "period": 0.02}}
    with pytest.raises(DataError, match=r"is it in s\? `\[time\] unit = \"s\"`"):
        trials.from_dataframe(log(), model=model(), mapping=content)


def test_stamps_that_stand_still_or_run_back_are_said():
    times = log().time.to_numpy().copy()
    times[::5] = times[np.maximum(np.arange(0, times.size, 5) - 1, 0)]
    found = trials.from_dataframe(log().assign(time=times), model=model(), mapping=mapping()).report
    assert any("% of the stamps of `table` are the same as the one before" in text for text in found.suspicions)
    assert any("have the stamp of another, dropped" in text for text in found.notes)
    times = log().time.to_numpy().copy()
    times[700:] -= 3.0
    found = trials.from_dataframe(log().assign(time=times), model=model(), mapping=mapping()).report
    assert any("run back 1 times, by up to 2.98 s" in text for text in found.suspicions)
    times[10] = np.nan
    found = trials.from_dataframe(log().assign(time=times), model=model(), mapping=mapping()).report
    assert any("1 sample without a time dropped" in text for text in found.notes)


def ros(path, *, shift, drift=0.0):
    """An MCAP file whose IMU has another clock than the rest."""
    made = dive.swim(8.0, 5)
    real = writers.messages

    def changed(times, commands, readings, epoch):
        for at, topic, kind, message in real(times, commands, readings, epoch):
            if topic == "/imu/data":
                stamp = message.header.stamp
                nanoseconds = stamp.sec * 10**9 + stamp.nanosec
                nanoseconds += round(shift * 1e9 + drift * (nanoseconds - epoch))
                message.header = type(message.header)(type(stamp)(*divmod(nanoseconds, 10**9)), "imu")
            yield at, topic, kind, message

    writers.messages = changed
    try:
        writers.mcap(path, made.times, made.commands, made.readings, dive.EPOCH)
    finally:
        writers.messages = real
    vector = [f"angular_velocity.{axis}" for axis in "xyz"]
    return {
        "schema": "hydro-mapping/1",
        "time": {"clock": "header.stamp"},
        "sensors": {
            "imu_gyro": {"topic": "/imu/data", "fields": vector},
            "dvl": {"topic": "/dvl", "fields": [f"twist.linear.{axis}" for axis in "xyz"]},
        },
        "actuators": {
            n: {"topic": "/thrusters", "field": f"data[{k}]", "clock": "log"} for k, n in enumerate(ACTUATORS)
        },
    }


def test_mixed_clocks_are_said_and_aligned(tmp_path):
    content = ros(tmp_path / "a.mcap", shift=-1.7e9)
    with pytest.raises(
        DataError, match=r"no trial: .*(\n.*)?mixed clocks: the stamps of `/imu/data` are 1.7e\+09 s behind"
    ):
        trials.from_mcap(tmp_path / "a.mcap", model=model(), mapping=content | {"trials": {"shortest": 100}})
    content["time"]["align"] = True
    found = trials.from_mcap(tmp_path / "a.mcap", model=model(), mapping=content)
    assert len(found) == 1 and not found.report.suspicions
    assert any("`header.stamp` moved by 1.7e+09 s" in text for text in found.report.notes)
    assert np.isfinite(found.trials[0].sensor("imu_gyro")).mean() > 0.95


def test_stamps_that_were_never_set_are_said(tmp_path):
    content = ros(tmp_path / "a.mcap", shift=0.0, drift=-1.0)
    with pytest.raises(DataError, match=r"(?s)no trial.*suspected: .*100 % of the stamps of `/imu/data` are the same"):
        only = content["sensors"] | {}
        only.pop("dvl")
        trials.from_mcap(tmp_path / "a.mcap", model=model(), mapping=content | {"sensors": only})


def test_clocks_that_drift_apart_are_said(tmp_path):
    content = ros(tmp_path / "a.mcap", shift=0.0, drift=0.1)
    found = trials.from_mcap(tmp_path / "a.mcap", model=model(), mapping=content).report
    assert any("drift apart: their difference spreads over 0.7" in text for text in found.suspicions)
    assert any("before the log's time" in text or "after the log's time" in text for text in found.notes)


def test_log_times_that_jitter_are_said(tmp_path):
    made = dive.swim(8.0, 5)
    writers.LATEST, usual = 25_000_000, writers.LATEST
    try:
        writers.mcap(tmp_path / "a.mcap", made.times, made.commands, made.readings, dive.EPOCH)
    finally:
        writers.LATEST = usual
    content = {
        "schema": "hydro-mapping/1",
        "sensors": {"imu_gyro": {"topic": "/imu/data", "fields": [f"angular_velocity.{axis}" for axis in "xyz"]}},
        "actuators": {n: {"topic": "/thrusters", "field": f"data[{k}]"} for k, n in enumerate(ACTUATORS)},
    }
    found = trials.from_mcap(tmp_path / "a.mcap", model=model(), mapping=content).report
    assert any("`/imu/data`" in text and "log times are uneven" in text for text in found.notes)


def test_samples_are_put_in_order_and_one_of_a_stamp_is_kept():
    samples = Samples(("a",), np.array([0.0, 1.0, 1.0, 0.5, np.nan, 2.0]), np.arange(6.0)[:, None])
    report = Report("log", "kind")
    found = clock.ordered("a", samples, None, Time(), report)
    np.testing.assert_array_equal(found.times, [0, 0.5, 1, 2])
    np.testing.assert_array_equal(found.rows, [0, 3, 1, 5])
