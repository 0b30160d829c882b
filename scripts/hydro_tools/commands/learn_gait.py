r"""Learn a gait of B1 by CMA-ES on a pattern generator with feedback of attitude and depth, and swim it again.

    python scripts/learn_gait.py learn --water learned --seed 0 --out out/gaits/learned-0
    python scripts/learn_gait.py replay out/gaits/learned-0/gait.json --water truth --seconds 30
    python scripts/learn_gait.py table out/gaits/*/gait.json --out out/gaits/table.json

`learn` writes gait.json (`hydro-gait/1`) and, as it goes, state.json; cut off, the same command goes on and ends with
the same bytes. Waters: learned (the plugin with models/b1-relaxation), drag (fitted to Task 2), box (MuJoCo's inertia
box), truth (MuJoCo's ellipsoid fluid), which those three stand for; strip-learned (models/b1-strip, joint torques too),
strip-wrench (the same without them), strip (strip theory, in NumPy: ten times slower). `replay` prints means over the
starts: speed along the first heading, drift of depth and heading, greatest tilt, cost of transport. `table` replays
every gait in the truth and in strip theory, and prints those of docs/gaits.md. A film: scripts/film.py --gait. Needs
cma (pip install -e . -e scripts[gaits]).
"""

import argparse
import json
import os
import sys
from pathlib import Path

from hydro_mujoco.recording.files import write_json
from hydro_tools.datasets import DataError
from hydro_tools.gaits import gait_file, replay, table, waters


def parse() -> argparse.Namespace:
    """The command line, checked."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    learn = commands.add_parser("learn", help="learn a gait")
    learn.add_argument("--water", required=True, choices=tuple(waters.WATERS))
    learn.add_argument("--seed", type=int, default=0, help="default: %(default)s")
    learn.add_argument("--out", type=Path, required=True, help="folder of gait.json and state.json")
    learn.add_argument("--generations", type=int, default=60, help="default: %(default)s")
    learn.add_argument("--population", type=int, default=20, help="default: %(default)s")
    learn.add_argument("--seconds", type=float, default=12.0, help="of an episode (default: %(default)s)")
    again = commands.add_parser("replay", help="swim a gait again")
    again.add_argument("gait", type=Path)
    again.add_argument("--water", default="truth", choices=tuple(waters.WATERS), help="default: %(default)s")
    again.add_argument("--json", action="store_true", help="print one JSON value")
    rows = commands.add_parser("table", help="every gait in the truth and in strip theory")
    rows.add_argument("gait", type=Path, nargs="+")
    rows.add_argument("--out", type=Path, help="write the numbers as JSON")
    for command in (again, rows):
        command.add_argument("--seconds", type=float, default=30.0, help="default: %(default)s")
        command.add_argument("--starts", type=int, default=4, help="default: %(default)s")
    for command in (learn, again, rows):
        command.add_argument("--threads", type=int, default=len(os.sched_getaffinity(0)), help="default: %(default)s")
    args = parser.parse_args()
    least = {"seed": 0, "generations": 1, "population": 4, "seconds": 1, "starts": 1, "threads": 1}
    for name, bound in least.items():
        if not getattr(args, name, bound) >= bound:
            parser.error(f"--{name} {getattr(args, name)}: expected {bound} or more")
    return args


def learn(args: argparse.Namespace) -> None:
    """Learn, write, say how it went."""
    try:
        from hydro_tools.gaits import learning
    except ImportError as error:
        raise DataError(f"{error}; pip install -e . -e scripts[gaits]") from error
    plan = learning.Plan(args.water, args.seed, args.generations, args.population, args.seconds)
    gait = learning.learn(plan, waters.water(args.water), args.out, args.threads)
    gait_file.write(args.out / "gait.json", gait)
    print(f"{args.out / 'gait.json'}: {gait.score:.3f} m/s after {gait.episodes} episodes of {gait.seconds:g} s")


def swim(args: argparse.Namespace) -> None:
    """Swim one gait again."""
    water = waters.water(args.water)
    gait = gait_file.read(args.gait, water.model())
    track = replay.replay(gait, water, seconds=args.seconds, starts=args.starts, threads=args.threads)
    found = replay.summary(track)
    if args.json:
        print(json.dumps({"gait": str(args.gait), "water": args.water, "seconds": args.seconds} | found))
        return
    print(f"{args.gait}, learnt in {gait.water}, {args.seconds:g} s in {water.name} from {args.starts} starts:")
    print("\n".join(table.lines(found)))


def tabulate(args: argparse.Namespace) -> None:
    """Every gait in the waters of the table."""
    rows = table.rows(args.gait, seconds=args.seconds, starts=args.starts, threads=args.threads)
    if args.out:
        write_json(args.out, rows)
    print("\n".join(table.markdown(rows)))


def main() -> int:
    """Run the command line; returns the exit status."""
    args = parse()
    try:
        {"learn": learn, "replay": swim, "table": tabulate}[args.command](args)
    except (DataError, OSError) as error:
        print(f"learn_gait.py: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("learn_gait.py: interrupted; the same command goes on", file=sys.stderr)
        return 130
    return 0
