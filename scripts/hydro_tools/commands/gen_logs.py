"""Logs of simple marine experiments, whose truth is SciPy's, as inputs of `hydro gap`.

    python scripts/gen_logs.py --out out/logs [--experiment heave] [--seed 0]
    hydro gap run --model out/logs/heave/nominal.xml --trials out/logs/heave/trials --out out/heave --medium water

Writes OUT/<experiment>/{nominal.xml,trials/*.csv,truth.json}. The nominals know nothing of water; truth.json says what
they lack.
"""

import argparse
from pathlib import Path

from ..simple_logs.experiments import EXPERIMENTS


def main() -> int:
    """Run the command line; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder to write the experiments to")
    parser.add_argument("--experiment", choices=EXPERIMENTS, action="append", help="only this one; may be given again")
    parser.add_argument("--seed", type=int, default=0, help="of commands and noise (default: 0)")
    options = parser.parse_args()
    for name in options.experiment or EXPERIMENTS:
        EXPERIMENTS[name].write(options.out / name, options.seed)
        print(options.out / name)
    return 0
