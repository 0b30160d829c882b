"""`hydro compare` on a Ray cluster: a job a core, tables here.

    .venv-ray/bin/python scripts/compare_ray.py --ray auto -- task2 --data data/task2 --out out/task2

What follows `--` is for `hydro compare`. Jobs that --out holds are not done again. Nodes need the `hydro` program, the
data and the rollouts at the same paths as here; a job's own files go along and come back, and only this process writes.
A training gives the same weights wherever it runs, as long as the processors have the same instructions. --ray here
does it in this process.
"""

import argparse
import json
import os
import subprocess
import sys
from contextlib import closing
from pathlib import Path

from hydro_mujoco.jobs import JobError
from hydro_mujoco.jobs.here import Here
from hydro_tools.jobs.cluster import Cluster
from hydro_tools.jobs.program import HERE, Job, Program, packed, unpack

#: Flags of `hydro compare` that name files, which nodes must find from wherever they are.
PATHS = ("--data", "--rollouts", "--long", "--scenes")


def parse() -> argparse.Namespace:
    """The command line, checked."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--ray",
        metavar="ADDRESS",
        required=True,
        help="auto, host:6379, ray://host:10001, local for a cluster on this machine, here for none",
    )
    parser.add_argument("--hydro", type=Path, default=Path("target/release/hydro"), help="default: %(default)s")
    parser.add_argument("words", nargs="+", metavar="-- WORDS", help="for `hydro compare`")
    args = parser.parse_args()
    if not args.hydro.is_file():
        parser.error(f"--hydro {args.hydro}: no such program; cargo build --release makes it")
    if "--out" not in args.words:
        parser.error("expected --out among the words for `hydro compare`")
    return args


def everywhere(words: list[str]) -> list[str]:
    """The words with paths made absolute and scenes named."""
    words = list(words)
    if "--scenes" not in words:
        words += ["--scenes", "mjcf"]
    for at, word in enumerate(words[:-1]):
        if word in PATHS:
            words[at + 1] = str(Path(words[at + 1]).resolve())
        elif word == "--beyond":
            name, _, folder = words[at + 1].partition("=")
            words[at + 1] = f"{name}={Path(folder).resolve()}"
    return words


def main() -> int:
    """Run the command line; returns the exit status."""
    args = parse()
    compare = [str(args.hydro.resolve()), "compare"]
    words = everywhere(args.words)
    out = Path(words[words.index("--out") + 1])
    listed = subprocess.run([*compare, *words, "--list", "--json"], stdout=subprocess.PIPE, check=False)
    if listed.returncode:
        return listed.returncode
    away = [HERE if words[at - 1] == "--out" else word for at, word in enumerate(words)]
    names = [job["job"] for job in json.loads(listed.stdout) if not job["done"]]
    # The files of a job in --out are sent with it: a model that is only examined again is not trained again.
    jobs = {name: Job([*compare, *away, "--only", name], packed(out, f"jobs/{name}")) for name in names}
    work = Program((("RAYON_NUM_THREADS", "1"),))
    try:
        with Here() if args.ray == "here" else Cluster(args.ray) as executor:
            with closing(executor.run(work, jobs)) as results:
                for count, (name, content) in enumerate(results, 1):
                    unpack(content, out)
                    print(f"{count}/{len(jobs)} {name}", file=sys.stderr)
            print(executor.description, file=sys.stderr)
    except (JobError, OSError) as error:
        print(f"compare_ray.py: {error}; finished jobs are kept in {out}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(f"\ncompare_ray.py: stopped; finished jobs are kept in {out}", file=sys.stderr)
        return 130
    os.execv(compare[0], [*compare, *words, "--tables"])
