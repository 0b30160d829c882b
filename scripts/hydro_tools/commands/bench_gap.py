"""Time and memory of `hydro gap run` against the number of trials of a case.

    python scripts/gen_hidden.py --out out/full --seed 1 --system vehicle --count 1
    python scripts/bench_gap.py --cases out/full/cases --trials 3 5 10

One row a case and number of trials, the first ones of the case: seconds of the wall clock, of both together of the
processor, of each stage, and the peak memory. The cases are not kept apart from other work: run it on an idle machine.
"""

import argparse
import os
import tempfile
import time
from pathlib import Path

from hydro_mujoco import DataError
from hydro_mujoco.reading import read_json
from hydro_tools.hidden_cases.gap import run
from hydro_tools.repository import ROOT

#: Stages, in their order.
STAGES = ("find", "name", "add", "verify")
#: Seconds that a run may take.
LIMIT = 3600.0


def measured(hydro: Path, case: Path, trials: int) -> str:
    """The table's row of one case with its first trials."""
    described = read_json(case / "case.json")
    files = sorted((case / "trials").iterdir())
    if len(files) < trials:
        raise SystemExit(f"{case}: {len(files)} trials, {trials} are asked for")
    with tempfile.TemporaryDirectory() as scratch:
        part, out = Path(scratch) / case.name, Path(scratch) / "out"
        (part / "trials").mkdir(parents=True)
        for file in [*(entry for entry in case.iterdir() if entry.name != "trials"), *files[:trials]]:
            (part / file.relative_to(case)).symlink_to(file.resolve())
        before, start = os.times(), time.perf_counter()
        fault = run(hydro, part, out, LIMIT, os.cpu_count() or 1)
        wall, after = time.perf_counter() - start, os.times()
        if fault:
            raise SystemExit(f"{trials} trials: {fault}")
        timing = read_json(out / "timing.json")
    processor = sum(after[2:4]) - sum(before[2:4])
    stages = " | ".join(f"{timing['seconds'][stage]:.1f}" for stage in STAGES)
    memory = timing["peak_memory"] / 1e6
    return f"| {described['system']} | {trials} | {wall:.0f} | {processor:.0f} | {stages} | {memory:.0f} |"


def main() -> int:
    """Parse, run one after the other, print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=Path, required=True, help="OUT/cases of gen_hidden.py")
    parser.add_argument("--trials", type=int, nargs="+", default=[3, 5, 10], help="numbers of trials (default 3 5 10)")
    parser.add_argument("--hydro", type=Path, default=ROOT / "target/release/hydro", help="the program")
    args = parser.parse_args()
    cases = [file.parent for file in sorted(args.cases.glob("*/case.json"))]
    if not cases:
        parser.error(f"{args.cases}: no case; make some with scripts/gen_hidden.py")
    print(f"| system | trials | seconds | of the processor | {' | '.join(STAGES)} | peak memory [MB] |")
    print("|---|---|---|---|---|---|---|---|---|")
    for case in cases:
        for trials in args.trials:
            try:
                print(measured(args.hydro, case, trials), flush=True)
            except DataError as error:
                raise SystemExit(f"bench_gap.py: {error}") from error
    return 0
