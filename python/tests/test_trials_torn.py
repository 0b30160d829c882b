"""Logs with bytes that are wrong: each is read, or refused in a sentence, and nothing else is raised or printed."""

import random
import struct
from pathlib import Path

import pandas
import pytest
from rosbags.rosbag2 import StoragePlugin

import dive
import writers
from hydro_mujoco.errors import DataError
from hydro_mujoco.trials.log import open_log
from ulog import Ulog

VARIANTS = 30
NAMES = ("a.mcap", "chunks.mcap", "a.db3", "a.bin", "a.ulg", "a.tlog", "a.csv", "a.parquet")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("logs")
    made = dive.swim(0.3, 5)
    parts = made.times, made.commands, dive.noisy(made, 6)
    writers.mcap(out / "a.mcap", *parts, dive.EPOCH)
    writers.mcap(out / "chunks.mcap", *parts, dive.EPOCH, chunk_size=2000)
    writers.rosbag(out / "bag", *parts, dive.EPOCH, storage=StoragePlugin.SQLITE3)
    (out / "bag" / "bag.db3").rename(out / "a.db3")
    writers.dataflash(out / "a.bin", *parts)
    px4(out / "a.ulg")
    telemetry(out / "a.tlog")
    frame = pandas.DataFrame({"t": [0.0, 0.1, 0.2], "a": [1, 2, 3], "mode": ["x", "y", "x"]})
    frame.to_csv(out / "a.csv", index=False)
    frame.to_parquet(out / "a.parquet")
    return out


def px4(path):
    log = Ulog(path, {"sensor_baro": [("uint64_t", "timestamp"), ("float", "pressure")]})
    log.subscribe("sensor_baro")
    for k in range(10):
        log.write("sensor_baro", 10_000 * k, 1e5 + k)
    log.close()


def telemetry(path):
    from pymavlink.dialects.v20 import ardupilotmega as mavlink

    link = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    with open(path, "wb") as file:
        for n in range(10):
            stamp = struct.pack(">Q", 1_700_000_000_000_000 + n * 100_000)
            file.write(stamp + link.attitude_encode(n * 100, 0.1 * n, 0, 0, 0, 0, 0.5).pack(link))


def torn(chance: random.Random, whole: bytes) -> bytes:
    """Bits flipped, eight bytes replaced, or a piece left out."""
    content = bytearray(whole)
    at = chance.randrange(len(content))
    change = chance.randrange(3)
    if change == 0:
        for _ in range(chance.choice((1, 1, 5, 50))):
            content[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
    elif change == 1:
        content[at : at + 8] = chance.choice((b"\xff" * 8, b"\0" * 8, chance.randbytes(8)))
    else:
        del content[at : at + chance.choice((1, 4, 100))]
    return bytes(content)


def refusal(path: Path) -> str:
    """What is said of a log all of whose fields are read; empty where it is read."""
    try:
        topics = open_log(path).topics()
        open_log(path).read({name: list(topic.fields)[:12] for name, topic in topics.items()})
    except DataError as error:
        said = str(error)
        assert said.strip() and said.count("\n") < 3 and len(said) < 2000, said
        return said
    return ""


@pytest.mark.parametrize("name", NAMES)
def test_a_torn_log_is_read_or_refused(folder, tmp_path, name, capfd):
    whole = (folder / name).read_bytes()
    path = tmp_path / name
    path.write_bytes(whole)
    assert refusal(path) == ""
    for number in range(VARIANTS):
        path.write_bytes(torn(random.Random(f"{name}/{number}"), whole))
        refusal(path)
    assert capfd.readouterr().out == ""


def test_a_schema_that_cannot_be_parsed_is_said(folder, tmp_path, capfd):
    path = tmp_path / "a.mcap"
    whole = (folder / "chunks.mcap").read_bytes()
    path.write_bytes(whole.replace(b"float64 x", b"float64>x"))
    log = open_log(path)
    topics = log.topics()
    assert topics["/imu/data"].fields == {}
    assert any("its schema" in fault and "cannot be read" in fault for fault in log.faults)
    with pytest.raises(DataError, match="can be decoded"):
        open_log(path).read({"/imu/data": ["angular_velocity.x"]})
    assert capfd.readouterr().out == ""


def test_what_pandas_noted_in_a_parquet_is_not_needed(folder, tmp_path):
    path = tmp_path / "a.parquet"
    whole = (folder / "a.parquet").read_bytes()
    assert b"pandas_type" in whole
    path.write_bytes(whole.replace(b"pandas_type", b"pandas_typo"))
    assert open_log(path).read({"table": ["a"]})["table"].values[:, 0].tolist() == [1, 2, 3]


def test_a_long_cell_is_cut(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("t,a\n0,1\n1," + "y" * 100_000 + "\n")
    with pytest.raises(DataError, match=r"`y{80}\.\.\. \(100000 characters\)` is no number"):
        open_log(path).read({"table": ["t", "a"]})
