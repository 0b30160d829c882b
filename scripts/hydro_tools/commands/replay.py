"""Replays trials in plain MuJoCo under a nominal model and under its patch by `hydro gap`.

    python scripts/replay.py --nominal nominal.xml --out out/gap --trials more_logs/ [--seconds 2] [--json]

Each trial (npz of mujoco.sysid) is run open loop from its own initial state; the error of a sensor is the root mean
square difference over the spread of the measurement (NRMSE), pooled over trials; sensor noise is left in. Nothing of
`hydro gap` runs here but the plugin, which is loaded where the patched model asks for it.
"""

import argparse
import json
from pathlib import Path

from hydro_tools.datasets import DataError
from hydro_tools.datasets.trial_replay import compare


def main() -> int:
    """Read the command line, replay, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--nominal", type=Path, required=True, help="the nominal MJCF")
    parser.add_argument("--out", type=Path, required=True, help="what `hydro gap run` wrote")
    parser.add_argument("--trials", type=Path, required=True, help="folder of trials to replay")
    parser.add_argument("--seconds", type=float, default=2.0, help="length of a replay (default 2)")
    parser.add_argument("--json", action="store_true", help="print one JSON value")
    args = parser.parse_args()
    try:
        found = compare(args.nominal, args.out, args.trials, args.seconds)
    except DataError as error:
        raise SystemExit(str(error)) from error
    if args.json:
        print(json.dumps(found))
        return 0
    print(f"{'sensor':<24}{'before':>10}{'after':>10}   NRMSE of {args.seconds:g} s, {found['trials']} trials")
    for name, both in found["sensors"].items():
        print(f"{name:<24}{both['before']:>10.4f}{both['after']:>10.4f}")
    print(f"{'all':<24}{found['before']:>10.4f}{found['after']:>10.4f}   reduction {100 * found['reduction']:.0f} %")
    return 0
