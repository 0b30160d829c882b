"""Results of `scripts/strip_models.sh` as Markdown: open loop beside what was not learned, closed loop, ten minutes.

    python scripts/strip_table.py out/strip/jobs

JOBS holds ROW/seed-N/open.json (`hydro evaluate --json`) and closed.json (`hydro simulate --long --json`). ± is the
standard deviation over seeds; of ten minutes the worst seed is shown. --over ROW: that row's errors over every other's.
"""

import argparse
import sys
from pathlib import Path

from hydro_mujoco.errors import DataError
from hydro_tools.strip_models.results import read
from hydro_tools.strip_models.table import ratios, table


def main() -> int:
    """Run the command line; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("jobs", type=Path, metavar="JOBS")
    parser.add_argument("--over", metavar="ROW", help="a row whose ratio to each of the others is told too")
    args = parser.parse_args()
    try:
        places = sorted(path.parent for path in args.jobs.glob("*/seed-*/open.json"))
        if not places:
            raise DataError(f"{args.jobs}: no ROW/seed-N/open.json; scripts/strip_models.sh makes them")
        found = [read(place) for place in places]
        results = [result for result, _ in found]
        rows = sorted({result.row for result in results})
        if args.over and args.over not in rows:
            raise DataError(f"--over {args.over}: no such row in {args.jobs}; there are {', '.join(rows)}")
    except (DataError, OSError) as error:
        print(f"strip_table.py: {error}", file=sys.stderr)
        return 1
    print(table(results, found[0][1]), end="")
    if args.over:
        print()
        print(ratios(results, args.over), end="")
    return 0
