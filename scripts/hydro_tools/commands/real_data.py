"""Real measurements for `hydro gap`: trial files from the csv files, the runs, and a check by SciPy.

    python scripts/real_data.py --out out/real                    # OUT/<case>/{nominal.xml,trials/*.npz}
    python scripts/real_data.py --out out/real --check            # and what SciPy alone finds in them
    python scripts/real_data.py --out out/real --run              # and what `hydro gap run` says of them

Cases: roll_decay (a single release: missing is quadratic damping), ball_<name>, two drops each (missing is
the air's drag), captive_kvlcc2 (a table of steady states: missing is all that water does), glider (18 dives,
pitch prescribed: missing is lift), crazyflie_normal (six hops of a nano quadrotor: nothing is missing, though its
thrust differs by 2 % from flight to flight) and crazyflie_weight (four hops: missing is a weight of 2.2 to 3.0 g
near motor 3). The first states are estimated from the first readings (hydro_tools/datasets/measured/).
Needs numpy and, for --check, scipy; --run needs `cargo build --release` and the MuJoCo of .venv.
"""

import argparse
import json
import sys
from pathlib import Path

from hydro_tools.datasets.measured import MeasuredError
from hydro_tools.datasets.measured.case import CASES, make_case
from hydro_tools.datasets.measured.gap import run_gap, table
from hydro_tools.datasets.measured.scipy_fits import check
from hydro_tools.repository import ROOT


def parse() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--data",
        type=Path,
        default=ROOT.parent / "shared" / "data",
        help="folder of the csv files (default: ../shared/data)",
    )
    parser.add_argument("--out", type=Path, required=True, help="folder to write the cases to")
    parser.add_argument("--case", choices=CASES, action="append", help="only this one; may be given again")
    parser.add_argument("--with-speed", action="store_true", help="keep the balls' differentiated speed as a sensor")
    parser.add_argument("--check", action="store_true", help="fit by SciPy too; writes OUT/reference.json")
    parser.add_argument("--run", action="store_true", help="run `hydro gap` on each case; writes OUT/<case>/gap")
    parser.add_argument(
        "--hydro",
        type=Path,
        default=ROOT / "target" / "release" / "hydro",
        help="the program (default: target/release/hydro)",
    )
    parser.add_argument(
        "--gap-option",
        action="append",
        default=[],
        metavar="WORD",
        help="a word passed on to `hydro gap run`, such as --gap-option=--seed --gap-option=1",
    )
    return parser.parse_args()


def main() -> int:
    """Run the command line; returns the exit status."""
    args = parse()
    try:
        cases = {}
        for case in args.case or CASES:
            cases[case] = make_case(case, args.data, args.out, args.with_speed)
            for trial in cases[case]:
                print(f"{case}/{trial.name}: {trial.summary()}")
        if args.check:
            (args.out / "reference.json").write_text(json.dumps(check(cases), indent=1))
        if args.run:
            print(table({case: run_gap(args.hydro, args.out / case, args.gap_option) for case in cases}))
    except (MeasuredError, OSError) as error:
        print(f"real_data.py: {error}", file=sys.stderr)
        return 1
    return 0
