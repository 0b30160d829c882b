"""Implementations as live processes that answer one JSON line with another.

    {"do": "prepare", "task": {..}}   {"values": [..]}                  what it computes, for the check
    {"do": "block", "count": 100}     {"seconds": s, "values": [..]}
    {"do": "peak"}                    {"bytes": b}                      largest memory so far
    anything                          {"error": "..."}                  what went wrong

`Worker` is the driver's end, `serve` that of an implementation written in Python.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Protocol

from ..repository import ROOT, SCRIPTS
from . import BenchmarkError


class Implementation(Protocol):
    """One way to do a task; made from the task's fields."""

    def check(self) -> list[float]:
        """Numbers that every implementation of the task computes alike; not timed."""

    def block(self, count: int) -> dict:
        """The work, `count` times: `seconds`, and `values` or more where it gives numbers worth comparing."""


class Worker:
    """An implementation's process, the driver's end."""

    def __init__(self, command: list[str], *, threads: int = 1):
        """`threads` limits what the libraries may start; an implementation sets its own count besides."""
        names = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "RAYON_NUM_THREADS")
        self.command = command
        self.process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=ROOT,
            env={**os.environ, **dict.fromkeys(names, str(threads)), "PYTHONPATH": str(SCRIPTS)},
        )

    def ask(self, **request) -> dict:
        """One request; an answer that reports an error, or none at all, is raised."""
        try:
            self.process.stdin.write(json.dumps(request) + "\n")
            self.process.stdin.flush()
            line = self.process.stdout.readline()
        except BrokenPipeError:
            line = ""
        if not line:
            raise BenchmarkError(
                f"{' '.join(self.command)}: ended with status {self.process.wait()} at {request.get('do')}"
            )
        answer = json.loads(line)
        if "error" in answer:
            raise BenchmarkError(f"{' '.join(self.command)}: {answer['error']}")
        return answer

    def core_seconds(self) -> float:
        """Core seconds that the process has taken so far."""
        # After the name, which may hold anything, in parentheses; user and system ticks are fields 14 and 15.
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def close(self) -> None:
        """Ends the process."""
        self.process.stdin.close()
        self.process.wait()
        self.process.stdout.close()

    def __enter__(self) -> "Worker":
        return self

    def __exit__(self, *_) -> None:
        self.close()


def peak_bytes() -> int:
    """Largest resident size of this process so far, as the kernel keeps it (`VmHWM`)."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) * 1024
    raise BenchmarkError("no VmHWM in /proc/self/status")


def serve(kinds: dict[str, type]) -> None:
    """Answers until the input ends; a task's field `kind` chooses the implementation, the others are its arguments."""
    implementation = None
    # Output of a library must not be taken for an answer.
    answers, sys.stdout = sys.stdout, sys.stderr
    for line in sys.stdin:
        try:
            request = json.loads(line)
            match request["do"]:
                case "prepare":
                    task = request["task"]
                    implementation = kinds[task.pop("kind")](**task)
                    answer = {"values": [float(value) for value in implementation.check()]}
                case "block":
                    answer = {"values": [], **implementation.block(request["count"])}
                case "peak":
                    answer = {"bytes": peak_bytes()}
                case other:
                    raise BenchmarkError(f"unknown request `{other}`")
        except Exception as error:  # whatever it is, the driver is told
            answer = {"error": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), file=answers, flush=True)
