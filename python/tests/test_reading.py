"""Files that a user names: what is no file, or too large, is refused before it is read, by the function and by its users."""

import json
import os
import resource
import signal
import socket
import subprocess
import sys
from pathlib import Path

import mujoco
import pytest

import hydro_mujoco as hydro
import models
from hydro_mujoco import DataError, reading
from hydro_mujoco.gap import case, trials
from hydro_mujoco.record import scene, water
from hydro_mujoco.recording import folder
from hydro_mujoco.sea import attributes
from hydro_mujoco.trials.log import open_log
from hydro_mujoco.trials.mapping import parse

#: Kind of what stands in a file's place, and what is said of it.
ODD = {
    "device": "is a device; expected a file",
    "pipe": "is a pipe; expected a file",
    "folder": "is a folder; expected a file",
    "socket": "is a socket; expected a file",
    "large": r"is \d+ bytes; expected \d+ at most",
}


@pytest.fixture(autouse=True)
def no_waiting():
    """A reader that waits for somebody to write into a pipe fails."""
    before = signal.signal(signal.SIGALRM, lambda *_: pytest.fail("it waits"))
    signal.alarm(60)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def put(path: Path, kind: str) -> Path:
    """Put what is no file, or a file of a tebibyte, in a file's place."""
    if kind == "device":
        # Read by mistake it is empty, where /dev/zero has no end.
        path.symlink_to("/dev/null")
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    elif kind == "socket":
        # A socket's path has 108 bytes at most.
        before = Path.cwd()
        os.chdir(path.parent)
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(path.name)
        os.chdir(before)
    else:
        path.touch()
        os.truncate(path, 1 << 40)
    return path


@pytest.mark.parametrize("kind", ODD)
def test_what_is_no_file_is_refused(tmp_path, kind):
    path = put(tmp_path / "a", kind)
    for read in (reading.read, reading.read_text, reading.read_json, reading.opened, reading.check):
        with pytest.raises(DataError, match=f"^{path}: {ODD[kind]}$"):
            read(path)
    with pytest.raises(DataError, match=f"^mapping a: {ODD[kind]}$"):
        reading.read_text(path, "mapping a")


def test_a_device_without_end_is_refused():
    with pytest.raises(DataError, match="^/dev/zero: is a device; expected a file$"):
        reading.read("/dev/zero")


def test_the_bound_is_the_largest_size(tmp_path):
    path = tmp_path / "a"
    path.write_text("wet")
    assert reading.read_text(path, most=3) == "wet"
    with pytest.raises(DataError, match=f"^{path}: is 3 bytes; expected 2 at most$"):
        reading.read(path, most=2)
    reading.check(put(tmp_path / "b", "large"), most=None)


def test_what_cannot_be_read_is_told(tmp_path):
    path = tmp_path / "a"
    with pytest.raises(DataError, match=f"^{path}: no such file$"):
        reading.read(path)
    with pytest.raises(DataError, match="embedded null byte"):
        reading.read("a\0b")
    with pytest.raises(DataError, match="Not a directory"):
        reading.read("/dev/null/a")
    path.write_bytes(b"caf\xe9")
    with pytest.raises(DataError, match=f"^{path}: is not UTF-8 text \\(byte 3\\)$"):
        reading.read_json(path)
    for text in ("{", "[" * 100_000):
        path.write_text(text)
        with pytest.raises(DataError, match=f"^{path}: is no JSON \\("):
            reading.read_json(path)
    path.write_text('{"a": 1}')
    assert reading.read_json(path) == {"a": 1}


def document(path, monkeypatch):
    monkeypatch.setattr(attributes, "attribute", lambda *_: str(path))
    attributes.document(None, 0, "waves")


def checkpoint(path, _):
    """By with_checkpoint: of a folder whose card is the path."""
    path.rename(path.parent / "card.json")
    hydro.with_checkpoint(mujoco.MjSpec.from_string(models.fish()), path.parent)


def card(path, _):
    """By MuJoCo Warp's reader of a card."""
    pytest.importorskip("mujoco_warp")
    from hydro_mujoco.warp.checkpoint.card import read_card

    path.rename(path.parent / "card.json")
    read_card(path.parent, "instance `water`")


def weights(path, _):
    pytest.importorskip("mujoco_warp")
    from hydro_mujoco.warp.checkpoint.card import read_card

    path.rename(path.parent / "weights.safetensors")
    path.with_name("card.json").write_text("{}")
    read_card(path.parent, "instance `water`")


def trial(path, monkeypatch):
    monkeypatch.setattr(trials.shutil, "copyfileobj", lambda *_: pytest.fail("it is copied"))
    file = path.rename(path.with_suffix(".npz"))
    trials.write([file], path.parent / "trials", overwrite=False)


def added(path, _):
    path.rename(path.parent / "add.json")
    case.case(path.parent, {})


def bag(path, _):
    pytest.importorskip("rosbags")
    (path.parent / "bag").mkdir()
    path.rename(path.parent / "bag" / "metadata.yaml")
    open_log(path.parent / "bag")


#: By what a user calls: a call that reads the path.
ENTRIES = {
    "mapping": lambda path, _: parse(path, None),
    "model": lambda path, _: scene.read(path),
    "effects": lambda path, _: water._effects(str(path), path.parent),
    "attribute": document,
    "generation": lambda path, _: folder.read(path),
    "checkpoint": checkpoint,
    "card": card,
    "weights": weights,
    "trial": trial,
    "add.json": added,
    "bag": bag,
}


@pytest.mark.parametrize("kind", [kind for kind in ODD if kind != "socket"])
@pytest.mark.parametrize("entry", ENTRIES)
def test_each_reader_refuses_it(tmp_path, monkeypatch, entry, kind):
    path = put(tmp_path / "odd", kind)
    with pytest.raises(DataError, match=ODD[kind]):
        ENTRIES[entry](path, monkeypatch)


@pytest.mark.parametrize("kind", ["device", "pipe", "socket"])
def test_each_log_is_a_file(tmp_path, kind):
    for name, extra in {"a.csv": "pandas", "a.mcap": "mcap", "a.bin": "pymavlink", "a.ulg": "pyulog"}.items():
        pytest.importorskip(extra)
        with pytest.raises(DataError, match=f"log .*{name}: {ODD[kind]}"):
            open_log(put(tmp_path / name, kind))


def test_a_command_refuses_a_device_without_end_at_once(tmp_path):
    pytest.importorskip("pandas")
    (tmp_path / "log.csv").write_text("time,at\n0,1\n")
    (tmp_path / "model.xml").write_text(models.fish())
    words = ["convert", "log.csv", "--model", "model.xml", "--mapping", "/dev/zero", "--out", "out"]
    done = subprocess.run(
        [sys.executable, "-m", "hydro_mujoco.trials", *words],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30)),
    )
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == "trials: mapping /dev/zero: is a device; expected a file\n"
    assert not (tmp_path / "out").exists()


def test_effects_that_are_no_list_or_not_there_are_told(tmp_path):
    (tmp_path / "drag.json").write_text(json.dumps({"effects": 3}))
    with pytest.raises(
        DataError, match="effects `drag.json`: no list `effects`; expected JSON of schema hydro-effects/1"
    ):
        water._effects("drag.json", tmp_path)
    with pytest.raises(DataError, match="effects `dragg.json`: no such file in .*; JSON files there: .*`drag.json`"):
        water._effects("dragg.json", tmp_path)
    with pytest.raises(DataError, match="is no JSON"):
        water._effects("{", tmp_path)
