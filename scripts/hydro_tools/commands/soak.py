"""Every released checkpoint and every effect, alone and in pairs, for long.

    python scripts/soak.py --seconds 600
    python scripts/soak.py --quick
    python scripts/soak.py --alone --integrator implicitfast --steps 300000    # ten minutes, and 5 and 3.3 after resets
    python scripts/soak.py --threads 64 --seconds 60

At rest and in violent motion, under every integrator, with contacts, a tree that falls asleep and resets in mid-run.
Numbers stay finite, MuJoCo does not diverge, nothing warns, a reset gives the same run bit for bit, and memory is flat.
Water that only takes energy (drag, friction, added mass, springs) leaves no more than there was, within 1 %, in a scene
without gravity, contacts and commands; what the integrator adds by itself is measured without water. Prints a table;
exits with 1 where a case is broken. With --threads, models are created, stepped and freed by that many threads at once,
then stepped by mujoco.batch and mujoco.rollout on as many; each run must be that of one thread alone, bit for bit.
"""

import argparse
import math
import sys
import time
from array import array
from collections import defaultdict

from hydro_mujoco.errors import DataError
from hydro_mujoco.plugin import load_plugin
from hydro_mujoco.recording.progress import Progress
from hydro_tools.soak import SoakError, campaign, catalogue, threads
from hydro_tools.soak.scenes import INTEGRATORS

#: Memory that the second half of a soak may add [MB]. Compiling a B1 without the plugin moves it by more than 20.
FLAT = 8.0
#: Cases of --quick: the single ones.
QUICK = 300


def arguments() -> argparse.Namespace:
    """Parse the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=600.0, help="time that it takes (default: %(default)s)")
    parser.add_argument("--steps", type=int, default=1500, help="of a run of 2 ms each (default: %(default)s)")
    parser.add_argument("--strength", type=float, default=1.0, help="of effects, in prior deviations (default: 1)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--alone", action="store_true", help="each checkpoint and effect by itself, once, no pairs")
    parser.add_argument("--integrator", choices=INTEGRATORS, help="with --alone: this one only")
    parser.add_argument("--quick", action="store_true", help="a part of the single ones, 75 steps each, for tests")
    parser.add_argument("--threads", type=int, default=0, help="instead: this many threads at once")
    args = parser.parse_args()
    if args.integrator and not args.alone:
        parser.error("--integrator goes with --alone")
    return args


def main() -> int:
    """Soak, print the table; returns the exit status."""
    args = arguments()
    try:
        return _soak(args)
    except (DataError, SoakError) as error:
        print(f"soak.py: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("soak.py: stopped", file=sys.stderr)
        return 130


def _soak(args: argparse.Namespace) -> int:
    load_plugin()
    effects = catalogue.effects(args.strength)
    if args.threads:
        return _threads(effects, args.threads, args.seconds)
    steps, most = (75, QUICK) if args.quick else (args.steps, None)
    if args.alone:
        listed = campaign.alone(effects, args.seed)
        listed = [(kind, case) for kind, case in listed if args.integrator in (None, case.integrator)]
        records, most = campaign.go(listed, steps), len(listed)
    else:
        records = campaign.go(campaign.endless(effects, args.seed), steps, seconds=args.seconds, most=most)
    progress = Progress(most or math.ceil(args.seconds), "cases" if most else "seconds")
    begin = time.monotonic()
    # Of the cases only what is printed is kept: the memory that is watched is that of the runs.
    tallies: defaultdict[tuple[str, str], campaign.Tally] = defaultdict(campaign.Tally)
    memory = array("d")
    try:
        for record in records:
            tallies[record.kind, record.case.integrator].add(record.outcome)
            memory.append(record.memory)
            progress.advance(1 if most else int(time.monotonic() - begin) - progress.done)
            if record.outcome.broken:
                print(f"broken: {record.case.name()}: {record.outcome.broken}", flush=True)
    except KeyboardInterrupt:
        print("soak.py: stopped; so far:", file=sys.stderr)
    print(campaign.table(tallies))
    grown = campaign.growth(memory)
    if memory:
        print(
            f"memory: {memory[0]:.0f} MB after the first case, {memory[-1]:.0f} MB after the last, {grown:+.2f} MB late"
        )
    if grown > FLAT:
        print(f"broken: memory grows by {grown:.1f} MB over the second half; expected {FLAT} at most")
    return int(any(tally.broken for tally in tallies.values()) or grown > FLAT)


def _threads(effects: list[catalogue.Effect], count: int, seconds: float) -> int:
    found = threads.stress(effects, count, seconds)
    print(f"{count} threads: {found.models:,} models made and freed, {found.runs:,} runs, {found.broken} that differ")
    return int(found.broken > 0)
