"""Long logs by blocks: the numbers are those of one block, and a disk that is full is said."""

import gc
import os
import resource
import signal

import mujoco
import numpy as np
import pandas
import pytest

from hydro_mujoco import DataError, trials
from hydro_mujoco.recording import files
from hydro_mujoco.trials import scratch

MJCF = """<mujoco><option timestep="0.01"/><worldbody><body name="hull"><freejoint/><geom size="0.1" mass="1"/>
<site name="s"/><body name="arm"><joint name="turn" axis="0 0 1"/><geom size="0.05" mass="0.1"/></body></body></worldbody>
<actuator><motor name="m" joint="turn"/></actuator>
<sensor><gyro name="gyro" site="s"/><framequat name="attitude" objtype="site" objname="s"/>
<velocimeter name="dvl" site="s"/><jointpos name="angle" joint="turn"/></sensor></mujoco>"""
MAPPING = {
    "schema": "hydro-mapping/1",
    "trials": {"mode": {"topic": "table", "field": "mode", "values": ["dive"]}, "shortest": 1.0},
    "sensors": {
        "gyro": {"fields": ["gx", "gy", "gz"], "frame": "FRD"},
        "attitude": {"fields": ["qx", "qy", "qz", "qw"], "order": "xyzw", "frame": "NED/FRD"},
        "dvl": {"fields": ["vn", "ve", "vd"], "frame": "NED", "attitude": "attitude"},
        "angle": {"fields": ["angle"], "unit": "deg"},
    },
    "actuators": {"m": {"fields": ["command"]}},
    "state": {
        "hull": {
            "position": {"fields": ["x", "y", "z"]},
            "attitude": {"fields": ["qw", "qx", "qy", "qz"], "frame": "NED/FRD"},
            "linear_velocity": {"fields": ["vn", "ve", "vd"], "frame": "NED"},
            "angular_velocity": {"fields": ["gx", "gy", "gz"], "frame": "FRD"},
        },
        "turn": {"position": {"fields": ["angle"], "unit": "deg"}, "velocity": {"fields": ["gz"]}},
    },
}


def table(n=3000):
    """A hull that turns around and around: quaternions of either sign, angles that jump, times out of order."""
    random = np.random.default_rng(4)
    times = 0.005 * np.arange(n)
    # One that lags by 0.3 s, one that comes twice, one without a time.
    times[700], times[1500], times[2000] = times[640], times[1499], np.nan
    yaw = 2.0 * times
    found = pandas.DataFrame({"time": times, "angle": np.degrees((3 * times + np.pi) % (2 * np.pi) - np.pi)})
    signs = np.where(random.random(n) < 0.5, -1, 1)
    for name, values in zip(("qw", "qx", "qy", "qz"), (np.cos(yaw / 2), 0 * yaw, 0 * yaw, np.sin(yaw / 2))):
        found[name] = signs * values
    for name in ("gx", "gy", "gz", "x", "y", "z", "command"):
        found[name] = random.normal(size=n).cumsum()
    slow = np.arange(n) % 37 == 0
    for name in ("vn", "ve", "vd"):
        found[name] = np.where(slow, random.normal(size=n), np.nan)
    found.loc[900:905, "gy"] = np.nan
    found["mode"] = np.where((found.index > 300) & (found.index < 2700), "dive", "idle")
    return found


def converted():
    found = trials.from_dataframe(table(), model=mujoco.MjSpec.from_string(MJCF), mapping=MAPPING)
    return [trial.arrays() for trial in found], str(found.report)


@pytest.mark.parametrize("numbers", [40, 1000])
def test_blocks_change_no_number(monkeypatch, numbers):
    whole, said = converted()
    assert whole and "by a turn taken out" in said and "run back" in said and "have the stamp of another" in said, said
    monkeypatch.setattr(scratch, "NUMBERS", numbers)
    parts, said_of_parts = converted()
    assert said_of_parts == said and len(parts) == len(whole)
    for one, other in zip(parts, whole):
        assert one.keys() == other.keys() and "initial_state" in one
        for name in one:
            if one[name].dtype.kind == "f":
                np.testing.assert_allclose(one[name], other[name], rtol=1e-12, atol=1e-12, err_msg=name)
            else:
                assert one[name] == other[name]


def test_a_table_is_what_was_appended():
    found = scratch.Table(3)
    rows = np.random.default_rng(0).normal(size=(1000, 3))
    for block in np.array_split(rows, 7):
        found.append(block)
    assert len(found) == 1000
    np.testing.assert_array_equal(found.array(), rows)
    assert scratch.Table(2).array().shape == (0, 2)


@pytest.mark.filterwarnings("error::ResourceWarning", "error::pytest.PytestUnraisableExceptionWarning")
def test_a_table_that_nobody_reads_closes_its_file():
    def opened():
        return len(os.listdir("/proc/self/fd"))

    # What other tests left is closed before.
    gc.collect()
    before = opened()
    found = scratch.Table(1)
    assert opened() == before + 1
    del found
    gc.collect()
    assert opened() == before


def test_a_long_series_is_looked_at_in_part(monkeypatch):
    monkeypatch.setattr(scratch, "ENOUGH", 1000)
    times = np.cumsum(np.random.default_rng(0).choice([0.01, 0.02], p=[0.8, 0.2], size=50_000))
    found = scratch.steps(times)
    assert found.size == 1000 and np.median(found) == pytest.approx(0.01) and 0.15 < (found > 0.015).mean() < 0.25
    assert scratch.steps(times[:5]).size == 4 and scratch.steps(times[:1]).size == 0 == scratch.steps(times[:0]).size


def test_a_folder_that_is_not_there_is_named(monkeypatch, tmp_path):
    monkeypatch.setenv("TMPDIR", str(tmp_path / "none"))
    with pytest.raises(DataError, match=r"folder .*none, where the numbers of a log are kept .*: No such file.*TMPDIR"):
        scratch.Table(1)


def test_a_disk_that_is_full_is_said(tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    found, limits = scratch.Table(1), resource.getrlimit(resource.RLIMIT_FSIZE)
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, limits[1]))
    try:
        with pytest.raises(DataError, match=f"folder {tmp_path}, where the numbers of a log are kept .*too large"):
            found.append(np.zeros((100_000, 1)))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, before)
    assert not list(tmp_path.iterdir())


def test_an_archive_by_parts_has_the_bytes_of_one_in_memory(tmp_path, monkeypatch):
    arrays = {"a": np.random.default_rng(0).normal(size=(500, 3))[:, 1:], "name": np.array("x")}
    files.write_npz(tmp_path / "a.npz", arrays)
    assert (tmp_path / "a.npz").read_bytes() == files.npz_bytes(arrays)
    monkeypatch.setattr(files, "ZIP64", 0)
    files.write_npz(tmp_path / "b.npz", arrays)
    with np.load(tmp_path / "b.npz") as found:
        np.testing.assert_array_equal(found["a"], arrays["a"])
