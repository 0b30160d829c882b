"""Conversion: the trials of a simulated dive against what was simulated; times, gaps, starts, files."""

import contextlib
import functools
import io
import json
import subprocess
from pathlib import Path

import mujoco
import numpy as np
import pandas
import pytest

import dive
import hydro_mujoco
import writers
from hydro_mujoco import plugin, trials
from hydro_mujoco.errors import DataError
from hydro_mujoco.trials import __main__ as command

pytestmark = pytest.mark.skipif(not plugin.built_library().is_file(), reason="no plugin library: cargo build --release")
PROGRAM = Path(plugin.built_library()).with_name("hydro")
SECONDS = 12.0
ACTUATORS = [f"t{n}" for n in range(1, 9)]


@functools.cache
def run():
    return dive.swim(SECONDS, 5)


@functools.cache
def nominal():
    return dive.vehicle(dive.KNOWN)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out, made = tmp_path_factory.mktemp("logs"), run()
    parts = made.times, made.commands, made.readings
    writers.mcap(out / "a.mcap", *parts, dive.EPOCH)
    writers.rosbag(out / "bag", *parts, dive.EPOCH)
    writers.dataflash(out / "a.bin", *parts)
    table().to_csv(out / "a.csv", index=False)
    return out


def table(every=4):
    made = run()
    columns = {"time": made.times}
    columns |= {name: made.commands[:, n] for n, name in enumerate(ACTUATORS)}
    for name, values in made.readings.items():
        columns |= {f"{name}_{k}": values[:, k] for k in range(values.shape[1])}
    return pandas.DataFrame(columns)[::every].reset_index(drop=True)


def ros(**time):
    source = {"topic": "/imu/data", "frame": "FLU"}
    return {
        "schema": "hydro-mapping/1",
        "time": {"clock": "header.stamp", "period": 0.02} | time,
        "sensors": {
            "imu_gyro": source | {"fields": [f"angular_velocity.{axis}" for axis in "xyz"], "filter": False},
            "attitude": {
                "topic": "/imu/data",
                "fields": [f"orientation.{a}" for a in "xyzw"],
                "order": "xyzw",
                "frame": "ENU",
            },
            "position": {"topic": "/pressure", "fields": ["", "", "fluid_pressure"], "unit": "Pa"},
            "dvl": {"topic": "/dvl", "fields": [f"twist.linear.{axis}" for axis in "xyz"], "frame": "FLU"},
        },
        "actuators": {
            name: {"topic": "/thrusters", "field": f"data[{n}]", "clock": "log"} for n, name in enumerate(ACTUATORS)
        },
    }


def ardupilot():
    return {
        "schema": "hydro-mapping/1",
        "time": {"period": 0.02},
        "sensors": {
            "imu_gyro": {"topic": "IMU", "fields": ["GyrX", "GyrY", "GyrZ"], "frame": "FRD", "filter": False},
            "attitude": {"topic": "ATT", "fields": ["Roll", "Pitch", "Yaw"], "unit": "deg", "frame": "NED/FRD"},
            "position": {"topic": "XKF1", "fields": ["PN", "PE", "PD"], "frame": "NED"},
            "velocity": {"topic": "XKF1[0]", "fields": ["VN", "VE", "VD"], "frame": "NED"},
        },
        "actuators": {name: {"topic": "RCOU", "field": f"C{n + 1}", "unit": "us"} for n, name in enumerate(ACTUATORS)},
    }


def columns_of(name, count):
    return [f"{name}_{k}" for k in range(count)]


def tabular():
    return {
        "schema": "hydro-mapping/1",
        "time": {"period": 0.02},
        "sensors": {
            name: {"fields": columns_of(name, 4 if name == "attitude" else 3)}
            for name in ("imu_gyro", "attitude", "position", "dvl")
        },
        "actuators": {name: {"field": name} for name in ACTUATORS},
    }


def at(trial, offset=0.0):
    """Rows of the simulation that a trial's rows show. offset: of the log's time."""
    times = trial.start - offset + trial.sensor_times - 0.005
    rows = np.round(times / 0.005).astype(int)
    np.testing.assert_allclose(times, rows * 0.005, atol=1e-6)
    return rows


def same_turn(found, wanted, atol):
    np.testing.assert_allclose(np.abs((found * wanted).sum(1)), 1, atol=atol)


def test_ros_messages_become_the_simulated_readings(folder):
    for converted in (
        trials.from_mcap(folder / "a.mcap", model=nominal(), mapping=ros()),
        trials.from_rosbag(folder / "bag", model=nominal(), mapping=ros()),
    ):
        (trial,) = converted
        made = run()
        # The log begins when its first message arrives, up to 8 ms after its stamp.
        late = -trial.start if trial.start < 0 else 0.02 - trial.start
        first = np.argmin(np.abs(made.readings["imu_gyro"] - trial.sensor("imu_gyro")[0]).sum(1))
        rows = first + 4 * np.arange(len(trial.sensor_times))
        assert abs(late) < 0.03 and first in (0, 2, 4)
        np.testing.assert_allclose(trial.sensor("imu_gyro"), made.readings["imu_gyro"][rows], atol=1e-5)
        same_turn(trial.sensor("attitude"), made.readings["attitude"][rows], 1e-9)
        depth = trial.sensor("position")
        assert np.isnan(depth[:, :2]).all()
        known = np.isfinite(depth[:, 2])
        assert known.mean() == pytest.approx(0.4, abs=0.03)
        np.testing.assert_allclose(depth[known, 2], made.readings["position"][rows][known, 2], atol=2e-4)
        known = np.isfinite(trial.sensor("dvl")).all(1)
        assert known.mean() == pytest.approx(0.2, abs=0.02)
        np.testing.assert_allclose(trial.sensor("dvl")[known], made.readings["dvl"][rows][known], atol=2e-3)
        # A command is held from its log time, up to 8 ms late, until the next.
        steps = rows[0] + np.arange(len(trial.control_times)) - 1
        late = [np.abs(trial.controls[4:] - made.commands[(steps - n).clip(0)][4:]).max() for n in (0, 1, 2)]
        assert min(late) < 0.1 and set(np.round(trial.controls.ravel(), 9)) <= set(np.round(made.commands.ravel(), 9))


def test_ardupilot_is_turned_into_the_model_s_frames(folder):
    (trial,) = trials.from_ardupilot(folder / "a.bin", model=nominal(), mapping=ardupilot())
    made, rows = run(), at(trial, 17.25)
    np.testing.assert_allclose(trial.sensor("imu_gyro"), made.readings["imu_gyro"][rows], atol=1e-6)
    np.testing.assert_allclose(trial.sensor("position"), made.readings["position"][rows], atol=1e-6)
    np.testing.assert_allclose(trial.sensor("velocity"), made.readings["velocity"][rows], atol=1e-6)
    same_turn(trial.sensor("attitude"), made.readings["attitude"][rows], 1e-9)
    # Pulses are whole microseconds: a four hundredth of the range, half of it by rounding.
    assert trial.actuators == tuple(ACTUATORS)
    steps = rows[0] + np.arange(len(trial.control_times))
    np.testing.assert_allclose(trial.controls, made.commands[steps], atol=0.5 / 400 + 1e-9)
    assert trial.sensor_times[0] == pytest.approx(0.005) and trial.control_times[0] == 0


@pytest.mark.parametrize("kind", ["csv", "parquet", "frame", "polars-like"])
def test_tables_become_the_simulated_readings(folder, tmp_path, kind):
    if kind == "csv":
        converted = trials.from_csv(folder / "a.csv", model=nominal(), mapping=tabular())
    elif kind == "parquet":
        table().to_parquet(tmp_path / "a.parquet")
        converted = trials.from_parquet(tmp_path / "a.parquet", model=nominal(), mapping=tabular())
    else:
        frame = table()
        if kind == "polars-like":
            frame = type("Frame", (), {"to_pandas": lambda self: table()})()
        converted = trials.from_dataframe(frame, model=nominal(), mapping=tabular())
    (trial,) = converted
    made, rows = run(), at(trial)
    for name in ("imu_gyro", "position", "dvl"):
        np.testing.assert_allclose(trial.sensor(name), made.readings[name][rows], atol=1e-9)
    same_turn(trial.sensor("attitude"), made.readings["attitude"][rows], 1e-12)
    np.testing.assert_allclose(trial.controls, made.commands[rows[0] + np.arange(len(trial.control_times))])


def test_ulog_is_converted(tmp_path):
    from ulog import Ulog

    made = run()
    fields = [("uint64_t", "timestamp"), ("float[3]", "xyz")]
    motors = [("uint64_t", "timestamp"), ("float[8]", "control")]
    log = Ulog(tmp_path / "a.ulg", {"vehicle_angular_velocity": fields, "actuator_motors": motors})
    log.subscribe("vehicle_angular_velocity")
    log.subscribe("actuator_motors")
    for row in range(0, len(made.times), 4):
        stamp = 3_000_000 + round(made.times[row] * 1e6)
        log.write("actuator_motors", stamp, *made.commands[row])
        x, y, z = made.readings["imu_gyro"][row]
        log.write("vehicle_angular_velocity", stamp, x, -y, -z)
    log.close()
    mapping = {
        "schema": "hydro-mapping/1",
        "sensors": {
            "imu_gyro": {"topic": "vehicle_angular_velocity", "fields": ["xyz[0]", "xyz[1]", "xyz[2]"], "frame": "FRD"}
        },
        "actuators": {n: {"topic": "actuator_motors", "field": f"control[{k}]"} for k, n in enumerate(ACTUATORS)},
    }
    (trial,) = trials.from_ulog(tmp_path / "a.ulg", model=nominal(), mapping=mapping)
    assert trial.start == pytest.approx(3.0)
    np.testing.assert_allclose(trial.sensor("imu_gyro"), made.readings["imu_gyro"][at(trial, 3.0)], atol=1e-6)


def odometry():
    where = {"topic": "/odometry", "frame": "ENU"}
    return ros(clock="header.stamp") | {
        "state": {
            "rov": {
                "position": where | {"fields": [f"pose.pose.position.{a}" for a in "xyz"]},
                "attitude": where | {"fields": [f"pose.pose.orientation.{a}" for a in "xyzw"], "order": "xyzw"},
                "linear_velocity": {
                    "topic": "/odometry",
                    "frame": "FLU",
                    "fields": [f"twist.twist.linear.{a}" for a in "xyz"],
                },
                "angular_velocity": {
                    "topic": "/odometry",
                    "frame": "FLU",
                    "fields": [f"twist.twist.angular.{a}" for a in "xyz"],
                },
            }
        },
        "trials": {"windows": [[2, 5], [6, 9]]},
    }


def test_a_start_leads_the_truth_along_the_log(folder):
    """From the start that was mapped the true model gives the readings of the trial, labelled as mj_step labels them."""
    converted = trials.from_mcap(folder / "a.mcap", model=nominal(), mapping=odometry())
    assert len(converted) == 2
    model = dive.vehicle(dive.KNOWN | dive.LACKING).compile()
    for trial in converted:
        assert trial.initial_state[0] == 0
        data = mujoco.MjData(model)
        mujoco.mj_setState(model, data, trial.initial_state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        rows = []
        for command_row in trial.controls[:200]:
            data.ctrl[:] = command_row
            mujoco.mj_step(model, data)
            rows.append([data.time, *data.sensordata[:13]])
        rows = np.array(rows)
        shown = trial.sensor_times < 1.0
        step = np.round(trial.sensor_times[shown] / 0.005).astype(int) - 1
        np.testing.assert_allclose(rows[step, 0], trial.sensor_times[shown], atol=1e-9)
        np.testing.assert_allclose(rows[step, 1:4], trial.sensor("imu_gyro")[shown], atol=0.04)
        known = np.isfinite(trial.sensor("dvl")[shown]).all(1)
        np.testing.assert_allclose(rows[step][known, 11:14], trial.sensor("dvl")[shown][known], atol=0.01)


def test_a_start_that_is_not_in_the_log_is_left_out_and_said(folder, tmp_path):
    mapping = ros() | {"state": odometry()["state"]}
    mapping["state"]["rov"]["linear_velocity"] = {
        "topic": "/odometry",
        "fields": ["pose.covariance[0]"] * 3,
        "scale": float("1e300"),
        "offset": 1,
    }
    converted = trials.from_mcap(folder / "a.mcap", model=nominal(), mapping=mapping)
    assert converted.trials[0].initial_state is not None
    spec = mujoco.MjSpec.from_string(nominal().to_xml())
    spec.body("rov").add_body(name="tail").add_joint(name="ball", type=mujoco.mjtJoint.mjJNT_BALL)
    spec.body("tail").add_geom(size=[0.1, 0, 0])
    with pytest.raises(DataError, match="joints that are ball joints or have no name"):
        trials.from_mcap(folder / "a.mcap", model=spec, mapping=odometry())


def test_the_file_is_that_of_mujoco_sysid(folder, tmp_path):
    sysid = pytest.importorskip("mujoco.sysid")
    mapping = odometry()
    converted = trials.from_mcap(folder / "a.mcap", model=nominal(), mapping=mapping, out=tmp_path)
    paths = sorted(tmp_path.glob("*.npz"))
    assert [path.stem for path in paths] == ["a-00", "a-01"] == [trial.name for trial in converted]
    with np.load(paths[0], allow_pickle=False) as archive:
        assert set(archive) == {
            "control_times", "control_data", "control_signal_mapping", "sensordata_times", "sensordata_data",
            "sensordata_signal_mapping", "initial_state",
        }  # fmt: skip
        np.testing.assert_array_equal(archive["sensordata_data"], converted.trials[0].readings)
        assert json.loads(str(archive["control_signal_mapping"]))["t3_ctrl"] == [5, [2]]
        assert json.loads(str(archive["sensordata_signal_mapping"]))["attitude"] == [0, [3, 4, 5, 6]]
    report = json.loads((tmp_path / "a.conversion.json").read_text())
    assert report["schema"] == "hydro-conversion/1" and len(report["trials"]) == 2
    model = nominal().compile()
    loaded = sysid.SystemTrajectory.load_from_disk(paths[0], model, allow_missing_sensors=True)
    np.testing.assert_array_equal(loaded.sensordata.times, converted.trials[0].sensor_times)
    np.testing.assert_array_equal(loaded.control.data, converted.trials[0].controls)
    np.testing.assert_array_equal(loaded.initial_state, converted.trials[0].initial_state)


def test_hydro_gap_reads_the_trials(folder, tmp_path):
    if not PROGRAM.is_file():
        pytest.skip("no program hydro: cargo build --release")
    (tmp_path / "nominal.xml").write_text(compiled_xml())
    mapping = ardupilot() | {"trials": {"length": 3.0}}
    trials.from_ardupilot(folder / "a.bin", model=nominal(), mapping=mapping, out=tmp_path / "trials")
    found = subprocess.run(
        [PROGRAM, "gap", "find", "--model", tmp_path / "nominal.xml", "--trials", tmp_path / "trials", "--out", tmp_path / "gap"],
        capture_output=True, text=True,
    )  # fmt: skip
    assert found.returncode == 0, found.stderr
    remarks = json.loads((tmp_path / "gap" / "find.json").read_text())
    assert "squared difference" in found.stdout + found.stderr and remarks


def compiled_xml():
    spec = dive.vehicle(dive.KNOWN)
    spec.compile()
    return spec.to_xml()


def test_trials_are_not_replaced_unasked(folder, tmp_path):
    parts = {"model": nominal(), "mapping": ros() | {"trials": {"length": 4.0}}, "out": tmp_path / "out"}
    assert len(trials.from_mcap(folder / "a.mcap", **parts)) == 3
    with pytest.raises(DataError, match="a-0.* is there already: --overwrite"):
        trials.from_mcap(folder / "a.mcap", **parts)
    parts["mapping"] = ros() | {"trials": {"length": 6.0}}
    trials.from_mcap(folder / "a.mcap", **parts, overwrite=True)
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["a-00.npz", "a-01.npz", "a.conversion.json"]
    (tmp_path / "file").write_text("")
    with pytest.raises(DataError, match="folder .*file"):
        trials.from_mcap(folder / "a.mcap", **parts | {"out": tmp_path / "file"})


def test_a_disk_that_fills_leaves_no_trial(folder, tmp_path, monkeypatch):
    import hydro_mujoco.trials.convert as convert

    write = convert.write_npz

    def fails(path, arrays):
        if path.name.startswith(".a-01.npz"):
            raise OSError(28, "No space left on device")
        write(path, arrays)

    monkeypatch.setattr(convert, "write_npz", fails)
    with pytest.raises(DataError, match="No space left"):
        trials.from_mcap(folder / "a.mcap", model=nominal(), mapping=ros() | {"trials": {"length": 4.0}}, out=tmp_path)
    assert not list(tmp_path.iterdir())


def test_a_conversion_that_was_cut_short_is_made_again_unasked(folder, tmp_path, monkeypatch):
    parts = {"model": nominal(), "mapping": ros() | {"trials": {"length": 4.0}}, "out": tmp_path}
    import hydro_mujoco.trials.convert as convert

    def content():
        return {path.name: path.read_bytes() for path in tmp_path.iterdir()}

    trials.from_mcap(folder / "a.mcap", **parts)
    whole, replace, moved = content(), convert.os.replace, []

    def once(new, path):
        if not str(new).endswith(".tmp"):
            if len(moved) == 1:
                raise OSError(28, "No space left on device")
            moved.append(path.name)
        replace(new, path)

    monkeypatch.setattr(convert.os, "replace", once)
    with pytest.raises(DataError, match="No space left"):
        trials.from_mcap(folder / "a.mcap", **parts, overwrite=True)
    monkeypatch.undo()
    assert (tmp_path / ".a.unfinished").exists()
    # As a killed process leaves them.
    digits = "0123456789ab"
    for name in (f".a-00.npz.{digits}", f".a-01.npz.{digits}.{digits}.tmp", f"a.conversion.json.{digits}.tmp"):
        (tmp_path / name).write_text("half")
    with pytest.warns(hydro_mujoco.errors.Notice, match="a conversion was cut short there"):
        trials.from_mcap(folder / "a.mcap", **parts)
    assert content() == whole


def frame_with(**changes):
    return table().assign(**changes)


def converted(frame, **parts):
    return trials.from_dataframe(frame, model=nominal(), mapping=tabular() | parts)


def test_gaps_end_trials_and_short_pieces_go():
    frame = table()
    kept = frame[(frame.time < 5) | (frame.time > 6.5) & (frame.time < 7.5) | (frame.time > 9)]
    found = converted(kept)
    assert [round(trial.start, 2) for trial in found] == [0.0, 9.02]
    assert any("2 gaps of more than 1 s" in note for note in found.report.notes)
    assert any("1 piece shorter than 2 s dropped, the longest of 0.96 s" in note for note in found.report.notes)


def test_windows_and_modes_choose(folder):
    found = converted(table(), trials={"windows": [[1, 4], [8, 20]]})
    assert [(round(t.start, 2), round(t.start + t.sensor_times[-1] - 0.005, 2)) for t in found] == [(1, 4), (8, 11.98)]
    with pytest.raises(DataError, match="nothing was measured in the window 40 to 50 s; the log has 0.000 to 11.980 s"):
        converted(table(), trials={"windows": [[40, 50]]})
    frame = table()
    frame["mode"] = np.where((frame.time > 3) & (frame.time < 7), "MANUAL", "HOLD")
    found = converted(frame, trials={"mode": {"topic": "table", "field": "mode", "values": ["MANUAL"]}})
    assert len(found) == 1 and found.trials[0].start == pytest.approx(3.02) and found.trials[0].sensor_times[-1] < 4.1
    with pytest.raises(DataError, match="`mode` of `table` is never `AUTO`; it is `HOLD`, `MANUAL`"):
        converted(frame, trials={"mode": {"topic": "table", "field": "mode", "values": ["AUTO"]}})


def test_nothing_is_extrapolated():
    frame = frame_with()
    frame.loc[frame.time < 2, "dvl_0"] = np.nan
    frame.loc[(frame.time > 5) & (frame.time < 5.5), "dvl_0"] = np.nan
    frame.loc[frame.time < 1, "t3"] = np.nan
    (trial,) = converted(frame)
    # Commands are there from 1 s on only.
    assert trial.start == pytest.approx(0.0) or trial.start == pytest.approx(1.0)
    times = trial.start + trial.sensor_times - 0.005
    missing = np.isnan(trial.sensor("dvl")[:, 0])
    np.testing.assert_array_equal(missing, (times < 2 - 1e-9) | (times > 5 + 1e-9) & (times < 5.5 - 1e-9))
    assert np.isfinite(trial.controls).all() and np.isfinite(trial.sensor("dvl")[:, 1]).all()


def test_a_joint_is_prescribed_and_degrees_are_unwrapped():
    spec = mujoco.MjSpec.from_string("""<mujoco><worldbody><body name="a"><joint name="yaw" axis="0 0 1"/>
      <geom size="0.1" mass="1"/></body></worldbody><sensor><jointpos name="angle" joint="yaw"/></sensor></mujoco>""")
    times = np.arange(0, 5, 0.02)
    frame = pandas.DataFrame({"t": times, "a": np.degrees(2 * times) % 360})
    mapping = {
        "schema": "hydro-mapping/1",
        "joints": {"yaw": {"field": "a", "unit": "deg"}},
        "sensors": {"angle": {"field": "a", "unit": "deg", "scale": -1, "offset": 0.5}},
    }
    found = trials.from_dataframe(frame, model=spec, mapping=mapping)
    (trial,) = found
    np.testing.assert_allclose(trial.sensor("yaw")[:, 0], 2 * (trial.sensor_times - trial.sensor_times[0]), atol=1e-9)
    np.testing.assert_allclose(
        trial.sensor("angle")[:, 0], 0.5 - 2 * (trial.sensor_times - trial.sensor_times[0]), atol=1e-9
    )
    assert any("jump" in note for note in found.report.notes) and trial.controls.shape[1] == 0


def test_pulses_tables_scales_and_constants():
    frame = frame_with(t1=np.where(table().time < 4, 1100, 1700), t2=np.where(table().time < 4, 1, 3))
    actuators = tabular()["actuators"] | {
        "t1": {"field": "t1", "unit": "us", "pulse": [1900, 1500, 1100]},
        "t2": {"field": "t2", "table": [[1, -0.5], [2, 0], [4, 1]]},
        "t3": {"constant": 0.25},
        "t4": {"field": "t4", "scale": 2, "offset": 0.1},
    }
    (trial,) = converted(frame, actuators=actuators)
    early = trial.control_times < 3.9
    late = trial.control_times > 4.1
    assert (trial.controls[early, 0] == 1).all() and (trial.controls[late, 0] == -0.5).all()
    assert (trial.controls[early, 1] == -0.5).all() and (trial.controls[late, 1] == 0.5).all()
    assert (trial.controls[:, 2] == 0.25).all()
    np.testing.assert_allclose(trial.controls[:, 3], 2 * run().commands[np.arange(len(trial.controls)), 3] + 0.1)


def test_a_delay_moves_a_signal():
    mapping = tabular()
    mapping["sensors"]["dvl"]["delay"] = 0.1
    (trial,) = trials.from_dataframe(table(), model=nominal(), mapping=mapping)
    rows = at(trial) + 20
    known = rows < len(run().times)
    np.testing.assert_allclose(trial.sensor("dvl")[known][:-6], run().readings["dvl"][rows[known]][:-6], atol=1e-9)


def test_a_silence_of_commands_is_said():
    frame = table()
    found = converted(frame.assign(t5=frame.t5.where((frame.time < 3) | (frame.time > 6))))
    assert any("`t5`: no command for" in note and "held" in note for note in found.report.notes)


def test_a_topic_that_is_not_there_lists_those_that_are(folder):
    mapping = ros()
    mapping["sensors"]["dvl"]["topic"] = "/dvl/twist"
    with pytest.raises(
        DataError,
        match=r"\[sensors.dvl\]: the log .* has no message of topic `/dvl/twist`.*it holds `/dvl`, `/imu/data`",
    ):
        trials.from_mcap(folder / "a.mcap", model=nominal(), mapping=mapping)
    with pytest.raises(DataError, match="which column is the time"):
        trials.from_dataframe(table().rename(columns={"time": "clock"}), model=nominal(), mapping=tabular())
    with pytest.raises(DataError, match="none of the .* samples in `table` is a number"):
        converted(frame_with(dvl_0=np.nan, dvl_1=np.nan, dvl_2=np.nan))


def test_the_last_moment_of_a_cut_log_is_said(folder, tmp_path):
    whole = (folder / "a.bin").read_bytes()
    (tmp_path / "cut.bin").write_bytes(whole[: len(whole) * 2 // 3 + 5])
    found = trials.from_ardupilot(tmp_path / "cut.bin", model=nominal(), mapping=ardupilot())
    assert found.trials[0].sensor_times[-1] < 0.7 * SECONDS
    assert any("the file ends within a message" in text for text in found.report.suspicions)


def test_the_command_line(folder, tmp_path, capsys):
    model = tmp_path / "nominal.xml"
    model.write_text(compiled_xml())
    log = str(folder / "a.bin")
    assert command.main(["convert", log, "--model", str(model), "--dry-run"]) == 0
    shown = capsys.readouterr()
    assert "IMU[0]  IMU  1200 messages, 100 Hz" in shown.err and 'schema = "hydro-mapping/1"' in shown.out
    (tmp_path / "map.toml").write_text(shown.out)
    words = ["convert", log, "--model", str(model), "--mapping", str(tmp_path / "map.toml")]
    assert command.main([*words, "--out", str(tmp_path / "out")]) == 0
    assert "trials written to" in capsys.readouterr().out and list((tmp_path / "out").glob("*.npz"))
    assert command.main([*words, "--out", str(tmp_path / "out")]) == 1
    assert "is there already" in capsys.readouterr().err
    assert command.main([*words, "--dry-run", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)[0]["schema"] == "hydro-conversion/1"
    with contextlib.redirect_stderr(io.StringIO()) as said, pytest.raises(SystemExit):
        command.main(["convert", log, "--model", str(model)])
    assert "--dry-run proposes one" in said.getvalue()


def test_the_program_hydro_reaches_it(monkeypatch, capsys):
    import hydro_mujoco_entry

    monkeypatch.setattr("sys.argv", ["hydro", "trials", "convert", "none.mcap", "--model", "none.xml", "--dry-run"])
    with pytest.raises(SystemExit) as end:
        hydro_mujoco_entry.program()
    assert end.value.code == 1 and "none.mcap: no such file" in capsys.readouterr().err
    assert hydro_mujoco.trials is trials


def test_a_log_of_one_sample_is_refused():
    with pytest.raises(DataError, match="no trial: 0 pieces"):
        converted(table()[:1])


def test_trials_of_another_log_are_left_alone(folder, tmp_path):
    parts = {"model": nominal(), "mapping": tabular(), "out": tmp_path}
    trials.from_dataframe(table(), name="dive-1", **parts)
    trials.from_dataframe(table(), name="dive", **parts)
    trials.from_dataframe(table(), name="dive", **parts, overwrite=True)
    assert {path.name for path in tmp_path.glob("*.npz")} == {"dive-00.npz", "dive-1-00.npz"}
