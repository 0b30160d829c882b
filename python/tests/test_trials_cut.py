"""Logs that end too early, of every kind: what is before the cut is read and the cut is said, or one error names the file."""

import re
import struct

import numpy as np
import pandas
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.typesys import Stores, get_typestore

import hydro_mujoco.trials.__main__ as command
from hydro_mujoco.errors import DataError
from hydro_mujoco.trials.log import open_log

ROWS = 400


def csv(path):
    pandas.DataFrame({"t": 0.01 * np.arange(ROWS), "a": np.arange(ROWS) / 7, "b": np.arange(ROWS)}).to_csv(
        path, index=False
    )


def parquet(path):
    pandas.DataFrame({"t": 0.01 * np.arange(ROWS), "a": np.arange(ROWS) / 7}).to_parquet(path)


def telemetry(path):
    from pymavlink.dialects.v20 import ardupilotmega as mavlink

    link = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    with open(path, "wb") as file:
        for n in range(ROWS):
            file.write(struct.pack(">Q", 1_700_000_000_000_000 + n * 10_000))
            file.write(link.attitude_encode(n * 10, n / 7, 0, 0, 0, 0, 0.5).pack(link))


def bag(path):
    store = get_typestore(Stores.ROS1_NOETIC)
    float64 = store.types["std_msgs/msg/Float64"]
    with Writer1(path) as file:
        connection = file.add_connection("/depth", float64.__msgtype__, typestore=store)
        for n in range(ROWS):
            file.write(connection, 10**7 * n, store.serialize_ros1(float64(n / 7), float64.__msgtype__))


@pytest.fixture
def cut(tmp_path):
    """Writes a log and cuts it at a byte, or at a share of its size."""

    def make(write, name, at):
        write(tmp_path / name)
        whole = (tmp_path / name).read_bytes()
        (tmp_path / name).write_bytes(whole[: at if at > 1 else round(len(whole) * at)])
        return tmp_path / name

    return make


@pytest.mark.parametrize("back", [1, 3, 5, 9])
def test_a_csv_whose_last_row_is_cut(tmp_path, cut, back):
    """A row without the end of its line may be cut within a number: 56.57 and 56.57142 both read."""
    csv(tmp_path / "whole.csv")
    whole = (tmp_path / "whole.csv").read_bytes()
    end = whole.index(b"\n", round(len(whole) * 0.6)) + 1
    path = cut(csv, "a.csv", end - back)
    log = open_log(path)
    samples = log.read({"table": ["a"]})["table"]
    rows = whole[:end].count(b"\n") - 2
    np.testing.assert_allclose(samples.values[:, 0], np.arange(rows) / 7)
    (fault,) = log.faults
    found = re.search(r"its last (\d+) bytes may be a row that is cut off .* up to byte (\d+) of (\d+)", fault)
    assert [int(number) for number in found.groups()][1:] == [end - back - int(found[1]), end - back]
    assert log.topics()["table"].count == rows and len(log.faults) == 1


def test_a_csv_that_ends_with_its_line_is_whole(tmp_path):
    csv(tmp_path / "a.csv")
    log = open_log(tmp_path / "a.csv")
    assert len(log.read({"table": ["a"]})["table"].times) == ROWS and not log.faults
    (tmp_path / "head.csv").write_text("t,a")
    assert open_log(tmp_path / "head.csv").topics()["table"].fields.keys() <= {"t", "a"}


@pytest.mark.parametrize("at", [3, 0.3, 0.5, 0.9])
def test_a_parquet_that_is_cut_is_refused(cut, at):
    path = cut(parquet, "a.parquet", at)
    with pytest.raises(DataError, match=f"^{path}: no parquet file that can be read") as refusal:
        open_log(path).read({"table": ["a"]})
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("at", [0.2013, 0.5017, 0.7711])
def test_telemetry_that_is_cut(cut, at):
    path = cut(telemetry, "a.tlog", at)
    log = open_log(path)
    samples = log.read({"ATTITUDE": ["roll"]})["ATTITUDE"]
    assert 0.9 * at * ROWS < len(samples.times) < at * ROWS + 1
    np.testing.assert_allclose(samples.values[:, 0], np.arange(len(samples.times)) / 7, rtol=1e-6)
    assert log.faults == [re.fullmatch(r"the file ends within a message: it was read up to byte \d+ of \d+", log.faults[0])[0]]  # fmt: skip
    log.topics()
    assert len(log.faults) == 1


def test_telemetry_with_bytes_that_are_no_message(tmp_path):
    telemetry(tmp_path / "a.tlog")
    whole = (tmp_path / "a.tlog").read_bytes()
    (tmp_path / "a.tlog").write_bytes(whole[: 48 * 100] + struct.pack(">Q", 1_700_000_000_990_000) + bytes(30) + whole[48 * 100 :])  # fmt: skip
    log = open_log(tmp_path / "a.tlog")
    assert len(log.read({"ATTITUDE": ["roll"]})["ATTITUDE"].times) >= ROWS - 2
    assert re.fullmatch(r"\d+ bytes are no message and were left out", log.faults[0])


@pytest.mark.parametrize("at", [5, 0.2, 0.5, 0.8, 0.99])
def test_a_ros_1_bag_that_is_cut_is_refused(cut, at):
    path = cut(bag, "a.bag", at)
    with pytest.raises(DataError, match=f"^{path}: no ROS bag that can be read") as refusal:
        open_log(path).read({"/depth": ["data"]})
    assert "\n" not in str(refusal.value) and len(str(refusal.value)) < 400


def test_the_command_says_it_loudly(tmp_path, cut, capsys):
    path = cut(csv, "a.csv", 0.7)
    (
        tmp_path / "m.xml"
    ).write_text("""<mujoco><worldbody><body name="a"><joint name="q"/><geom size="0.1" mass="1"/></body>
      </worldbody><sensor><jointpos name="q" joint="q"/></sensor></mujoco>""")
    (tmp_path / "map.toml").write_text('schema = "hydro-mapping/1"\n[sensors.q]\nfield = "a"\n')
    words = ["convert", str(path), "--model", str(tmp_path / "m.xml"), "--mapping", str(tmp_path / "map.toml")]
    assert command.main(words) == 0
    assert "SUSPECT: the file does not end with the end of a line" in capsys.readouterr().out
