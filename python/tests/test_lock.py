"""One process works in a folder; a second one is told of the first."""

import errno
import fcntl
import os
import subprocess
import sys

import pytest

from hydro_mujoco.errors import DataError
from hydro_mujoco.recording.lock import locked

HOLD = """
import sys, time
from pathlib import Path
from hydro_mujoco.recording.lock import locked
with locked(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


def test_a_second_one_is_told_of_the_first_and_a_dead_ones_lock_is_taken_over(tmp_path):
    path = tmp_path / ".lock"
    here = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen([sys.executable, "-c", HOLD, str(path)], stdout=subprocess.PIPE, env=here) as holder:
        assert holder.stdout.readline() == b"held\n"
        with pytest.raises(DataError, match=rf"process {holder.pid} \(-c\) is at work there; wait"), locked(path):
            pass
        holder.kill()
    assert path.exists()
    with locked(path):
        assert path.read_text().startswith(f"{os.getpid()} (")
    assert not path.exists()


def test_no_link_is_followed(tmp_path):
    victim, path = tmp_path / "victim", tmp_path / ".lock"
    victim.write_text("precious")
    path.symlink_to(victim)
    with pytest.raises(DataError, match=r"lock .*\.lock: "), locked(path):
        pass
    assert victim.read_text() == "precious"


def test_a_file_system_without_locks_is_no_hindrance(tmp_path, monkeypatch):
    def fails(*_):
        raise OSError(errno.ENOLCK, "no locks")

    monkeypatch.setattr(fcntl, "flock", fails)
    with locked(tmp_path / ".lock"):
        pass
    assert not list(tmp_path.iterdir())
