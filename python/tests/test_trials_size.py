"""Memory of a conversion: bounded, however large the log and however much of it is mapped.

Numbers of the log are on disk, so what counts is the memory that no file stands behind. A process that has converted a
short log may take SLACK more of it for a long one, or fails.
"""

import json
import os
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

CHILD = r"""
import json, re, resource, sys
from hydro_mujoco.trials.convert import convert
from hydro_mujoco.trials.log import open_log
short, long, kind, model, mapping, slack, out = sys.argv[1:]
convert(open_log(short, kind), model, json.loads(mapping))
now = 1024 * int(re.search(r"VmData:\s*(\d+) kB", open("/proc/self/status").read())[1])
limit = now + int(slack)
resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))
found = convert(open_log(long, kind), model, json.loads(mapping), out)
print(sum(trial.readings.size + trial.controls.size for trial in found))
"""
#: Bytes of a number; what a long log may take more than a short one, and where Arrow reads it.
NUMBER, SLACK, ARROW = 8, 28e6, 60e6
#: Every large block is mapped for itself and returned when freed, and counts as it is: no arena of 64 MiB for each thread
#: that happens to allocate, no heap with holes because a freed block was large, no pool of Arrow's own.
ALLOCATOR = {
    "MALLOC_ARENA_MAX": "1",
    "MALLOC_MMAP_THRESHOLD_": "131072",
    "ARROW_DEFAULT_MEMORY_POOL": "system",
}
#: Components of the model's sensors, three each, all of them mapped.
WIDTH = 240
AXES = [f"v{k}" for k in range(WIDTH)]
BULK = np.random.default_rng(1).bytes(50_000)


def model(width):
    sensors = "".join(f'<gyro name="g{k}" site="s"/>' for k in range(width // 3))
    return (
        '<mujoco><option timestep="0.01"/><worldbody><body name="hull"><freejoint/><geom size="0.1" mass="1"/>'
        f'<site name="s"/></body></worldbody><sensor>{sensors}</sensor></mujoco>'
    )


def mapped(paths, **topic):
    groups = [paths[k : k + 3] for k in range(0, len(paths), 3)]
    sensors = {f"g{k}": {"fields": group, "filter": False, **topic} for k, group in enumerate(groups)}
    return {"schema": "hydro-mapping/1", "trials": {"length": 20}, "sensors": sensors}


def values(k):
    """Row k of WIDTH numbers."""
    return np.sin(1e-3 * k * (1 + np.arange(WIDTH) / WIDTH)).round(4)


def dataflash(path, n, _):
    """Of a type 15 numbers at most, so 16 types."""
    log = writers.DataFlash(path)
    names = [f"M{k:02}" for k in range(WIDTH // 15)]
    for name in names:
        log.format(name, "Q" + 15 * "f", "TimeUS," + ",".join(f"v{k}" for k in range(15)), "s" + 15 * "E")
    for k in range(n):
        row = values(k).reshape(-1, 15).tolist()
        for name, part in zip(names, row):
            log.write(name, 2000 * k, *part)
    log.close()


def dataflash_mapping():
    sensors = {
        f"g{k}": {
            "topic": f"M{3 * k // 15:02}",
            "fields": [f"v{(3 * k + axis) % 15}" for axis in range(3)],
            "filter": False,
        }
        for k in range(WIDTH // 3)
    }
    return {"schema": "hydro-mapping/1", "trials": {"length": 20}, "sensors": sensors}


def ulog(path, n, _):
    log = Ulog(path, {"imu": [("uint64_t", "timestamp"), (f"float[{WIDTH}]", "v")]})
    log.subscribe("imu")
    for k in range(n):
        log.write("imu", 2000 * k, *values(k).tolist())
    log.close()


def rosbag(path, n, bulk, ros=2):
    store = get_typestore(Stores.ROS2_JAZZY if ros == 2 else Stores.ROS1_NOETIC)
    name, image = "std_msgs/msg/Float64MultiArray", "std_msgs/msg/UInt8MultiArray"
    layout = store.types["std_msgs/msg/MultiArrayLayout"]([], 0)
    serialize = store.serialize_cdr if ros == 2 else store.serialize_ros1
    with Writer2(path, version=9) if ros == 2 else Writer1(path) as bag:
        rates = bag.add_connection("/imu", name, typestore=store)
        raw = bag.add_connection("/raw", image, typestore=store)
        picture = serialize(store.types[image](layout, np.frombuffer(BULK, np.uint8)), image)
        for k in range(n):
            at = 2_000_000 * k + 1
            bag.write(rates, at, serialize(store.types[name](layout, values(k)), name))
            if k * bulk // n > (k - 1) * bulk // n:
                bag.write(raw, at, picture)


def ros1bag(path, n, bulk):
    rosbag(path, n, bulk, ros=1)


def mcap(path, n, bulk):
    random = np.random.default_rng(2)
    with open(path, "wb") as file:
        writer = McapWriter(file, chunk_size=500_000)
        writer.start()
        raw, rates = writer.register_channel("/raw", "json", 0), writer.register_channel("/imu", "json", 0)
        for k in range(n):
            at = 2_000_000 * k
            data = json.dumps({"data": values(k).tolist()}).encode()
            writer.add_message(rates, log_time=at, data=data, publish_time=at)
            if k * bulk // n > (k - 1) * bulk // n:
                writer.add_message(raw, log_time=at, data=random.bytes(len(BULK)), publish_time=at)
        writer.finish()


def csv(path, n, _):
    with open(path, "w") as file:
        file.write(",".join(["time", *AXES]) + "\n")
        rows = [",".join(map(str, values(k).tolist())) for k in range(100)]
        file.writelines(f"{0.002 * k:.3f},{rows[k % 100]}\n" for k in range(n))


def parquet(path, n, _):
    table = pandas.DataFrame(np.array([values(k % 1000) for k in range(n)]), columns=AXES)
    table.insert(0, "time", 0.002 * np.arange(n))
    table.to_parquet(path, row_group_size=10_000)


ELEMENTS = [f"data[{k}]" for k in range(WIDTH)]
#: Writer, file, kind, mapping of all its numbers, rows, bytes more than for a short log.
CASES = {
    "mcap": (mcap, "a.mcap", "mcap", mapped(ELEMENTS, topic="/imu"), 15_000, SLACK),
    "ROS 2 bag": (rosbag, "bag", "rosbag", mapped(ELEMENTS, topic="/imu"), 15_000, SLACK),
    "ROS 1 bag": (ros1bag, "a.bag", "rosbag", mapped(ELEMENTS, topic="/imu"), 15_000, SLACK),
    "DataFlash": (dataflash, "a.bin", "dataflash", dataflash_mapping(), 20_000, SLACK),
    "ULog": (ulog, "a.ulg", "ulog", mapped([f"v[{k}]" for k in range(WIDTH)], topic="imu"), 20_000, SLACK),
    "csv": (csv, "a.csv", "csv", mapped(AXES), 20_000, SLACK),
    "parquet": (parquet, "a.parquet", "parquet", mapped(AXES), 40_000, ARROW),
}


def converted(tmp_path, write, name, kind, n, bulk, mapping, slack):
    """Convert a short log, then one of `n` rows with `slack` more bytes; returns the numbers of its trials."""
    for folder, rows in (("short", 1500), ("long", n)):
        tmp_path.joinpath(folder).mkdir()
        write(tmp_path / folder / name, rows, bulk * rows // n)
    (tmp_path / "model.xml").write_text(model(3 * len(mapping["sensors"])))
    words = [tmp_path / "short" / name, tmp_path / "long" / name, kind, tmp_path / "model.xml", json.dumps(mapping)]
    run = subprocess.run(
        [sys.executable, "-c", CHILD, *words, str(int(slack)), tmp_path / "out"],
        capture_output=True,
        text=True,
        env=os.environ | ALLOCATOR,
    )
    assert run.returncode == 0, run.stderr[-2000:]
    return int(run.stdout)


@pytest.mark.parametrize("case", CASES)
def test_a_log_that_is_mapped_whole_takes_no_more_memory_than_a_short_one(tmp_path, case):
    write, name, kind, mapping, n, slack = CASES[case]
    numbers = n * WIDTH
    # As samples and as signals, which were in memory together; rows are a tenth of them.
    assert 2 * NUMBER * numbers > 2 * slack
    assert converted(tmp_path, write, name, kind, n, 600, mapping, slack) > 0.09 * numbers
