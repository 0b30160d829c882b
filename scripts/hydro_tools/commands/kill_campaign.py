"""Kill long commands, fill their disk, start them twice; hold what they leave to an undisturbed run.

    python scripts/kill_campaign.py --out out/kills --kills 100
    python scripts/kill_campaign.py --out out/kills --kills 20 --full 0 --two 0 --job "hydro gap run"

kill: SIGKILL to the command at a random moment of its work, half of them at a change of a file. full: no file grows
beyond a random size (RLIMIT_FSIZE), as on a full disk. two: a second one into the same folder. Then the same command
runs to its end, with --resume where it has that flag. It must say that it goes on, leave no file of another name, and
the bytes of an undisturbed run, but for the times in gap's timing.json and report.html and the command in cards.
Broken cases stay in OUT/cases. Run again, it goes on where it was. Exits with 1 where a case is broken.
"""

import argparse
import sys
from pathlib import Path

from hydro_mujoco.errors import DataError
from hydro_mujoco.recording.lock import locked
from hydro_mujoco.recording.progress import Progress
from hydro_tools.kills import KillsError, campaign, jobs
from hydro_tools.repository import ROOT


def arguments() -> argparse.Namespace:
    """Parse the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of cases and outcomes")
    parser.add_argument("--kills", type=int, default=15, help="of each command (default: %(default)s)")
    parser.add_argument("--full", type=int, default=8, help="full disks of each (default: %(default)s)")
    parser.add_argument("--two", type=int, default=5, help="second ones beside each (default: %(default)s)")
    parser.add_argument("--job", action="append", help="only these (default: all)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--program", type=Path, default=ROOT / "target/release/hydro")
    return parser.parse_args()


def main() -> int:
    """Run the campaign, print its table; returns the exit status."""
    args = arguments()
    out = args.out.resolve()
    try:
        out.mkdir(parents=True, exist_ok=True)
        with locked(out / ".lock"):
            return campaign_in(out, args)
    except (DataError, KillsError, OSError) as error:
        print(f"kill_campaign.py: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("kill_campaign.py: stopped; run it again to go on", file=sys.stderr)
        return 130


def campaign_in(out: Path, args: argparse.Namespace) -> int:
    """Run it in a folder that no other one uses."""
    counts = {"kill": args.kills, "full": args.full, "two": args.two}
    every = jobs.make(out / "inputs", args.program.resolve())
    if unknown := set(args.job or ()) - set(every):
        raise KillsError(f"--job {', '.join(unknown)}: there are {', '.join(every)}")
    chosen = {name: job for name, job in every.items() if name in (args.job or every)}
    progress = Progress(len(chosen) * sum(counts.values()), "cases")
    for record in campaign.go(chosen, out, counts, args.seed):
        progress.advance()
        if record.broken:
            print(f"broken: {record.job}, {record.trouble} {record.number}: {record.broken}", flush=True)
    found = [record for record in campaign.records(out / "outcomes.jsonl") if record.seed == args.seed]
    print(campaign.table(found))
    return int(any(record.broken for record in found))
