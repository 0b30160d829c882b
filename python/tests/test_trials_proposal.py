"""What a log is said to hold, and the mapping that is proposed for it: it is used as it is."""

import tomllib

import mcap_ros2.writer
import mujoco
import numpy as np
import pandas
import pymap3d
import pytest
from rosbags.rosbag2 import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

import dive
import writers
from hydro_mujoco import plugin, trials
from hydro_mujoco.trials.proposal import messages
from hydro_mujoco.trials.proposal.match import similarity
from hydro_mujoco.trials.units import UNITS
from ulog import Ulog

pytestmark = pytest.mark.skipif(not plugin.built_library().is_file(), reason="no plugin library: cargo build --release")
ACTUATORS = [f"t{n}" for n in range(1, 9)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out, made = tmp_path_factory.mktemp("logs"), dive.swim(8.0, 5)
    parts = made.times, made.commands, made.readings
    writers.rosbag(out / "bag", *parts, dive.EPOCH)
    writers.dataflash(out / "a.bin", *parts)
    return out


def nominal():
    return dive.vehicle(dive.KNOWN)


def used(proposal, tmp_path, convert, log, **options):
    """The trials by the proposed mapping, saved and used as it is."""
    (tmp_path / "map.toml").write_text(proposal.toml)
    return convert(log, model=options.get("model") or nominal(), mapping=tmp_path / "map.toml")


def test_a_ros_bag(folder, tmp_path):
    proposal = trials.propose(folder / "bag", nominal())
    found = tomllib.loads(proposal.toml)
    assert {name: source["topic"] for name, source in found["sensors"].items()} == {
        "imu_gyro": "/imu/data",
        "attitude": "/imu/data",
        "position": "/odometry",
        "dvl": "/dvl",
    }
    assert found["sensors"]["attitude"]["order"] == "xyzw" and found["time"] == {
        "clock": "header.stamp",
        "period": 0.02,
    }
    assert [found["actuators"][name]["fields"] for name in ACTUATORS] == [[f"data[{n}]"] for n in range(8)]
    assert found["actuators"]["t1"]["clock"] == "log" and proposal.open == ["velocity", "rov_water"]
    said = str(proposal)
    assert (
        "/imu/data  sensor_msgs/msg/Imu  800 messages" in said and "nothing found for `velocity`, `rov_water`" in said
    )
    converted = used(proposal, tmp_path, trials.from_rosbag, folder / "bag")
    assert len(converted) == 4 and converted.report.suspicions == []


def test_a_dataflash_log(folder, tmp_path):
    proposal = trials.propose(folder / "a.bin", nominal())
    found = tomllib.loads(proposal.toml)
    assert found["sensors"]["imu_gyro"] == {"topic": "IMU[0]", "fields": ["GyrX", "GyrY", "GyrZ"], "frame": "FRD"}
    assert found["sensors"]["attitude"] | {"unit": "deg", "frame": "NED/FRD"} == found["sensors"]["attitude"]
    assert found["sensors"]["velocity"]["fields"] == ["VN", "VE", "VD"] and "dvl" in proposal.open
    assert found["actuators"]["t8"] == {"topic": "RCOU", "fields": ["C8"], "unit": "us"}
    converted = used(proposal, tmp_path, trials.from_ardupilot, folder / "a.bin")
    assert len(converted) == 4 and converted.report.suspicions == []


def test_a_ulog(tmp_path):
    number = [("uint64_t", "timestamp")]
    log = Ulog(
        tmp_path / "a.ulg",
        {
            "vehicle_attitude": [*number, ("float[4]", "q")],
            "sensor_combined": [*number, ("float[3]", "gyro_rad"), ("float[3]", "accelerometer_m_s2")],
            "vehicle_air_data": [*number, ("float", "baro_pressure_pa")],
            "actuator_motors": [*number, ("float[12]", "control")],
        },
    )
    for name in ("vehicle_attitude", "sensor_combined", "vehicle_air_data", "actuator_motors"):
        log.subscribe(name)
    for n in range(400):
        turn = np.sin(n / 100)
        # Upright in NED/FRD, turned about z.
        log.write("vehicle_attitude", n * 10_000, np.cos(turn), 0, 0, np.sin(turn))
        log.write("sensor_combined", n * 10_000, 0, 0, 2 * np.cos(n / 100), 0, 0, -9.8)
        log.write("vehicle_air_data", n * 10_000, 121_325 + 50 * np.sin(n / 9))
        log.write("actuator_motors", n * 10_000, *np.full(12, 0.1 * np.sin(n / 50)))
    log.close()
    proposal = trials.propose(tmp_path / "a.ulg", nominal())
    found = tomllib.loads(proposal.toml)
    assert found["sensors"]["position"] == {
        "topic": "vehicle_air_data",
        "fields": ["", "", "baro_pressure_pa"],
        "unit": "Pa",
    }
    assert found["sensors"]["attitude"]["order"] == "wxyz" and found["actuators"]["t3"]["fields"] == ["control[2]"]
    converted = used(proposal, tmp_path, trials.from_ulog, tmp_path / "a.ulg")
    assert converted.report.suspicions == []
    np.testing.assert_allclose(np.nanmean(converted.trials[0].sensor("position")[:, 2]), -20_000 / 9806.65, atol=0.02)


@pytest.mark.parametrize("names", ["{name}_{axis}", "{name}[{index}]", "{name}.{axis}"])
def test_a_table_by_names(names, tmp_path):
    made = dive.swim(8.0, 5)
    columns = {"time": made.times} | {f"{name}_cmd": made.commands[:, n] for n, name in enumerate(ACTUATORS)}
    for name, values in made.readings.items():
        axes = "wxyz" if values.shape[1] == 4 else "xyz"
        columns |= {names.format(name=name, axis=axis, index=k): values[:, k] for k, axis in enumerate(axes)}
    pandas.DataFrame(columns)[::4].to_csv(tmp_path / "a.csv", index=False)
    proposal = trials.propose(tmp_path / "a.csv", nominal())
    assert proposal.open == ["rov_water"], proposal.toml
    converted = used(proposal, tmp_path, trials.from_csv, tmp_path / "a.csv")
    for name, values in made.readings.items():
        shown = converted.trials[0].sensor(name)
        np.testing.assert_allclose(shown, values[::4][: len(shown)], atol=1e-9)


def test_joints_by_the_name_in_the_message(tmp_path):
    spec = mujoco.MjSpec.from_string("""<mujoco><worldbody><body><joint name="hip"/><geom size="0.1" mass="1"/>
      <body><joint name="knee"/><geom size="0.1" mass="1"/></body></body></worldbody>
      <actuator><motor name="hip" joint="hip"/><motor name="knee" joint="knee"/></actuator>
      <sensor><jointpos name="q_hip" joint="hip"/><jointvel name="v_knee" joint="knee"/></sensor></mujoco>""")
    kind = "sensor_msgs/msg/JointState"
    with open(tmp_path / "a.mcap", "wb") as file:
        writer = mcap_ros2.writer.Writer(file)
        text, _ = writers.STORE.generate_msgdef(kind, ros_version=2)
        schemas = [writer.register_msgdef(kind, text), writer.register_msgdef("std_msgs/msg/Float64", "float64 data")]
        for n in range(400):
            stamp = {"sec": n // 100, "nanosec": n % 100 * 10**7}
            joints = {"name": ["knee", "hip"], "position": [0.1 * n, 0.2], "velocity": [10.0, 0.0], "effort": []}
            writer.write_message(
                "/joint_states", schemas[0], joints | {"header": {"stamp": stamp, "frame_id": ""}}, log_time=n * 10**7
            )
            for name in ("hip", "knee"):
                writer.write_message(f"/{name}/command", schemas[1], {"data": len(name) + n / 400}, log_time=n * 10**7)
                writer.write_message(f"/{name}", schemas[1], {"data": float(len(name))}, log_time=n * 10**7)
        writer.finish()
    proposal = trials.propose(tmp_path / "a.mcap", spec)
    found = tomllib.loads(proposal.toml)
    assert found["sensors"]["q_hip"]["fields"] == ["position[hip]"]
    assert found["sensors"]["v_knee"]["fields"] == ["velocity[knee]"]
    assert {source["topic"] for source in found["actuators"].values()} <= {
        "/hip",
        "/knee",
        "/hip/command",
        "/knee/command",
    }
    converted = used(proposal, tmp_path, trials.from_mcap, tmp_path / "a.mcap", model=spec)
    np.testing.assert_allclose(converted.trials[0].sensor("q_hip"), 0.2)
    np.testing.assert_allclose(converted.trials[0].sensor("v_knee"), 10.0)


WATCHED = """<mujoco><option timestep="0.01"/><worldbody><body name="rov" pos="0 0 -1"><freejoint/>
  <geom size="0.1" mass="1"/><site name="s"/></body></worldbody><sensor>{}<framequat name="attitude" objtype="site" objname="s"/>
  <framepos name="position" objtype="site" objname="s"/></sensor></mujoco>"""
#: North, east and down [m] of a vehicle that swims a square with its nose ahead; its course [rad from north].
SPEED, ORIGIN = 0.8, (54.3, 10.15, 0.0)


def circling(times):
    """North, east, down [m]; their rates [m/s]; yaw from north [rad]."""
    course = 0.4 * times
    radius = SPEED / 0.4
    place = np.column_stack([radius * np.sin(course), radius * (1 - np.cos(course)), 1 + 0.3 * np.sin(0.5 * times)])
    moving = np.column_stack([SPEED * np.cos(course), SPEED * np.sin(course), 0.15 * np.cos(0.5 * times)])
    return place, moving, course


def test_px4_s_global_position_and_velocity_become_those_of_a_dvl(tmp_path):
    """vehicle_global_position by WGS84, vehicle_local_position's velocity turned into the body by vehicle_attitude."""
    stamp = [("uint64_t", "timestamp")]
    log = Ulog(
        tmp_path / "a.ulg",
        {
            "vehicle_attitude": [*stamp, ("float[4]", "q")],
            "vehicle_global_position": [*stamp, ("double", "lat"), ("double", "lon"), ("float", "alt")],
            "vehicle_local_position": [*stamp, *(("float", field) for field in ("vx", "vy", "vz"))],
        },
    )
    for name in ("vehicle_attitude", "vehicle_global_position", "vehicle_local_position"):
        log.subscribe(name)
    times = np.arange(0, 12, 0.02)
    place, moving, yaw = circling(times)
    for time, (north, east, down), velocity, angle in zip(times, place, moving, yaw):
        at = round(time * 1e6)
        log.write("vehicle_attitude", at, np.cos(angle / 2), 0, 0, np.sin(angle / 2))
        log.write("vehicle_global_position", at, *pymap3d.ned2geodetic(north, east, down, *ORIGIN))
        log.write("vehicle_local_position", at, *velocity)
    log.close()
    spec = mujoco.MjSpec.from_string(WATCHED.format('<velocimeter name="dvl" site="s"/>'))
    proposal = trials.propose(tmp_path / "a.ulg", spec)
    found = tomllib.loads(proposal.toml)["sensors"]
    assert found["position"] == {
        "topic": "vehicle_global_position", "fields": ["lat", "lon", "alt"], "frame": "WGS84",
    }  # fmt: skip
    assert found["dvl"] == {"topic": "vehicle_local_position", "fields": ["vx", "vy", "vz"], "frame": "NED"}
    converted = used(proposal, tmp_path, trials.from_ulog, tmp_path / "a.ulg", model=spec)
    assert converted.report.suspicions == [] and proposal.open == []
    for trial in converted:
        at = trial.start + trial.sensor_times - spec.option.timestep
        place, moving, _ = circling(at)
        # The log's zero is the first fix, 1 m deep.
        east_north_up = np.column_stack([place[:, 1], place[:, 0], 1 - place[:, 2]])
        np.testing.assert_allclose(trial.sensor("position"), east_north_up, atol=2e-3)
        forward = np.column_stack([np.full(len(at), SPEED), np.zeros(len(at)), -moving[:, 2]])
        np.testing.assert_allclose(trial.sensor("dvl"), forward, atol=2e-4)


def test_ardupilot_s_gps_becomes_a_position(tmp_path):
    """GPS.Lat and Lng, 1e-7 degrees in the file, beside XKF1, which has the same place in metres."""
    log = writers.DataFlash(tmp_path / "a.bin")
    log.FORMATS |= {"L": "i", "e": "i"}
    log.format("GPS", "QBBLLe", "TimeUS,I,Status,Lat,Lng,Alt", "s#-DUm")
    log.format("ATT", "Qfff", "TimeUS,Roll,Pitch,Yaw", "sddd")
    times = np.arange(0, 12, 0.02)
    place, _, yaw = circling(times)
    for row, time in enumerate(times):
        at = round(time * 1e6)
        log.write("ATT", at, 0, 0, np.degrees(yaw[row]) % 360)
        if row % 10 == 0:
            latitude, longitude, height = pymap3d.ned2geodetic(*place[row], *ORIGIN)
            has_fix = row > 50
            log.write(
                "GPS", at, 0, 3 if has_fix else 1, *(round(1e7 * has_fix * angle) for angle in (latitude, longitude)),
                round(100 * height),
            )  # fmt: skip
    log.close()
    spec = mujoco.MjSpec.from_string(WATCHED.format(""))
    proposal = trials.propose(tmp_path / "a.bin", spec)
    text = proposal.toml.replace('body = "FLU" ', f'origin = {list(ORIGIN)}\nbody = "FLU" ')
    (tmp_path / "map.toml").write_text(text)
    assert tomllib.loads(text)["sensors"]["position"] == {
        "topic": "GPS[0]", "fields": ["Lat", "Lng", "Alt"], "frame": "WGS84",
    }  # fmt: skip
    converted = trials.from_ardupilot(tmp_path / "a.bin", model=spec, mapping=tmp_path / "map.toml")
    assert any("6 samples without a fix" in note for note in converted.report.notes), converted.report.notes
    for trial in converted:
        place, _, _ = circling(trial.start + trial.sensor_times - spec.option.timestep)
        known = np.isfinite(trial.sensor("position")).all(1)
        wanted = np.column_stack([place[:, 1], place[:, 0], -place[:, 2]])
        # Centimetres of Alt, 1e-7 degrees of 11 mm.
        np.testing.assert_allclose(trial.sensor("position")[known], wanted[known], atol=0.012)


def test_what_is_not_found_is_a_comment(folder):
    spec = mujoco.MjSpec.from_string(nominal().to_xml())
    spec.add_actuator(name="lamp")
    spec.actuator("lamp").target = "t1"
    spec.actuator("lamp").trntype = mujoco.mjtTrn.mjTRN_SITE
    proposal = trials.propose(folder / "bag", spec)
    assert "lamp" in proposal.open and "# [actuators.lamp]  # nothing found" in proposal.toml


def test_known_messages_use_known_units_and_frames():
    from hydro_mujoco.trials import frames

    for kind, groups in messages._KNOWN.items():
        for group in groups:
            assert set([group.unit] if isinstance(group.unit, str) else group.unit or ()) <= set(UNITS), kind
            if group.frame and group.frame != frames.GEODETIC:
                frames.check(group.frame, group.frame_kind, kind)


def test_likeness_of_names():
    assert similarity("imu_gyro", "/imu/data") > similarity("imu_gyro", "/camera/data")
    assert similarity("left", "thrusters.left") == 1


def test_channels_of_a_pilot_s_remote_control(tmp_path):
    """forward is ArduSub's channel 5; thrusters are no channels of it; a gyro is the instrument's, not the filter's."""
    store = get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg("std_msgs/Header header\nuint16[18] channels", "mavros_msgs/msg/OverrideRCIn"))
    stamp, head = store.types["builtin_interfaces/msg/Time"], store.types["std_msgs/msg/Header"]
    vector, turn = store.types["geometry_msgs/msg/Vector3"], store.types["geometry_msgs/msg/Quaternion"]
    imu, twist = store.types["sensor_msgs/msg/Imu"], store.types["geometry_msgs/msg/TwistStamped"]
    override, moving = store.types["mavros_msgs/msg/OverrideRCIn"], store.types["geometry_msgs/msg/Twist"]
    none = np.zeros(9)
    with Writer(tmp_path / "bag", version=9) as bag:
        topics = {"/odometry/filtered": twist, "/imu/data": imu, "/mavros/rc/override": override}
        connections = {topic: bag.add_connection(topic, kind.__msgtype__, typestore=store) for topic, kind in topics.items()}  # fmt: skip

        def write(topic, at, *parts):
            kind = topics[topic]
            bag.write(connections[topic], at, store.serialize_cdr(kind(*parts), kind.__msgtype__))

        for n in range(300):
            at = n * 10_000_000
            header, rates = head(stamp(at // 10**9, at % 10**9), ""), vector(0.1, 0.0, 0.01 * n)
            write("/imu/data", at, header, turn(0.0, 0.0, 0.0, 1.0), none, rates, none, vector(0.0, 0.0, 9.8), none)
            if n % 5 == 0:
                write("/odometry/filtered", at, header, moving(vector(0.0, 0.0, 0.0), rates))
                write("/mavros/rc/override", at, header, np.arange(1500, 1518, dtype=np.uint16) + n % 7)
    names = ("forward", "lateral", "throttle", "yaw", "t1")
    actuators = "".join(f'<motor name="{name}" site="s"/>' for name in names)
    model = WATCHED.format('<gyro name="gyro" site="s"/>').replace(
        "<sensor>", f"<actuator>{actuators}</actuator><sensor>"
    )
    proposal = trials.propose(tmp_path / "bag", mujoco.MjSpec.from_string(model))
    found = tomllib.loads(proposal.toml)
    assert found["sensors"]["gyro"]["topic"] == "/imu/data"
    assert {name: source["fields"] for name, source in found["actuators"].items()} == {
        "forward": ["channels[4]"], "lateral": ["channels[5]"], "throttle": ["channels[2]"], "yaw": ["channels[3]"],
    }  # fmt: skip
    assert all(source["unit"] == "us" for source in found["actuators"].values()) and "t1" in proposal.open
