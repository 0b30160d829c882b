"""Search the learning rate of each row of `hydro compare` by validation, on the data and budget of its tables.

    python scripts/learning_rates.py task1 --data out/compare/task1-data --out out/rates-task1
    python scripts/learning_rates.py task2 --data out/compare/task2 --out out/rates-task2 --rows lstm,mlp

From a first rate (--first), the rate is doubled or halved for as long as that lowers the validation error (nRMSE, open
loop) of seed 0 by more than one per cent. The rates on either side of the best one are then no better, or diverged. The
two best rates are tried with seed 1 as well; the row gets the one with the lower geometric mean of both. The test split
is not used. Rates of 1.2 serve 1.3, which is 1.2 with noise. Rows of the Runge-Kutta and the adaptive solver cost too
much to be searched; they have the rate of the Euler row, or the next lower one at which they do not diverge.

A finished training is not repeated: --out holds RATE/jobs/SET/ROW/seed-N, as `hydro compare --out RATE
--learning-rate RATE` leaves them. The Markdown tables go to standard output; the row's rate is in bold.
"""

import argparse
import os
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from hydro_tools.learning_rates import TrainingError
from hydro_tools.learning_rates.search import search
from hydro_tools.learning_rates.table import table
from hydro_tools.learning_rates.trainings import Trainings

#: Data sets of a task that are searched.
SETS = {"task1": ("1.1", "1.2"), "task2": ("2",)}
#: Rows that are searched, those that take long first.
ROWS = (
    "lstm-informed",
    "lstm",
    "cnode-informed",
    "cnode-hermite-euler",
    "attention-ode-informed",
    "attention-ode-euler",
    "mlp-ode-informed",
    "mlp-ode-euler",
    "mlp",
    "mlp-informed",
    "relaxation-ode",
    "relaxation-ode-modes",
    "relaxation-ode-raw",
)


def parse() -> argparse.Namespace:
    """The command line, checked."""
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
    """Run the command line; returns the exit status."""
    args = parse()
    trainings = Trainings(args.hydro.resolve(), args.task, args.data, args.out)
    rows = args.rows.split(",") if args.rows else list(ROWS)
    if unknown := set(rows) - set(known := trainings.rows()):
        print(
            f"learning_rates.py: --rows: unknown {', '.join(sorted(unknown))}; there are {', '.join(known)}",
            file=sys.stderr,
        )
        return 2
    chosen: dict[str, dict[str, float]] = {data: {} for data in SETS[args.task]}
    failed = []
    # Ctrl-C reaches the trainings too, which save what they have.
    pool = ThreadPoolExecutor(max(1, args.parallel))
    try:
        searches = {
            (data, row): pool.submit(
                search, lambda rate, seed, at=(data, row): trainings.error(*at, rate, seed), args.first
            )
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
