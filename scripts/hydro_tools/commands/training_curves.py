"""Validation curves of `hydro train`: how far each training went, and whether it was flat at the end.

    python scripts/training_curves.py out/ours.run out/lstm.run --out models/strip/curves

Reads RUN/log.jsonl, the log that `hydro train --out NAME` keeps in NAME.run. Writes OUT.csv (run, epoch, step,
learning_rate, loss, validation, validation_hydrodynamic; a row a pass over the training split) and OUT.svg, and prints
a Markdown table. The validation error is the pooled nRMSE on the validation split, open loop. Gained: by how much the
last quarter of the passes lowered the least error before it, in per cent; near zero is flat. The learning rate of a
finished training falls to a hundredth, so a curve also flattens because its steps shrink: only a longer training tells.

Needs matplotlib: pip install -e . -e 'scripts[tank]'.
"""

import argparse
import sys
from pathlib import Path

from hydro_mujoco.errors import DataError
from hydro_tools.learning_curves.curve import Curve, read
from hydro_tools.learning_curves.files import draw, write_csv


def parse() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "runs",
        nargs="+",
        type=Path,
        metavar="RUN",
        help="folder that holds log.jsonl; of hydro compare: jobs/SET/ROW/seed-N/run",
    )
    parser.add_argument("--out", type=Path, required=True, help="OUT.csv and OUT.svg are written")
    return parser.parse_args()


def table(curves: list[Curve]) -> str:
    """Markdown: passes, best validation error, and what the last quarter gained."""
    head = "| training | passes | best validation nRMSE | gained in the last quarter |\n|---|---:|---:|---:|"
    rows = [f"| {it.name} | {len(it.validation)} | {it.best:.4f} | {100 * it.gained:.1f} % |" for it in curves]
    return "\n".join([head, *rows])


def main() -> int:
    """Run the command line; returns the exit status."""
    args = parse()
    try:
        curves = [read(run) for run in args.runs]
        names = [curve.name for curve in curves]
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise DataError(f"{', '.join(twice)}: given twice; expected runs of different names")
        write_csv(curves, args.out.with_name(args.out.name + ".csv"))
        draw(curves, args.out.with_name(args.out.name + ".svg"))
    except (DataError, OSError) as error:
        print(f"training_curves.py: {error}", file=sys.stderr)
        return 1
    print(table(curves))
    return 0
