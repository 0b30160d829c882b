"""Readers of logs: what they find in logs that the tests write, in ones that are cut, and in what is none."""

import functools
import json
import os
import re
import shutil
import struct
import tempfile
import tracemalloc
from pathlib import Path

import numpy as np
import pandas
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.typesys import Stores, get_typestore

import dive
import writers
from hydro_mujoco.errors import DataError
from hydro_mujoco.extras import extra
from hydro_mujoco.trials.log import FrameLog, open_log
from hydro_mujoco.trials.log.base import nanoseconds
from hydro_mujoco.trials.log.fields import getter, kinds
from ulog import Ulog

SECONDS = 4.0
WANTED = {"/imu/data": ["angular_velocity.x", "orientation.w", "header.stamp"], "/thrusters": ["data[3]"]}


@functools.cache
def run():
    made = dive.swim(SECONDS, 5)
    return made, dive.noisy(made, 6)


@pytest.fixture(scope="module")
def folder():
    with tempfile.TemporaryDirectory() as name:
        made, readings = run()
        parts = made.times, made.commands, readings
        out = Path(name)
        writers.mcap(out / "a.mcap", *parts, dive.EPOCH)
        writers.mcap(out / "small_chunks.mcap", *parts, dive.EPOCH, chunk_size=20_000)
        writers.rosbag(out / "sqlite", *parts, dive.EPOCH)
        writers.rosbag(out / "in_mcap", *parts, dive.EPOCH, storage=StoragePlugin.MCAP)
        writers.dataflash(out / "a.bin", *parts)
        yield out


def check_ros(log):
    made, readings = run()
    found = log.read(WANTED)
    imu = found["/imu/data"]
    np.testing.assert_array_equal(imu.values[:, 0], readings["imu_gyro"][::2, 0])
    np.testing.assert_array_equal(imu.values[:, 1], readings["attitude"][::2, 0])
    np.testing.assert_array_equal(found["/thrusters"].values[:, 0], made.commands[::4, 3])
    stamps = imu.values[:, 2]
    np.testing.assert_allclose(stamps - stamps[0], made.times[::2], atol=2e-9)
    late = imu.times - stamps
    assert late.min() >= 0 and late.max() < writers.LATEST * 1e-9
    assert "/nothing" not in log.read({"/nothing": ["x"]})


@pytest.mark.parametrize(
    "name", ["a.mcap", "small_chunks.mcap", "sqlite", "in_mcap", "sqlite/sqlite.db3", "in_mcap/in_mcap.mcap"]
)
def test_ros_messages_are_read_as_they_were_written(folder, name):
    log = open_log(folder / name)
    topics = log.topics()
    assert topics["/imu/data"].type == "sensor_msgs/msg/Imu" and topics["/imu/data"].count == 400
    assert topics["/imu/data"].fields["header.stamp"] == "time"
    assert {"/dvl", "/imu/data", "/odometry", "/pressure", "/thrusters"} == set(topics)
    check_ros(log)


def test_a_bag_is_its_own_mcap_too(folder):
    check_ros(open_log(folder / "in_mcap/in_mcap.mcap", "mcap"))


def test_a_ros_1_bag_is_read(tmp_path):
    store = get_typestore(Stores.ROS1_NOETIC)
    float64 = store.types["std_msgs/msg/Float64"]
    with Writer1(tmp_path / "a.bag") as bag:
        connection = bag.add_connection("/depth", float64.__msgtype__, typestore=store)
        for n in range(5):
            bag.write(connection, 10**9 * n, store.serialize_ros1(float64(n * 0.5), float64.__msgtype__))
    log = open_log(tmp_path / "a.bag")
    assert log.topics()["/depth"].count == 5
    samples = log.read({"/depth": ["data"]})["/depth"]
    np.testing.assert_array_equal(samples.values[:, 0], np.arange(5) * 0.5)
    np.testing.assert_array_equal(samples.times, np.arange(5.0))


def test_dataflash_is_read_by_instance(folder):
    made, readings = run()
    log = open_log(folder / "a.bin")
    topics = log.topics()
    assert topics["IMU[0]"].count == 400 and topics["RCOU"].count == 200 and "FMT" not in topics
    assert topics["IMU[0]"].rate == pytest.approx(100)
    for name in ("IMU", "IMU[0]"):
        samples = log.read({name: ["GyrY"]})[name]
        np.testing.assert_allclose(samples.values[:, 0], -readings["imu_gyro"][::2, 1], rtol=1e-6)
        np.testing.assert_allclose(samples.times, made.times[::2] + 17.25, atol=1e-6)
    assert not log.read({"IMU[1]": ["GyrY"]}) and not log.read({"NONE": ["x"]}) and not log.faults


def test_instances_of_dataflash_are_counted_apart(tmp_path):
    log = writers.DataFlash(tmp_path / "two.bin")
    log.format("BARO", "QBf", "TimeUS,I,Press", "s#P")
    for n in range(30):
        log.write("BARO", n * 1000, n % 3 == 0, float(n))
    log.close()
    found = open_log(tmp_path / "two.bin")
    assert {name: topic.count for name, topic in found.topics().items()} == {"BARO[0]": 20, "BARO[1]": 10}
    samples = found.read({"BARO[1]": ["Press"], "BARO": ["Press"]})
    np.testing.assert_array_equal(samples["BARO[1]"].values[:, 0], np.arange(0, 30, 3))
    np.testing.assert_array_equal(samples["BARO"].values[:, 0], np.delete(np.arange(30), np.arange(0, 30, 3)))


def test_dataflash_is_read_as_pymavlink_reads_it(folder, tmp_path):
    from pymavlink.DFReader import DFReader_binary

    log = writers.DataFlash(tmp_path / "all.bin")
    log.FORMATS |= {"c": "h", "C": "H", "e": "i", "E": "I", "L": "i", "q": "q"}
    log.format("ALL", "QcCeELhHiIfdbBNZ", "TimeUS,c,C,e,E,L,h,H,i,I,f,d,b,B,N,Z")
    for n in range(50):
        log.write("ALL", n, -n, n, -n * 7, n * 7, 473_977_418 + n, -n, n, -n, n, n / 3, n / 3, -n, n, b"AUTO", b"text")
    log.close()
    for path, kind in ((tmp_path / "all.bin", "ALL"), (folder / "a.bin", "IMU"), (folder / "a.bin", "RCOU")):
        reader = DFReader_binary(str(path))
        messages = []
        while (message := reader.recv_match(type=[kind])) is not None:
            messages.append(message.to_dict())
        fields = [field for field in messages[0] if field not in ("mavpackettype", "N", "Z")]
        samples = open_log(path).read({kind: fields})[kind]
        np.testing.assert_array_equal(samples.values, [[message[field] for field in fields] for message in messages])


def test_bytes_that_are_no_message_are_stepped_over_and_counted(folder, tmp_path):
    whole = (folder / "a.bin").read_bytes()
    middle = len(whole) // 2
    (tmp_path / "a.bin").write_bytes(whole[:middle] + bytes(100) + b"\xa3\x95\x01" + whole[middle:])
    log = open_log(tmp_path / "a.bin")
    samples = log.read({"IMU": ["GyrX"]})["IMU"]
    assert 398 <= len(samples.times) <= 400 and re.search(
        r"1\d\d bytes are no message and were left out", log.faults[0]
    )


def test_words_of_a_mode_are_numbers(tmp_path):
    store = get_typestore(Stores.ROS2_JAZZY)
    text = store.types["std_msgs/msg/String"]
    with open(tmp_path / "m.mcap", "wb") as file:
        import mcap_ros2.writer

        writer = mcap_ros2.writer.Writer(file)
        schema = writer.register_msgdef("std_msgs/msg/String", "string data")
        for n, word in enumerate(["MANUAL", "AUTO", "MANUAL"]):
            writer.write_message("/mode", schema, {"data": word}, log_time=n)
        writer.finish()
    assert text
    log = open_log(tmp_path / "m.mcap")
    np.testing.assert_array_equal(log.read({"/mode": ["data"]})["/mode"].values[:, 0], [0, 1, 0])
    assert log.words == {"MANUAL": 0.0, "AUTO": 1.0} and log.topics()["/mode"].fields == {"data": "text"}


def json_mcap(path, messages, encoding="json"):
    with open(path, "wb") as file:
        writer = McapWriter(file)
        writer.start()
        schema = writer.register_schema("depth", "jsonschema", b"{}")
        channel = writer.register_channel("/depth", encoding, schema)
        for n, message in enumerate(messages):
            writer.add_message(channel, log_time=n * 10**9, data=json.dumps(message).encode(), publish_time=n)
        writer.finish()


def test_json_in_mcap_is_read(tmp_path):
    json_mcap(
        tmp_path / "j.mcap", [{"water": {"depth": [n, 2 * n]}, "t": {"sec": n, "nsec": 5 * 10**8}} for n in range(4)]
    )
    samples = open_log(tmp_path / "j.mcap").read({"/depth": ["water.depth[1]", "t"]})["/depth"]
    np.testing.assert_array_equal(samples.values, [[0, 0.5], [2, 1.5], [4, 2.5], [6, 3.5]])


def test_protobuf_in_mcap_is_read(tmp_path):
    pytest.importorskip("mcap_protobuf")
    from google.protobuf.timestamp_pb2 import Timestamp
    from mcap_protobuf.writer import Writer

    with open(tmp_path / "p.mcap", "wb") as file, Writer(file) as writer:
        for n in range(3):
            writer.write_message("/clock", Timestamp(seconds=n, nanos=7), log_time=n * 10**9)
    samples = open_log(tmp_path / "p.mcap").read({"/clock": ["seconds", "nanos"]})["/clock"]
    np.testing.assert_array_equal(samples.values, [[0, 7], [1, 7], [2, 7]])


def test_messages_that_cannot_be_decoded_are_named(tmp_path):
    json_mcap(tmp_path / "x.mcap", [{"depth": 1}], encoding="cbor")
    log = open_log(tmp_path / "x.mcap")
    with pytest.raises(DataError, match="none of its 1 messages can be decoded"):
        log.read({"/depth": ["depth"]})
    assert "cbor" in log.faults[0]


def px4(path, n=200):
    log = Ulog(
        path,
        {
            "vehicle_attitude": [("uint64_t", "timestamp"), ("float[4]", "q")],
            "sensor_baro": [("uint64_t", "timestamp"), ("float", "pressure")],
        },
    )
    log.subscribe("vehicle_attitude")
    log.subscribe("sensor_baro")
    log.subscribe("sensor_baro", 1)
    for k in range(n):
        log.write("vehicle_attitude", 10_000 * k, 1.0, 0.0, 0.0, k / n)
        if k % 2 == 0:
            log.write("sensor_baro", 10_000 * k, 1e5 + k)
            log.write("sensor_baro", 10_000 * k, 2e5 + k, instance=1)
    log.close()


def test_ulog_is_read_and_listed_without_its_data(tmp_path):
    px4(tmp_path / "a.ulg")
    log = open_log(tmp_path / "a.ulg")
    topics = log.topics()
    assert {name: topic.count for name, topic in topics.items()} == {
        "sensor_baro": 100,
        "sensor_baro[1]": 100,
        "vehicle_attitude": 200,
    }
    assert topics["vehicle_attitude"].rate == pytest.approx(100) and "q[3]" in topics["vehicle_attitude"].fields
    found = log.read({"vehicle_attitude": ["q[3]"], "sensor_baro[1]": ["pressure"]})
    np.testing.assert_allclose(found["vehicle_attitude"].values[:, 0], np.arange(200) / 200, atol=1e-7)
    np.testing.assert_array_equal(found["sensor_baro[1]"].values[:, 0], 2e5 + np.arange(0, 200, 2))
    np.testing.assert_allclose(found["sensor_baro[1]"].times, np.arange(0, 2, 0.02))
    assert not log.faults


def test_ulog_is_read_as_pyulog_reads_it(tmp_path, monkeypatch):
    """Every field of every instance, in pieces that are smaller than the log."""
    from pyulog import ULog

    import hydro_mujoco.trials.log.ulog as reader

    monkeypatch.setattr(reader, "PIECE", 700)
    fields = [
        ("uint64_t", "timestamp"),
        ("uint8_t", "mode"),
        ("float[3]", "v"),
        ("double", "lat"),
        ("uint8_t[5]", "raw"),
    ]
    log = Ulog(tmp_path / "a.ulg", {"one": fields, "two": fields[:3]})
    for name, instance in (("one", 0), ("one", 1), ("two", 0)):
        log.subscribe(name, instance)
    random = np.random.default_rng(1)
    for k in range(300):
        values = k * 1000, k % 256, *random.normal(size=3), random.normal()
        log.write("one", *values, *random.integers(0, 256, 5), instance=k % 3 % 2)
        log.write("two", *values[:5])
    log.close()
    expected = ULog(str(tmp_path / "a.ulg")).data_list
    assert len(expected) == 3
    for topic in expected:
        name = f"{topic.name}[{topic.multi_id}]" if topic.multi_id else topic.name
        paths = [path for path in topic.data if path != "timestamp"]
        samples = open_log(tmp_path / "a.ulg").read({name: paths})[name]
        np.testing.assert_array_equal(samples.values, np.column_stack([topic.data[path] for path in paths]))
        np.testing.assert_array_equal(samples.times, topic.data["timestamp"] * 1e-6)
    with pytest.raises(DataError, match="topic `two`: no field `lat`; its fields are `timestamp`, `mode`"):
        open_log(tmp_path / "a.ulg").read({"two": ["lat"]})


def test_telemetry_is_read(tmp_path):
    from pymavlink.dialects.v20 import ardupilotmega as mavlink

    link = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    other = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
    with open(tmp_path / "a.tlog", "wb") as file:
        for n in range(10):
            stamp = struct.pack(">Q", 1_700_000_000_000_000 + n * 100_000)
            file.write(stamp + link.attitude_encode(n * 100, 0.1 * n, 0, 0, 0, 0, 0.5).pack(link))
            file.write(stamp + other.attitude_encode(n * 100, 9.0, 0, 0, 0, 0, 0.5).pack(other))
    log = open_log(tmp_path / "a.tlog")
    assert {name: topic.count for name, topic in log.topics().items()} == {"ATTITUDE": 10, "ATTITUDE@255:190": 10}
    samples = log.read({"ATTITUDE": ["roll", "yawspeed"]})["ATTITUDE"]
    np.testing.assert_allclose(samples.values[:, 0], 0.1 * np.arange(10), atol=1e-6)
    np.testing.assert_allclose(samples.times, 0.1 * np.arange(10), atol=1e-6)


FRAME = pandas.DataFrame({"t": [0.0, 0.1, 0.2], "a": [1, 2, 3], "b": [0.5, np.nan, 1.5], "mode": ["x", "y", "x"]})


@pytest.mark.parametrize("kind", ["csv", "parquet", "frame"])
def test_tables_are_read(tmp_path, kind):
    path = tmp_path / f"a.{kind}"
    if kind == "csv":
        FRAME.to_csv(path, index=False)
    elif kind == "parquet":
        FRAME.to_parquet(path)
    log = FrameLog(FRAME) if kind == "frame" else open_log(path)
    assert log.topics()["table"].fields == {"t": "number", "a": "number", "b": "number", "mode": "text"}
    samples = log.read({"table": ["b", "t", "mode"]})["table"]
    np.testing.assert_array_equal(samples.values, [[0.5, 0, 0], [np.nan, 0.1, 1], [1.5, 0.2, 0]])


def test_dates_in_a_csv_are_times(tmp_path):
    (tmp_path / "a.csv").write_text("when,a\n2024-05-01T10:00:00.25Z,1\n2024-05-01T10:00:01Z,2\n")
    samples = open_log(tmp_path / "a.csv").read({"table": ["when", "a"]})["table"]
    np.testing.assert_allclose(samples.values, [[0, 1], [0.75, 2]])


def test_an_index_of_dates_is_a_time():
    frame = pandas.DataFrame(
        {"a": [1.0, 2.0]}, index=pandas.to_datetime(["2024-05-01 10:00:00.25", "2024-05-01 10:00:01.00"])
    )
    for zone in (None, "UTC"):
        samples = FrameLog(frame.tz_localize(zone) if zone else frame).read({"table": ["time", "a"]})["table"]
        np.testing.assert_allclose(samples.values, [[0, 1], [0.75, 2]])


CUTS = {"a.mcap": "cut off", "small_chunks.mcap": "cut off", "a.bin": "ends within a message"}


@pytest.mark.parametrize("name", CUTS)
def test_what_is_before_a_cut_is_read_and_said(folder, tmp_path, name):
    whole = (folder / name).read_bytes()
    (tmp_path / name).write_bytes(whole[: len(whole) * 3 // 4 + 7])
    log = open_log(tmp_path / name)
    topic, field = ("IMU", "GyrX") if name.endswith("bin") else ("/imu/data", "angular_velocity.x")
    if name == "a.mcap":
        # Its one chunk is damaged.
        with pytest.raises(DataError, match="no MCAP file that can be read"):
            log.read({topic: [field]})
        return
    samples = log.read({topic: [field]})[topic]
    assert 150 < len(samples.times) < 390
    np.testing.assert_allclose(samples.values[:, 0], run()[1]["imu_gyro"][::2, 0][: len(samples.times)], rtol=1e-6)
    assert CUTS[name] in log.faults[0] and str(len(whole) * 3 // 4 + 7) in log.faults[0]


def test_a_cut_ulog_is_said(tmp_path):
    px4(tmp_path / "a.ulg")
    whole = (tmp_path / "a.ulg").read_bytes()
    (tmp_path / "b.ulg").write_bytes(whole[: len(whole) // 2])
    log = open_log(tmp_path / "b.ulg")
    samples = log.read({"vehicle_attitude": ["q[3]"]})["vehicle_attitude"]
    assert 80 < len(samples.times) < 120 and "cut off" in log.faults[0]


@pytest.mark.parametrize("name", ["a.mcap", "a.ulg", "a.bin", "a.tlog", "a.csv", "a.parquet", "a.db3", "a.bag"])
@pytest.mark.parametrize("content", ["empty", "noise", "missing", "folder"])
def test_what_is_no_log_is_refused_in_a_sentence(tmp_path, name, content):
    path = tmp_path / name
    if content == "empty":
        path.write_bytes(b"")
    elif content == "noise":
        path.write_bytes(np.random.default_rng(1).integers(0, 256, 3000).astype(np.uint8).tobytes())
    elif content == "folder":
        path.mkdir()
    with pytest.raises(DataError) as refusal:
        open_log(path, None if content != "folder" else open_log.__globals__["_ENDINGS"][path.suffix]).topics()
    said = str(refusal.value)
    assert str(path) in said and said.count("\n") < 3
    expected = {"empty": "empty", "noise": "can be read", "missing": "no such file", "folder": "folder"}[content]
    assert expected in said


def test_folders_and_names_that_say_nothing(tmp_path):
    (tmp_path / "a.xyz").write_text("x")
    with pytest.raises(DataError, match="cannot be told from its name"):
        open_log(tmp_path / "a.xyz")
    with pytest.raises(DataError, match="no such file"):
        open_log(tmp_path / "b.xyz")
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "x.db3").write_text("")
    with pytest.raises(DataError, match=r"no metadata.yaml .*x.db3.*reindex"):
        open_log(tmp_path / "bag")


def test_a_damaged_bag_is_refused(folder, tmp_path):
    shutil.copytree(folder / "sqlite", tmp_path / "bag")
    database = tmp_path / "bag" / "sqlite.db3"
    database.write_bytes(database.read_bytes()[:5000])
    with pytest.raises(DataError, match="no ROS bag that can be read"):
        open_log(tmp_path / "bag").read(WANTED)
    shutil.copytree(folder / "in_mcap", tmp_path / "cut")
    file = tmp_path / "cut" / "in_mcap.mcap"
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    with pytest.raises(DataError, match=r"no ROS bag that can be read.*cut/in_mcap.mcap is read up to the cut"):
        open_log(tmp_path / "cut").read(WANTED)
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(DataError, match="pipe.csv: is a pipe; expected a file"):
        open_log(tmp_path / "pipe.csv")


def test_a_field_that_is_not_there_lists_those_that_are(folder):
    for name in ("a.mcap", "sqlite"):
        with pytest.raises(DataError, match="no field `angular_velocity.q`; its fields are .*`angular_velocity.x`"):
            open_log(folder / name).read({"/imu/data": ["angular_velocity.q"]})
    with pytest.raises(DataError, match="no field `Gyr`; its fields are .*`GyrX`"):
        open_log(folder / "a.bin").read({"IMU": ["Gyr"]})
    with pytest.raises(DataError, match="`angular_velocity` is no number"):
        open_log(folder / "a.mcap").read({"/imu/data": ["angular_velocity"]})
    with pytest.raises(DataError, match="no field `c`; its fields are `t`, `a`"):
        FrameLog(FRAME).read({"table": ["c"]})


def test_a_cell_that_is_no_number_is_named(tmp_path):
    (tmp_path / "a.csv").write_text("t,a\n0,1\n0.1,2\n0.2,two\n")
    with pytest.raises(DataError, match="row 3 of data, column `a`: `two` is no number"):
        open_log(tmp_path / "a.csv").read({"table": ["a"]})


def test_frames_of_other_types_are_refused():
    with pytest.raises(DataError, match="list given; expected a DataFrame"):
        FrameLog([1, 2])
    with pytest.raises(DataError, match="no row"):
        FrameLog(FRAME.iloc[:0])


def test_a_missing_package_is_named_with_its_extra():
    with pytest.raises(DataError, match=r"pip install 'hydro-mujoco\[ulog\]'"):
        extra("no_such_package", "ulog", "ULog file")


@given(
    st.recursive(
        st.floats(-1e9, 1e9) | st.integers(-5, 5),
        lambda inner: (
            st.lists(inner, min_size=1, max_size=4)
            | st.dictionaries(st.from_regex(r"[a-z][a-z_0-9]{0,4}", fullmatch=True), inner, min_size=1, max_size=4)
        ),
        max_leaves=12,
    ).filter(lambda value: isinstance(value, dict) and not any(nanoseconds(part) for part in [value]))
)
@settings(max_examples=60, deadline=None)
def test_every_listed_field_can_be_read(message):
    for path, kind in kinds(message).items():
        assert kind == "number" and isinstance(getter(path)(message), int | float)


@given(st.text(max_size=20))
@settings(max_examples=60, deadline=None)
def test_any_path_is_read_or_refused(path):
    try:
        get = getter(path)
    except DataError:
        return
    try:
        get({"a": 1.0})
    except (AttributeError, KeyError, IndexError, TypeError, ValueError):
        return


def test_an_element_by_its_name():
    message = {"name": ["hip", "knee"], "position": [0.1, 0.2]}
    assert getter("position[knee]")(message) == 0.2
    with pytest.raises(ValueError):
        getter("position[toe]")(message)


def test_reading_keeps_no_more_than_the_numbers(tmp_path):
    """Camera images of 12 MB in all beside a sensor of 300 numbers."""
    with open(tmp_path / "big.mcap", "wb") as file:
        writer = McapWriter(file, chunk_size=500_000)
        writer.start()
        image = writer.register_channel("/image", "json", 0)
        depth = writer.register_channel("/depth", "json", 0)
        for n in range(300):
            writer.add_message(image, log_time=n, data=np.random.default_rng(n).bytes(40_000), publish_time=n)
            writer.add_message(depth, log_time=n, data=json.dumps({"z": n}).encode(), publish_time=n)
        writer.finish()
    assert (tmp_path / "big.mcap").stat().st_size > 11e6
    log = open_log(tmp_path / "big.mcap")
    tracemalloc.start()
    assert log.topics()["/image"].count == 300
    samples = log.read({"/depth": ["z"]})["/depth"]
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    np.testing.assert_array_equal(samples.values[:, 0], np.arange(300))
    assert most < 4e6
