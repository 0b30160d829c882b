"""A scene compiled and stepped with the plugin, in a process of its own, forked from one that has imported MuJoCo.

Such a process has loaded no plugin and compiled no model: a case sees what it would see in a new interpreter, without
the half second that importing takes. It ends with 0, or with 1 and `REFUSED: ` and MuJoCo's message. A warning that
comes at every step is an error too: a fault is said once a simulation. (MuJoCo resets one that diverges, which is a new
one.)
"""

import ctypes
import multiprocessing
import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import mujoco

from .limits import Limits

#: Steps of a scene.
STEPS = 30
_FORKS = multiprocessing.get_context("forkserver")
# What the main module of a campaign imports too, for every fork looks into that.
_FORKS.set_forkserver_preload([__name__, "hydro_tools.commands.hostile"])


class Scene:
    """The process of a scene, with the members of `subprocess.Popen`."""

    def __init__(self, library: Path, scene: Path, limits: Limits, folder: Path):
        """Start it. Its output goes to `stdout` and `stderr` of the folder."""
        self._process = _FORKS.Process(target=_child, args=(library, scene, limits, folder))
        self._process.start()

    def wait(self, seconds: float | None = None) -> int | None:
        """Wait for its end [s]; raises `subprocess.TimeoutExpired` where there is none in time."""
        self._process.join(seconds)
        if self._process.is_alive():
            raise subprocess.TimeoutExpired("scene", seconds or 0.0)
        return self._process.exitcode

    def send_signal(self, number: int) -> None:
        """Send a signal."""
        os.kill(self.pid, number)

    def kill(self) -> None:
        """Kill it."""
        self._process.kill()

    @property
    def pid(self) -> int:
        """Its number."""
        assert self._process.pid is not None
        return self._process.pid

    @property
    def returncode(self) -> int | None:
        """Status, negative for a signal."""
        return self._process.exitcode


def _child(library: Path, scene: Path, limits: Limits, folder: Path) -> None:
    """The life of the process."""
    for name, stream in (("stdout", sys.stdout), ("stderr", sys.stderr)):
        with open(folder / name, "wb") as file:
            os.dup2(file.fileno(), stream.fileno())
    os.chdir(folder)
    limits.set()
    status = run(library, scene)
    sys.stdout.flush()
    sys.stderr.flush()
    # With what the libraries do at the end of a process, which the fork of a server leaves out.
    ctypes.CDLL(None).exit(status)


def run(library: Path, scene: Path) -> int:
    """Load, step, say how it went."""
    warnings: Counter = Counter()
    mujoco.set_mju_user_warning(lambda text: warnings.update([text]))
    mujoco.mj_loadPluginLibrary(str(library))
    try:
        model = mujoco.MjModel.from_xml_path(str(scene))
        data = mujoco.MjData(model)
        starts = 2  # The reset after the steps is one too.
        for _ in range(STEPS):
            before = data.time
            mujoco.mj_step(model, data)
            starts += data.time <= before
        mujoco.mj_resetData(model, data)
        mujoco.mj_forward(model, data)
        sys.stdout.write(f"{data.qfrc_passive.tolist()[:12]}\n")
    except (ValueError, RuntimeError, mujoco.FatalError) as error:
        sys.stderr.write(f"REFUSED: {error}\n")
        return 1
    often = [
        text
        for text, count in warnings.items()
        if "panic" in text or ("hydro" in text and count >= STEPS and count > starts)
    ]
    if often:
        sys.stderr.write(f"panicked at each step, or a warning at each: {often[0]}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(run(Path(sys.argv[1]), Path(sys.argv[2])))
