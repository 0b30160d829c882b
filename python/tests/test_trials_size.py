"""Memory of a conversion: that of the mapped numbers, however large the log, by the peak of a process of its own."""

import subprocess
import sys

import numpy as np
import pandas
import pytest
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

import writers
from ulog import Ulog

MJCF = """<mujoco><option timestep="0.01"/><worldbody><body name="hull"><freejoint/><geom size="0.1" mass="1"/>
<site name="s"/></body></worldbody><sensor><gyro name="imu_gyro" site="s"/><accelerometer name="imu_acc" site="s"/></sensor></mujoco>"""
#: Converts a short log, then a long one; prints by how many bytes the second raised the peak.
CHILD = r"""
import json, re, sys
from hydro_mujoco.trials.convert import convert
from hydro_mujoco.trials.log import open_log
short, long, kind, model, mapping = sys.argv[1:]
def peak(log):
    convert(open_log(log, kind), model, json.loads(mapping))
    return 1024 * int(re.search(r"VmHWM:\s*(\d+) kB", open("/proc/self/status").read())[1])
before = peak(short)
print(peak(long) - before)
"""
#: Bytes of a number; how many of these a mapped number may take while it is converted; what else may come.
NUMBER, MOST, SLACK = 8, 3.5, 12e6
#: What Arrow's allocator keeps for itself [byte].
ARROW = 32e6
BULK = np.random.default_rng(1).bytes(50_000)


def gyro(n):
    return np.sin(1e-3 * np.arange(n)[:, None] * [1, 1.3, 1.7]).round(4)


def dataflash(path, n, bulk):
    log = writers.DataFlash(path)
    log.format("IMU", "QBfff", "TimeUS,I,GyrX,GyrY,GyrZ", "s#EEE")
    log.format("TEXT", "QZZZ", "TimeUS,A,B,C")
    for k, rates in enumerate(gyro(n).tolist()):
        log.write("IMU", 2000 * k, 0, *rates)
        if k * bulk // n > (k - 1) * bulk // n:
            for _ in range(250):
                log.write("TEXT", 2000 * k, *3 * [BULK[:64]])
    log.close()


def ulog(path, n, bulk):
    log = Ulog(path, {"imu": [("uint64_t", "timestamp"), ("float[3]", "xyz"), ("uint8_t[250]", "raw")]})
    log.subscribe("imu")
    raw = BULK[:250]
    for k, rates in enumerate(gyro(n).tolist()):
        log.write("imu", 2000 * k, *rates, *raw)
    log.close()


def rosbag(path, n, bulk, ros=2):
    store = get_typestore(Stores.ROS2_JAZZY if ros == 2 else Stores.ROS1_NOETIC)
    vector, octets = store.types["geometry_msgs/msg/Vector3"], store.types["std_msgs/msg/UInt8MultiArray"]
    layout = store.types["std_msgs/msg/MultiArrayLayout"]([], 0)
    serialize = store.serialize_cdr if ros == 2 else store.serialize_ros1
    with Writer2(path, version=9) if ros == 2 else Writer1(path) as bag:
        rates = bag.add_connection("/imu", vector.__msgtype__, typestore=store)
        images = bag.add_connection("/raw", octets.__msgtype__, typestore=store)
        image = serialize(octets(layout, np.frombuffer(BULK, np.uint8)), octets.__msgtype__)
        for k, each in enumerate(gyro(n).tolist()):
            bag.write(rates, 2_000_000 * k + 1, serialize(vector(*each), vector.__msgtype__))
            if k * bulk // n > (k - 1) * bulk // n:
                bag.write(images, 2_000_000 * k + 1, image)


def mcap(path, n, bulk):
    random = np.random.default_rng(2)
    with open(path, "wb") as file:
        writer = McapWriter(file, chunk_size=500_000)
        writer.start()
        raw, rates = writer.register_channel("/raw", "json", 0), writer.register_channel("/imu", "json", 0)
        for k, (x, y, z) in enumerate(gyro(n).tolist()):
            at = 2_000_000 * k
            writer.add_message(rates, log_time=at, data=b'{"x": %f, "y": %f, "z": %f}' % (x, y, z), publish_time=at)
            if k * bulk // n > (k - 1) * bulk // n:
                writer.add_message(raw, log_time=at, data=random.bytes(len(BULK)), publish_time=at)
        writer.finish()


def csv(path, n, _):
    rest = [",".join(f"{value:.5f}" for value in row) for row in np.random.default_rng(2).random((100, 30))]
    with open(path, "w") as file:
        file.write(",".join(["time", "x", "y", "z", *(f"raw{k}" for k in range(30))]) + "\n")
        for k, (x, y, z) in enumerate(gyro(n).tolist()):
            file.write(f"{0.002 * k:.3f},{x},{y},{z},{rest[k % 100]}\n")


def parquet(path, n, _):
    table = pandas.DataFrame(gyro(n), columns=["x", "y", "z"])
    table.insert(0, "time", 0.002 * np.arange(n))
    rest = pandas.DataFrame(np.random.default_rng(2).random((n, 60)), columns=[f"raw{k}" for k in range(60)])
    pandas.concat([table, rest], axis=1).to_parquet(path, row_group_size=10_000)


FIELDS = {"fields": ["x", "y", "z"]}
#: Writer, file, kind, rows, whether there is bulk, source of the gyro.
CASES = {
    "mcap": (mcap, "a.mcap", "mcap", 40_000, FIELDS | {"topic": "/imu"}),
    "ROS 2 bag": (rosbag, "bag", "rosbag", 40_000, FIELDS | {"topic": "/imu"}),
    "ROS 1 bag": (lambda *parts: rosbag(*parts, ros=1), "a.bag", "rosbag", 40_000, FIELDS | {"topic": "/imu"}),
    "DataFlash": (dataflash, "a.bin", "dataflash", 150_000, {"topic": "IMU", "fields": ["GyrX", "GyrY", "GyrZ"]}),
    "ULog": (ulog, "a.ulg", "ulog", 150_000, {"topic": "imu", "fields": ["xyz[0]", "xyz[1]", "xyz[2]"]}),
    "csv": (csv, "a.csv", "csv", 150_000, FIELDS),
    "parquet": (parquet, "a.parquet", "parquet", 200_000, FIELDS),
}


def raised(tmp_path, write, name, kind, n, bulk, mapping):
    """By how much a log of `n` rows raises the peak of memory [bytes], and the log's size."""
    import json

    for folder, rows in (("short", 2000), ("long", n)):
        tmp_path.joinpath(folder).mkdir()
        write(tmp_path / folder / name, rows, bulk * rows // n if folder == "short" else bulk)
    (tmp_path / "model.xml").write_text(MJCF)
    words = [tmp_path / "short" / name, tmp_path / "long" / name, kind, tmp_path / "model.xml", json.dumps(mapping)]
    run = subprocess.run([sys.executable, "-c", CHILD, *words], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    long = tmp_path / "long" / name
    return int(run.stdout), sum(path.stat().st_size for path in (long.iterdir() if long.is_dir() else [long]))


def mapped(**sensors):
    return {"schema": "hydro-mapping/1", "trials": {"length": 20}, "sensors": sensors}


@pytest.mark.parametrize("case", CASES)
def test_what_is_not_mapped_takes_no_memory(tmp_path, case):
    write, name, kind, n, source = CASES[case]
    peak, size = raised(tmp_path, write, name, kind, n, 700, mapped(imu_gyro=source))
    bound = MOST * NUMBER * 4 * n + SLACK + (ARROW if case == "parquet" else 0)
    assert size > 1.2 * bound, f"{size / 1e6:.0f} MB of log show nothing beside a bound of {bound / 1e6:.0f} MB"
    assert peak < bound, f"{peak / 1e6:.1f} MB for {n} samples of {size / 1e6:.1f} MB"


def all_dataflash(path, n, _):
    log = writers.DataFlash(path)
    log.format("IMU", "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ", "s#EEEooo")
    for k, rates in enumerate(gyro(n).tolist()):
        log.write("IMU", 2000 * k, 0, *rates, *rates)
    log.close()


def all_ulog(path, n, _):
    log = Ulog(path, {"imu": [("uint64_t", "timestamp"), ("float[6]", "v")]})
    log.subscribe("imu")
    for k, rates in enumerate(gyro(n).tolist()):
        log.write("imu", 2000 * k, *rates, *rates)
    log.close()


@pytest.mark.parametrize(
    ("write", "name", "kind", "topic", "fields"),
    [
        (all_dataflash, "a.bin", "dataflash", "IMU", "GyrX GyrY GyrZ AccX AccY AccZ"),
        (all_ulog, "a.ulg", "ulog", "imu", "v[0] v[1] v[2] v[3] v[4] v[5]"),
    ],
)
def test_where_every_field_is_mapped_a_number_takes_a_few_times_its_size(tmp_path, write, name, kind, topic, fields):
    n, paths = 200_000, fields.split()
    mapping = mapped(
        imu_gyro={"topic": topic, "fields": paths[:3], "filter": False},
        imu_acc={"topic": topic, "fields": paths[3:], "filter": False},
    )
    peak, size = raised(tmp_path, write, name, kind, n, 0, mapping)
    assert peak < MOST * NUMBER * 7 * n + SLACK / 2, f"{peak / 1e6:.1f} MB for {n} samples of {size / 1e6:.1f} MB"
