#!/usr/bin/env python3
"""What learning rate each row of `hydro compare` is given: by validation, on the data and under the budget of its tables.

    python scripts/learning_rates.py task1 --data out/compare/task1-data --out out/rates-task1
    python scripts/learning_rates.py task2 --data out/compare/task2 --out out/rates-task2 --rows lstm,mlp

From a first rate (--first), the rate is doubled or halved for as long as that lowers the validation error (nRMSE, open loop) of
seed 0 by more than one per cent: on either side of the least there is one that is no better, or one that diverged. The
two best rates are then tried with seed 1 as well, and the one with the lower geometric mean of both is the row's. The test
split has no say. Rates of 1.2 serve 1.3, which is 1.2 with noise. Rows of the Runge-Kutta and the adaptive solver
are too dear to be searched and have the rate of the Euler row, or the next lower one at which they do not diverge.

What was trained before is not trained again: --out holds RATE/jobs/SET/ROW/seed-N, as `hydro compare --out RATE --learning-rate RATE`
would leave them. The Markdown tables go to standard output; the row's rate is in bold.
"""

import argparse
import json
import math
import os
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

#: Data sets of a task that are searched.
SETS = {"task1": ("1.1", "1.2"), "task2": ("2",)}
#: Rows that are searched, those that take long first.
ROWS = ("lstm-informed", "lstm", "cnode-informed", "cnode-hermite-euler", "attention-ode-informed", "attention-ode-euler",
        "mlp-ode-informed", "mlp-ode-euler", "mlp", "mlp-informed", "relaxation-ode", "relaxation-ode-modes",
        "relaxation-ode-raw")
#: A step that lowers the error by less is no gain.
GAIN = 0.01
#: What `hydro` says of a training that diverged (Diverged in src/training/mod.rs).
DIVERGED = "the loss is"


class TrainingError(Exception):
    """A training that failed, and not by diverging."""


def search(error: Callable[[float, int], float], first: float) -> float:
    """The rate of least error: `error(rate, seed)` is infinite where a training diverged.

    Errors fall and then rise with the rate, or the search ends in the dip that is nearest to the first one.
    """
    known = {first: error(first, 0)}
    at = first
    for factor in (2.0, 0.5):
        while (rate := at * factor) not in known:
            known[rate] = error(rate, 0)
            # Where everything diverges there is no gain in going up.
            if not known[rate] < known[at] * (1 - GAIN) and not (factor < 1 and math.isinf(known[at])):
                break
            at = rate
            if at < 1e-6:
                raise TrainingError("diverged at every rate")
    best = sorted((rate for rate in known if math.isfinite(known[rate])), key=known.__getitem__)[:2]
    return min(best, key=lambda rate: known[rate] * error(rate, 1))


class Trainings:
    """Trainings by `hydro compare`, each kept below `folder`."""

    def __init__(self, hydro: Path, task: str, data: Path, folder: Path):
        self.hydro, self.task, self.data, self.folder = hydro, task, data, folder
        self.found: dict[tuple[str, str, float, int], float] = {}
        self.lock = threading.Lock()

    def rows(self) -> list[str]:
        """All rows that the program knows."""
        words = [*self.command(self.folder / "none"), "--seeds", "0", "--list", "--json"]
        listed = subprocess.run(words, stdout=subprocess.PIPE, check=False)
        if listed.returncode:
            sys.exit(listed.returncode)
        return sorted({job["job"].split("/")[1] for job in json.loads(listed.stdout)})

    def command(self, out: Path) -> list[str]:
        return [str(self.hydro), "compare", self.task, "--data", str(self.data), "--out", str(out)]

    def error(self, data: str, row: str, rate: float, seed: int) -> float:
        """Least validation error of one training [nRMSE]."""
        key = (data, row, rate, seed)
        if key in self.found:
            return self.found[key]
        job, out = f"{data}/{row}/seed-{seed}", self.folder / f"{rate:g}"
        words = [*self.command(out), "--learning-rate", f"{rate:g}", "--seeds", str(seed), "--only", job]
        done = subprocess.run(words, env={**os.environ, "RAYON_NUM_THREADS": "1"}, stdout=subprocess.DEVNULL,
                              stderr=subprocess.PIPE, text=True, check=False)
        if done.returncode == 0:
            note = json.loads((out / "jobs" / job / "result.json").read_text())["training"]
            error = note["validation"] if note["validation"] is not None else math.inf
        elif DIVERGED in done.stderr:
            error = math.inf
        else:
            raise TrainingError(f"{job} at {rate:g}: {done.stderr.strip().rpartition(chr(10))[2]}")
        with self.lock:
            self.found[key] = error
            print(f"{job} at {rate:g}: {error:.4f}", file=sys.stderr, flush=True)
        return error


def table(data: str, chosen: dict[str, float], found: dict[tuple[str, str, float, int], float]) -> str:
    """Errors of one data set, seed 0 and, where it was tried, seed 1."""
    known = {key: error for key, error in found.items() if key[0] == data}
    rates = sorted({rate for _, _, rate, _ in known})
    lines = [f"On {data}:", "", "| | " + " | ".join(f"{rate:g}" for rate in rates) + " |", "|---|" + "---|" * len(rates)]
    for row, own in chosen.items():
        cells = []
        for rate in rates:
            errors = [known[data, row, rate, seed] for seed in (0, 1) if (data, row, rate, seed) in known]
            words = ", ".join(f"{error:.3f}" if math.isfinite(error) else "diverged" for error in errors)
            cells.append(f"**{words}**" if rate == own else words)
        lines.append(f"| {row} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("task", choices=sorted(SETS))
    parser.add_argument("--data", type=Path, required=True, help="as of hydro compare")
    parser.add_argument("--out", type=Path, required=True, help="folder of the trainings")
    parser.add_argument("--rows", help=f"these alone, as lstm,mlp; default: {','.join(ROWS)}")
    parser.add_argument("--first", type=float, default=0.002, help="default: %(default)s")
    parser.add_argument("--parallel", type=int, default=os.cpu_count() or 1, help="default: %(default)s")
    parser.add_argument("--hydro", type=Path, default=Path("target/release/hydro"), help="default: %(default)s")
    args = parser.parse_args()
    if not args.hydro.is_file():
        parser.error(f"--hydro {args.hydro}: no such program; cargo build --release makes it")
    if not 0 < args.first <= 1:
        parser.error(f"--first {args.first}: expected above 0 and at most 1")
    return args


def main() -> int:
    args = parse()
    trainings = Trainings(args.hydro.resolve(), args.task, args.data, args.out)
    rows = args.rows.split(",") if args.rows else list(ROWS)
    if unknown := set(rows) - set(known := trainings.rows()):
        print(f"learning_rates.py: --rows: unknown {', '.join(sorted(unknown))}; there are {', '.join(known)}", file=sys.stderr)
        return 2
    chosen: dict[str, dict[str, float]] = {data: {} for data in SETS[args.task]}
    failed = []
    # Ctrl-C reaches the trainings too, which save what they have.
    pool = ThreadPoolExecutor(max(1, args.parallel))
    try:
        searches = {
            (data, row): pool.submit(search, lambda rate, seed, at=(data, row): trainings.error(*at, rate, seed), args.first)
            for row in rows
            for data in SETS[args.task]
        }
        for (data, row), found in searches.items():
            try:
                chosen[data][row] = found.result()
            except TrainingError as error:
                failed.append(str(error))
    except KeyboardInterrupt:
        print("learning_rates.py: stopped; the same command goes on", file=sys.stderr)
        return 130
    finally:
        pool.shutdown(cancel_futures=True)
    for data, own in chosen.items():
        print(table(data, own, trainings.found))
    for words in failed:
        print(f"learning_rates.py: {words}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
