"""Ctrl-C in `record` and in `trials convert`, from Python and from the command: nothing is half written, one line says so."""

import os
import signal
import subprocess
import sys
import threading
import time

import pytest

import models
from hydro_mujoco.jobs.processes import Processes
from hydro_mujoco.recording.files import write_beside
from hydro_mujoco.recording.interrupts import held_back

#: As on a terminal; a background job of a shell would ignore it.
HEEDS = {"start_new_session": True, "preexec_fn": lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)}
#: Seconds from a Ctrl-C to the end, of the quickest of some attempts: others may have the cores meanwhile.
MOST, ATTEMPTS = 1.0, 3
FISH = ["--trials", "4000", "--samples", "200", "--shard-size", "5"]
CALL = """
import hydro_mujoco
hydro_mujoco.record("fish.xml", "data", trials=4000, samples=200, shard_size=5, workers={workers})
"""


def started(words, folder):
    return subprocess.Popen(words, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **HEEDS)


def interrupted(child, has_begun, patience=60.0):
    """Its status and standard error after a Ctrl-C that comes once `has_begun()`; how long it took to end [s]."""
    end = time.monotonic() + patience
    while not has_begun():
        assert child.poll() is None and time.monotonic() < end, child.communicate()
        time.sleep(0.01)
    # To the whole group, as a terminal does.
    os.killpg(child.pid, signal.SIGINT)
    start = time.monotonic()
    _, said = child.communicate(timeout=patience)
    return child.returncode, said, time.monotonic() - start


def holds_to_a_second(attempt, folder):
    """Hold `attempt`, which interrupts a command in a folder and returns its seconds, to MOST."""
    times = []
    while len(times) < ATTEMPTS and min(times, default=MOST) >= MOST:
        place = folder / f"attempt-{len(times)}"
        place.mkdir()
        times.append(attempt(place))
    assert min(times) < MOST, times


def left(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.parametrize("workers", [1, 2])
@pytest.mark.parametrize("by", ["command", "python"])
def test_recording(tmp_path, workers, by):
    holds_to_a_second(lambda folder: recording(folder, workers, by), tmp_path)


def recording(folder, workers, by):
    (folder / "fish.xml").write_text(models.fish())
    command = [sys.executable, "-m", "hydro_mujoco.record", "--model", "fish.xml", "--out", "data", *FISH]
    words = [*command, "--workers", str(workers)] if by == "command" else [sys.executable, "-c", CALL.format(workers=workers)]  # fmt: skip
    child = started(words, folder)
    shards = folder / "data"
    status, said, took = interrupted(child, lambda: len(list(shards.glob("*.safetensors"))) >= 2)
    names = left(shards)
    assert "generation.json" in names and "manifest.json" not in names
    assert all(name.endswith((".safetensors", "generation.json")) for name in names), names
    lines = [line for line in said.splitlines() if "stopped" in line]
    if by == "command":
        assert status == 130
        assert lines == ["record: stopped; finished shards are kept in data: go on with --resume"], said
        assert "Traceback" not in said
    else:
        assert lines == ["hydro record: stopped; finished shards are kept in data: go on with resume=True"], said
        assert said.count("Traceback") == said.count("KeyboardInterrupt") == 1, said
    return took


def test_what_was_stopped_goes_on_to_the_same_bytes(tmp_path):
    (tmp_path / "fish.xml").write_text(models.fish())
    words = ["--trials", "16", "--samples", "100", "--shard-size", "2", "--workers", "1"]
    command = [sys.executable, "-m", "hydro_mujoco.record", "--model", "fish.xml", *words, "--out"]
    child = started([*command, "stopped"], tmp_path)
    status, _, _ = interrupted(child, lambda: (tmp_path / "stopped" / "generation.json").exists())
    assert status == 130
    subprocess.run([*command, "stopped", "--resume"], cwd=tmp_path, check=True, capture_output=True)
    subprocess.run([*command, "whole"], cwd=tmp_path, check=True, capture_output=True)
    names = left(tmp_path / "whole")
    assert names == left(tmp_path / "stopped")
    for name in names:
        one, other = ((tmp_path / folder / name).read_bytes() for folder in ("stopped", "whole"))
        assert one.replace(b"stopped", b"whole") == other, name


def test_a_worker_drops_the_job_that_it_is_at():
    with Processes(2) as executor:
        results = executor.run(time.sleep, {"one": 60.0, "two": 60.0, "three": 60.0})
        threading.Timer(4.0, os.kill, (os.getpid(), signal.SIGINT)).start()
        start = time.monotonic()
        with pytest.raises(KeyboardInterrupt):
            next(results)
        assert 3 < time.monotonic() - start < 14


def test_a_rename_is_not_interrupted(tmp_path):
    with pytest.raises(KeyboardInterrupt), held_back():
        signal.raise_signal(signal.SIGINT)
        (tmp_path / "a").write_text("whole")
    assert (tmp_path / "a").read_text() == "whole"
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.fixture(autouse=True)
def heeds_interrupts():
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_an_interrupt_in_a_write_leaves_no_part(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "fsync", lambda _: signal.raise_signal(signal.SIGINT))
    with pytest.raises(KeyboardInterrupt):
        write_beside(tmp_path / "a", b"half")
    assert left(tmp_path) == []


MJCF = """<mujoco><option timestep="0.01"/><worldbody><body name="hull"><freejoint/><geom size="0.1" mass="1"/>
<site name="s"/></body></worldbody><sensor><gyro name="imu_gyro" site="s"/></sensor></mujoco>"""
MAP = """schema = "hydro-mapping/1"
[trials]
length = 10
[sensors.imu_gyro]
topic = "IMU"
fields = ["GyrX", "GyrY", "GyrZ"]
"""


def logged(folder, n):
    """A log of `n` samples 5 ms apart, its model and its mapping."""
    writers = pytest.importorskip("writers")
    log = writers.DataFlash(folder / "a.bin")
    log.format("IMU", "QBfff", "TimeUS,I,GyrX,GyrY,GyrZ", "s#EEE")
    for k in range(n):
        log.write("IMU", 5000 * k, 0, 0.1, 0.01 * (k % 100), 0.3)
    log.close()
    (folder / "m.xml").write_text(MJCF)
    (folder / "map.toml").write_text(MAP)


CONVERT = """
from hydro_mujoco import trials
trials.from_ardupilot("a.bin", model="m.xml", mapping="map.toml", out="out")
"""


@pytest.mark.parametrize("by", ["command", "python"])
def test_converting(tmp_path, by):
    holds_to_a_second(lambda folder: converting(folder, by), tmp_path)


def converting(folder, by):
    logged(folder, 200_000)
    words = ["-m", "hydro_mujoco.trials", "convert", "a.bin", "--model", "m.xml", "--mapping", "map.toml", "--out", "out"]  # fmt: skip
    child = started([sys.executable, *(words if by == "command" else ["-c", CONVERT])], folder)

    def is_open():
        fds = [f"/proc/{child.pid}/fd/{name}" for name in os.listdir(f"/proc/{child.pid}/fd")]
        return any(os.path.realpath(fd) == str(folder / "a.bin") for fd in fds)

    status, said, took = interrupted(child, is_open)
    assert not (folder / "out").exists()
    lines = [line for line in said.splitlines() if "stopped" in line]
    if by == "command":
        assert (status, said.strip()) == (130, "trials: stopped; no half-written file is left")
    else:
        assert lines == ["hydro trials: stopped; no half-written file is left"] and said.count("Traceback") == 1, said
    return took


@pytest.mark.parametrize("before", [False, True])
@pytest.mark.parametrize("at", ["trial", "rename"])
def test_an_interrupt_while_trials_are_written(tmp_path, monkeypatch, at, before):
    """In the middle of a trial nothing of it is left; in the middle of the renames all of it stands."""
    from hydro_mujoco.trials import convert, from_ardupilot

    logged(tmp_path, 8000)
    parts = {"model": tmp_path / "m.xml", "mapping": tmp_path / "map.toml", "out": tmp_path / "out"}
    if before:
        from_ardupilot(tmp_path / "a.bin", **parts)
    there = {path.name: path.read_bytes() for path in (tmp_path / "out").glob("*")}
    write, replace, seen = convert.write_npz, os.replace, []

    def interrupt(name):
        seen.append(name)
        if len(seen) == 2:
            signal.raise_signal(signal.SIGINT)

    def written(path, arrays):
        interrupt(path.name)
        write(path, arrays)

    def renamed(new, path):
        if str(new).endswith(".tmp"):
            return replace(new, path)
        interrupt(path.name)
        return replace(new, path)

    if at == "trial":
        monkeypatch.setattr(convert, "write_npz", written)
    else:
        monkeypatch.setattr(convert.os, "replace", renamed)
    (tmp_path / "map.toml").write_text(MAP.replace("10", "20"))
    with pytest.raises(KeyboardInterrupt) as stop:
        from_ardupilot(tmp_path / "a.bin", **parts, overwrite=before)
    assert stop.value.__notes__ == ["hydro trials: stopped; no half-written file is left"]
    found = {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()}
    if at == "trial":
        assert found == there
    else:
        assert sorted(found) == ["a-00.npz", "a-01.npz", "a.conversion.json"]
