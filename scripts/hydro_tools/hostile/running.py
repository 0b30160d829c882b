"""One command, or one scene, under a limit of memory and of time, and what its end says."""

import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from .limits import Limits
from .plugin_case import Scene

#: Lines of a message at most.
LINES = 3
#: Seconds within which one SIGINT must end a command.
PATIENCE = 1.0
_ABORT = re.compile(
    r"panicked at|RUST_BACKTRACE|Traceback \(most|memory allocation of|overflowed its stack|terminate called"
)
#: Output of a command that counts, in bytes.
_OUTPUT = 1 << 20


@dataclass(frozen=True)
class Case:
    """A command and what may come of it."""

    command: list
    #: A run that has not ended when its time is over is stopped by SIGINT and counts as accepted.
    may_run_on: bool = False

    def start(self, limits: Limits, folder: Path) -> subprocess.Popen:
        """Start it in a folder, its output in the files `stdout` and `stderr` there."""
        words = [part if isinstance(part, bytes) else os.fsencode(str(part)) for part in self.command]
        with open(folder / "stdout", "wb") as out, open(folder / "stderr", "wb") as err:
            return subprocess.Popen(
                words,
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=err,
                cwd=folder,
                env={**os.environ, "RUST_BACKTRACE": "0"},
                preexec_fn=limits.set,
                start_new_session=True,
            )


@dataclass(frozen=True)
class SceneCase:
    """An MJCF that is compiled and stepped with the plugin."""

    library: Path
    scene: Path
    may_run_on: bool = False

    @property
    def command(self) -> list:
        """What does the same by hand."""
        return [sys.executable, "-m", "hydro_tools.hostile.plugin_case", self.library, self.scene]

    def start(self, limits: Limits, folder: Path) -> Scene:
        """As that of `Case`."""
        return Scene(self.library, self.scene, limits, folder)


@dataclass(frozen=True)
class Outcome:
    """How a command ended: `refused`, `accepted` or `broken`, and why."""

    result: str
    why: str


def run(case: Case | SceneCase, limits: Limits, folder: Path) -> Outcome:
    """Run a case in a folder and judge its end."""
    process = case.start(limits, folder)
    stopped = None
    if not _ends(process, limits.seconds):
        stopped = time.monotonic()
        process.send_signal(signal.SIGINT)
        try:
            process.wait(4 * PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        stopped = time.monotonic() - stopped
    with open(folder / "stderr", "rb") as file:
        text = file.read(_OUTPUT).decode("utf-8", "replace")
    assert process.returncode is not None
    return judge(process.returncode, text, stopped, case.may_run_on)


def _ends(process: subprocess.Popen | Scene, seconds: float) -> bool:
    """Wait for its end; false where it has taken that much of a processor [s], or none for as long."""
    before = -1.0
    while True:
        try:
            process.wait(seconds)
            return True
        except subprocess.TimeoutExpired:
            used = _processor_time(process.pid)
        if used >= seconds or used == before:
            return False
        before = used


def _processor_time(pid: int) -> float:
    """Time that a process has had of a processor [s]; of one that has ended, none."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return sum(map(int, fields[11:13])) / os.sysconf("SC_CLK_TCK")


def judge(status: int, text: str, stopped: float | None, may_run_on: bool) -> Outcome:
    """Judge the end of a command: its status, standard error, and the seconds that SIGINT took, if it was sent."""
    found = _ABORT.search(text)
    if found:
        return Outcome("broken", f"aborts: {_line(text, found.start())}")
    if stopped is not None:
        if stopped > PATIENCE:
            return Outcome("broken", f"SIGINT took {stopped:.1f} s")
        if not may_run_on:
            return Outcome("broken", f"not at an end in time: {_last(text)}")
    if status < 0 and not (stopped is not None and status == -signal.SIGINT):
        return Outcome("broken", f"killed by {signal.Signals(-status).name}: {_last(text)}")
    if stopped is not None:
        return Outcome("accepted", "runs on, stopped by SIGINT")
    if status == 0:
        return Outcome("accepted", _last(text))
    message = _message(text)
    if not message:
        return Outcome("broken", f"status {status} without a message")
    lines = len(message.splitlines())
    # A flag that clap refuses comes with its own hint at --help.
    if status != 2 and lines > LINES:
        return Outcome("broken", f"a message of {lines} lines: {message.splitlines()[0][:200]}")
    if len(message) > 4000:
        return Outcome("broken", f"a message of {len(message)} characters: {message[:200]}")
    return Outcome("refused", message[:400])


def _message(text: str) -> str:
    """The error at the end of standard error; progress stands before it."""
    found = list(re.finditer(r"^(?:hydro|error|REFUSED): ", text, re.MULTILINE))
    return text[found[-1].start() :].strip() if found else ""


def _line(text: str, at: int) -> str:
    """The line at a place and the next one, where a panic says what it is."""
    return " ".join(text[at:].splitlines()[:2])[:300]


def _last(text: str) -> str:
    lines = text.strip().splitlines()
    return lines[-1][:300] if lines else ""
