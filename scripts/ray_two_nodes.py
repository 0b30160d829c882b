#!/usr/bin/env python3
"""Task 2 through two Ray nodes of this machine, beside two worker processes: time, memory, the same bytes?

    python -m venv .venv-ray && .venv-ray/bin/pip install -r scripts/requirements.txt -r scripts/requirements-ray.txt
    .venv-ray/bin/python scripts/ray_two_nodes.py --out out/ray --trials 100 400
    .venv-ray/bin/python scripts/ray_two_nodes.py --out out/ray --trials 10000

For each size it runs gen_task2.py with --workers 2, with --ray on two nodes of one core, and with --ray once more while
the second node is killed when a third of the shards stands (--unharmed leaves that out). Exit status 1 where a
file differs. Memory is the resident memory [MiB] of the process that writes the files, greatest value while shards
arrive. The data sets stay in OUT for a look.
"""

import argparse
import hashlib
import shutil
import subprocess
import sys
import time
from pathlib import Path

from fanout.two_nodes import TwoNodes

GENERATOR = Path(__file__).resolve().parent / "gen_task2.py"
#: Seconds between two looks at a running generator.
LOOK = 0.05


class Run:
    """One run of the generator: seconds, peak_mib, digests (sha256 by file), said (its last line)."""

    def __init__(self, folder: Path, arguments: list, then=None):
        """`then()` is called once, when a third of the shards stands."""
        shutil.rmtree(folder, ignore_errors=True)
        # The name of a data set stands in its manifest: the same for every run.
        out = folder / "task2"
        began, self.peak_mib, size, shards = time.monotonic(), 0.0, *arguments[:2]
        command = [sys.executable, GENERATOR, "--out", out, "--trials", size, "--shard-size", shards, *arguments[2:]]
        with subprocess.Popen([*map(str, command)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as run:
            while run.poll() is None:
                stand = len(list(out.glob("*.safetensors")))
                if stand:
                    self.peak_mib = max(self.peak_mib, resident_mib(run.pid))
                if then and stand * shards >= size / 3:
                    then()
                    then = None
                time.sleep(LOOK)
            self.said = run.stdout.read().strip()
        if run.returncode:
            sys.exit(f"ray_two_nodes.py: gen_task2.py exited with {run.returncode}; run it by hand to see why")
        if then:
            sys.exit(f"ray_two_nodes.py: {size} trajectories were done before a node could be killed; ask for more")
        self.seconds = time.monotonic() - began
        self.digests = {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(out.iterdir())}


def resident_mib(pid: int) -> float:
    """Resident memory of a process now; 0 where it is gone."""
    try:
        status = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    except OSError:
        return 0.0
    return sum(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmRSS:")) / 1024


def main() -> int:
    """Parse, run, print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/ray"), help="folder (default: %(default)s)")
    parser.add_argument("--trials", type=int, nargs="+", default=[200], help="sizes (default: 200)")
    parser.add_argument("--shard-size", type=int, default=5, help="trajectories a file (default: %(default)s)")
    parser.add_argument("--unharmed", action="store_true", help="no run in which a node is killed")
    args = parser.parse_args()
    if min(*args.trials, args.shard_size, sys.maxsize) < 1:
        parser.error("--trials and --shard-size: at least 1")
    same = True
    print("trajectories  how                     seconds  ratio   MiB  bytes")
    for trials in args.trials:
        size, folder = [trials, args.shard_size], args.out / str(trials)
        runs = {"--workers 2": Run(folder / "workers", [*size, "--workers", 2])}
        with TwoNodes() as nodes:
            runs["--ray, two nodes"] = Run(folder / "ray", [*size, "--ray", nodes.address])
            if not args.unharmed:
                runs["--ray, one killed"] = Run(folder / "killed", [*size, "--ray", nodes.address], nodes.kill_second)
        reference = runs["--workers 2"]
        for how, run in runs.items():
            equal = run.digests == reference.digests
            same &= equal
            print(f"{trials:12}  {how:22}  {run.seconds:7.1f}  {run.seconds / reference.seconds:5.2f}  {run.peak_mib:4.0f}  "
                  f"{f'same {len(run.digests)} files' if equal else 'OTHER'}", flush=True)
        print(f"              {runs['--ray, two nodes'].said}", flush=True)
    return 0 if same else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except ImportError as error:
        sys.exit(f"ray_two_nodes.py: {error}: pip install -r scripts/requirements-ray.txt")
