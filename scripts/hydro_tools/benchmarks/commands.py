"""How each contender's process is started."""

import json
import subprocess
import sys
from functools import cache

from ..repository import ROOT
from . import BenchError


def python(module: str) -> list[str]:
    """A contender of `hydro_tools.benchmarks.implementations`."""
    # -P: the working directory is no place for modules.
    return [sys.executable, "-P", "-m", f"hydro_tools.benchmarks.implementations.{module}"]


@cache
def rust() -> tuple[str, ...]:
    """The Rust contender; cargo says where it was built, and builds it where it is not."""
    build = ["cargo", "build", "--release", "--quiet", "--bench", "contender", "--message-format=json"]
    done = subprocess.run(build, cwd=ROOT, capture_output=True, text=True)
    for line in done.stdout.splitlines():
        message = json.loads(line)
        if message.get("executable") and message["target"]["name"] == "contender":
            return (message["executable"],)
    raise BenchError(f"cargo built no contender:\n{done.stderr}")
