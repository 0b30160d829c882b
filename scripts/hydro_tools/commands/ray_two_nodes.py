"""Task 2 through two Ray nodes of this machine, beside two worker processes: time, memory, the same bytes?

    scripts/setup_venv.sh ray
    .venv-ray/bin/python scripts/ray_two_nodes.py --out out/ray --trials 100 400
    .venv-ray/bin/python scripts/ray_two_nodes.py --out out/ray --trials 10000

For each size it runs gen_task2.py with --workers 2, with --ray on two nodes of one core, and with --ray once more while
the second node is killed when a third of the shards stands (--unharmed leaves that out). Exit status 1 where a
file differs. Memory [MiB] is that of the process that writes the files: its own at the first shard and its greatest
thereafter, and the pages of Ray's object store that it has touched (shared; the store reuses them). The data sets
stay in OUT.
"""

import argparse
import hashlib
import importlib.util
import subprocess
import sys
import time
from pathlib import Path

from hydro_tools.jobs.two_nodes import TwoNodes
from hydro_tools.repository import SCRIPTS

GENERATOR = SCRIPTS / "gen_task2.py"
#: Seconds between two looks at a running generator.
LOOK = 0.05


class Run:
    """One run of the generator.

    seconds: wall time; first_mib, own_mib, shared_mib: memory of its process [MiB]; digests: sha256 by file name;
    said: its last line.
    """

    def __init__(self, folder: Path, trials: int, shard_size: int, where: list[str], then=None):
        """`where` is handed to the generator; `then()` is called once, when a third of the shards stands."""
        # The name of a data set stands in its manifest: the same for every run.
        out = folder / "task2"
        began, self.first_mib, self.own_mib, self.shared_mib = time.monotonic(), 0.0, 0.0, 0.0
        command = [sys.executable, GENERATOR, "--water", "ellipsoid", "--out", out, "--trials", trials]
        command += ["--shard-size", shard_size, *where]
        with subprocess.Popen(
            [*map(str, command)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        ) as run:
            while run.poll() is None:
                stand = len(list(out.glob("*.safetensors")))
                if stand:
                    own, shared = resident_mib(run.pid)
                    self.first_mib = self.first_mib or own
                    self.own_mib, self.shared_mib = max(self.own_mib, own), max(self.shared_mib, shared)
                if then and stand * shard_size >= trials / 3:
                    then()
                    then = None
                time.sleep(LOOK)
            self.said = run.stdout.read().strip()
        if run.returncode:
            sys.exit(f"ray_two_nodes.py: gen_task2.py exited with {run.returncode}; run it by hand to see why")
        if then:
            sys.exit(f"ray_two_nodes.py: {trials} trajectories were done before a node could be killed; ask for more")
        self.seconds = time.monotonic() - began
        self.digests = {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(out.iterdir())}


def resident_mib(pid: int) -> tuple[float, float]:
    """Resident memory of a process now, its own and shared, without files that it maps; zeros where it is gone."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines()
    except OSError:
        return 0.0, 0.0
    kib = {line.split()[0]: int(line.split()[1]) for line in lines if line.startswith("Rss")}
    return kib.get("RssAnon:", 0) / 1024, kib.get("RssShmem:", 0) / 1024


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
    if not importlib.util.find_spec("ray"):
        parser.error("Ray is not installed here: scripts/setup_venv.sh ray")
    there = [str(folder) for folder in (args.out / str(trials) for trials in args.trials) if folder.exists()]
    if there:
        parser.error(f"{', '.join(there)} exists: choose another --out, or remove what a former run left")
    same = True
    print("trajectories  how                     seconds  ratio        own MiB  shared  bytes")
    for trials in args.trials:

        def run(name: str, *where: str, then=None, trials=trials) -> Run:
            return Run(args.out / str(trials) / name, trials, args.shard_size, list(where), then)

        runs = {"--workers 2": run("workers", "--workers", "2")}
        with TwoNodes() as nodes:
            runs["--ray, two nodes"] = run("ray", "--ray", nodes.address)
            if not args.unharmed:
                runs["--ray, one killed"] = run("killed", "--ray", nodes.address, then=nodes.kill_second)
        reference = runs["--workers 2"]
        for how, done in runs.items():
            equal = done.digests == reference.digests
            same &= equal
            print(
                f"{trials:12}  {how:22}  {done.seconds:7.1f}  {done.seconds / reference.seconds:5.2f}  "
                f"{done.first_mib:5.1f}..{done.own_mib:6.1f}  {done.shared_mib:6.1f}  "
                f"{f'same {len(done.digests)} files' if equal else 'OTHER'}",
                flush=True,
            )
        print(f"              {runs['--ray, two nodes'].said}", flush=True)
    return 0 if same else 1
