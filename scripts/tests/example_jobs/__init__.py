"""Work for the tests of fan-outs: a package, for it must reach worker processes and nodes."""

import os
import subprocess
from pathlib import Path


def where(_) -> bytes:
    """The file that defines this work, as the worker sees it."""
    return __file__.encode()


def fails(job: str) -> bytes:
    """Refuses `bad`."""
    if job == "bad":
        raise ValueError("what was found, where, what was expected")
    return job.encode()


def kills_its_worker(_) -> bytes:
    """As a segmentation fault would."""
    os._exit(1)


def begins(file: str) -> bytes:
    """Leaves a file as it begins."""
    Path(file).touch()
    return b""


def command(line: list[str]) -> bytes:
    """Output of a command."""
    return subprocess.run(line, capture_output=True, check=True).stdout
