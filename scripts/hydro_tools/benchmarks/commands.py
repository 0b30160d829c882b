"""Command lines that start the implementations."""

import json
import subprocess
import sys
from functools import cache

from ..repository import ROOT
from . import BenchmarkError


def python(module: str) -> list[str]:
    """An implementation of `hydro_tools.benchmarks.implementations`."""
    # -P: the working directory is no place for modules.
    return [sys.executable, "-P", "-m", f"hydro_tools.benchmarks.implementations.{module}"]


#: The Rust implementations, a bench target of Cargo.toml.
RUST = "implementation"


@cache
def rust() -> tuple[str, ...]:
    """The Rust implementation; cargo says where it was built, and builds it where it is not."""
    build = ["cargo", "build", "--release", "--quiet", "--bench", RUST, "--message-format=json"]
    done = subprocess.run(build, cwd=ROOT, capture_output=True, text=True)
    for line in done.stdout.splitlines():
        message = json.loads(line)
        if message.get("executable") and message["target"]["name"] == RUST:
            return (message["executable"],)
    raise BenchmarkError(f"cargo built no {RUST}:\n{done.stderr}")
