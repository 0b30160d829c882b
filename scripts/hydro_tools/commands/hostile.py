"""Give hostile and odd inputs to `hydro` and to the plugin, and count what is refused, accepted and broken.

    python scripts/hostile.py --out out/hostile --count 100
    python scripts/hostile.py --out out/hostile --count 100 --kind card --kind npz
    python scripts/hostile.py --out out/hostile --table

Every case is made from --seed, its kind and its number, and runs in a process of its own under a limit of memory and
of processor time; that of a scene is forked from one that has imported MuJoCo and loaded nothing. Refused: a status
other than 0 and a message of at most three lines. Broken: a signal, a panic, a traceback, a long or no message, no end
in time, a SIGINT that takes more than a second. The folder of a broken case stays in OUT/cases with its command. Run
again, it goes on where it was. Exits with 1 where a case is broken.
"""

import argparse
import sys
from pathlib import Path

from hydro_mujoco.recording.progress import Progress
from hydro_tools.hostile import HostileError, bases, campaign
from hydro_tools.hostile.limits import Limits
from hydro_tools.repository import ROOT


def arguments() -> argparse.Namespace:
    """Parse the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of inputs and outcomes")
    parser.add_argument("--count", type=int, default=100, help="cases a kind")
    parser.add_argument("--kind", action="append", choices=sorted(campaign.KINDS), help="only these (default: all)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--build", type=Path, default=ROOT / "target/release", help="folder of hydro and libhydro_plugin.so"
    )
    parser.add_argument("--memory", type=float, default=3.0, help="address space of a case [GB]")
    parser.add_argument("--seconds", type=float, default=20.0, help="processor time of a case [s]")
    parser.add_argument("--jobs", type=int, default=2, help="cases side by side")
    parser.add_argument("--table", action="store_true", help="print the table of the outcomes so far, run nothing")
    return parser.parse_args()


def main() -> int:
    """Run the campaign, print its table; returns the exit status."""
    args = arguments()
    out = args.out.resolve()
    limits = Limits(int(args.memory * 1e9), args.seconds)
    plan = campaign.Plan(args.seed, args.count, tuple(args.kind or campaign.KINDS), limits, args.jobs)
    try:
        if not args.table:
            build = args.build.resolve()
            made = bases.make(out / "bases", build / "hydro", build / "libhydro_plugin.so")
            progress = Progress(len(plan.cases()), "cases")
            for record in campaign.go(made, out, plan):
                progress.advance()
                if record.result == "broken":
                    print(f"broken: {record.kind} {record.number}: {record.why}", flush=True)
    except (HostileError, OSError) as error:
        print(f"hostile.py: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("hostile.py: stopped; run it again to go on", file=sys.stderr)
        return 130
    found = [record for record in campaign.records(out / "outcomes.jsonl") if record.seed == args.seed]
    print(campaign.table(found))
    return int(any(record.result == "broken" for record in found))
