"""Write B1's URDF and its MuJoCo scenes from the one table in `hydro_tools/robot/table.py`.

The fluid coefficients of `b1_truth.xml` are those in `hydro_tools/robot/identified.json`.

    python scripts/make_b1.py              # writes models/robots/b1.urdf and mjcf/b1*.xml
    python scripts/make_b1.py --check      # exits 1 if a committed file differs from the table
"""

import argparse
import os
import sys
from pathlib import Path

from hydro_tools.repository import ROOT
from hydro_tools.robot.files import files
from hydro_tools.robot.hull import DISPLACED_LITRES, DISPLACED_LITRES_RANGE


def main() -> int:
    """Run the command line; returns the exit status."""
    low, high = DISPLACED_LITRES_RANGE
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="compare with the files on disk, write nothing")
    parser.add_argument(
        "--displaced-volume",
        type=float,
        default=DISPLACED_LITRES,
        metavar="L",
        help=f"water that B1 displaces, {low:g} to {high:g} litres (default: %(default)g)",
    )
    parser.add_argument("--root", type=Path, default=ROOT, help="folder to write below (default: the repository)")
    args = parser.parse_args()
    try:
        wanted = files(args.displaced_volume)
    except ValueError as error:
        print(f"make_b1.py: {error}", file=sys.stderr)
        return 2
    stale = 0
    for name, content in wanted.items():
        path = args.root / name
        if args.check:
            found = path.read_text(encoding="utf-8") if path.is_file() else None
            if found != content:
                stale += 1
                print(
                    f"make_b1.py: {name} is {'missing' if found is None else 'not what the table gives'}: "
                    "run python scripts/make_b1.py",
                    file=sys.stderr,
                )
            continue
        path.parent.mkdir(parents=True, exist_ok=True)
        beside = path.with_name(path.name + ".tmp")
        beside.write_text(content, encoding="utf-8")
        os.replace(beside, path)
        print(f"wrote {name}")
    return 1 if stale else 0
