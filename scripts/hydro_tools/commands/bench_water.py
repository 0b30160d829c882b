"""Costs of water without a network: microseconds a step of each effect, hull and sea.

    python scripts/bench_water.py [--rounds 25]

One free body, implicitfast, 5 ms. A row is three scenes that are timed in turn, rounds times: without the plugin,
with the plugin but without what the row is about, with it. `alone` is the difference of the last two: from a plugin
that applies one constant force, or, of currents and waves, from the boat in still water. Printed are medians of
processor time (quartiles in parentheses), then 64 boats in `mujoco.batch`, on one thread and on two.
The library: HYDRO_PLUGIN, else target/release.
"""

import argparse
import os
from pathlib import Path

from hydro_mujoco.plugin import LIBRARY as CHOSEN
from hydro_mujoco.plugin import load_plugin

from ..benchmarks import LIBRARY
from ..benchmarks.machine import Others
from ..water_costs.batch import boats
from ..water_costs.rows import rows
from ..water_costs.timing import measure, table


def main() -> int:
    """Run the command line; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=25, help="default: %(default)s")
    args = parser.parse_args()
    load_plugin(Path(os.environ.get(CHOSEN, LIBRARY)))
    others = Others()
    print(table(measure(rows(), args.rounds)))
    print(boats(args.rounds))
    print(f"other programs took {100 * others.share():.0f} % of the machine's {os.cpu_count()} cores")
    return 0
