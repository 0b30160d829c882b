"""Runs `hydro gap` on hidden-effect cases and keeps its verdicts.

    python scripts/run_hidden.py --cases out/hidden/cases --out out/verdicts
    python scripts/score_hidden.py --cases out/hidden/cases --sealed out/hidden/sealed --verdicts out/verdicts

OUT/<case id>/ is what `hydro gap run` writes, OUT/<case id>.log what it said. A case that has a verdict is not run
again; the sealed answers are not looked for. `--jobs N` runs N cases side by side, each on its share of the cores:
the verdicts are the same, the whole is done sooner, one case later (time one case with `--jobs 1`).
"""

import argparse
import os
import sys
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

from hydro_mujoco import DataError
from hydro_mujoco.reading import read_json
from hydro_mujoco.recording.progress import Progress
from hydro_tools.hidden_cases.gap import run
from hydro_tools.repository import ROOT


def main() -> int:
    """Parse, run what has no verdict yet."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=Path, required=True, help="OUT/cases of gen_hidden.py")
    parser.add_argument("--out", type=Path, required=True, help="folder for the verdicts")
    parser.add_argument("--hydro", type=Path, default=ROOT / "target/release/hydro", help="the program")
    parser.add_argument("--system", action="append", help="only cases of these systems")
    parser.add_argument("--limit", type=float, default=900.0, help="seconds a case may take (default 900)")
    parser.add_argument("--jobs", type=int, default=1, help="cases side by side (default 1: each has every core)")
    args = parser.parse_args()
    if args.jobs < 1:
        parser.error(f"--jobs {args.jobs}: at least 1 is needed")
    if not args.hydro.exists():
        parser.error(f"{args.hydro}: no such program; build it with `cargo build --release`")
    try:
        cases = [
            file.parent
            for file in sorted(args.cases.glob("*/case.json"))
            if not args.system or read_json(file)["system"] in args.system
        ]
    except DataError as error:
        parser.error(str(error))
    if not cases:
        parser.error(f"{args.cases}: no case of these systems; make some with scripts/gen_hidden.py")
    args.out.mkdir(parents=True, exist_ok=True)
    todo = [case for case in cases if not (args.out / case.name / "verdict.json").exists()]
    progress = Progress(len(cases), "cases", done=len(cases) - len(todo))
    faults = []
    threads = max(1, (os.cpu_count() or 1) // args.jobs)
    with ThreadPoolExecutor(args.jobs) as pool:
        running = [pool.submit(run, args.hydro, case, args.out / case.name, args.limit, threads) for case in todo]
        try:
            for done in as_completed(running):
                fault = done.result()
                faults += [fault] if fault else []
                progress.advance()
        except KeyboardInterrupt:
            pool.shutdown(cancel_futures=True)  # leaving the pool would begin the rest
            raise
    for fault in faults:
        print(fault, file=sys.stderr)
    return 1 if faults else 0
