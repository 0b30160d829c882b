"""One command under a limit of memory and of time, and what its end says."""

import os
import re
import resource
import signal
import subprocess
import time
from dataclasses import dataclass, field
from pathlib import Path

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
class Limits:
    """Address space [byte] and time [s] of a command."""

    memory: int
    seconds: float


@dataclass(frozen=True)
class Case:
    """A command and what may come of it."""

    command: list
    #: A run that has not ended when its time is over is stopped by SIGINT and counts as accepted.
    may_run_on: bool = False
    environment: dict = field(default_factory=dict)


@dataclass(frozen=True)
class Outcome:
    """How a command ended: `refused`, `accepted` or `broken`, and why."""

    result: str
    why: str


def run(case: Case, limits: Limits, folder: Path) -> Outcome:
    """Run a command in a folder and judge its end."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (limits.memory, limits.memory))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        # A campaign in the background of a shell ignores SIGINT, and its children would inherit that.
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    out, err = folder / "stdout", folder / "stderr"
    with open(out, "wb") as out_file, open(err, "wb") as err_file:
        process = subprocess.Popen(
            [os.fsencode(part) if not isinstance(part, bytes) else part for part in map(_plain, case.command)],
            stdin=subprocess.DEVNULL,
            stdout=out_file,
            stderr=err_file,
            cwd=folder,
            env={**os.environ, "RUST_BACKTRACE": "0", **case.environment},
            preexec_fn=limit,
            start_new_session=True,
        )
        stopped = None
        try:
            process.wait(limits.seconds)
        except subprocess.TimeoutExpired:
            stopped = time.monotonic()
            process.send_signal(signal.SIGINT)
            try:
                process.wait(4 * PATIENCE)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
            stopped = time.monotonic() - stopped
    with open(err, "rb") as file:
        text = file.read(_OUTPUT).decode("utf-8", "replace")
    return judge(process.returncode, text, stopped, case.may_run_on)


def _plain(part: object) -> object:
    return part if isinstance(part, (bytes, str)) else str(part)


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
        return Outcome("accepted", "runs on, stopped by SIGINT")
    if status < 0:
        return Outcome("broken", f"killed by {signal.Signals(-status).name}: {_last(text)}")
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
