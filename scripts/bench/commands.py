"""How each contender's process is started."""

import json
import subprocess
import sys
from functools import cache

from . import ROOT, BenchError


def python(module: str) -> list[str]:
  """A contender of `bench.contenders`."""
  # Not as a module of the working directory: the package lies in scripts/.
  start = "import sys; sys.path.insert(0, 'scripts'); import runpy; " \
          f"runpy.run_module('bench.contenders.{module}', run_name='__main__')"
  return [sys.executable, "-c", start]


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
