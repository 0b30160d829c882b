"""Record truth rollouts of B1 (`hydro-rollouts/1`): one density a run, never part of Task 2.

    python scripts/record_rollouts.py --out out/rollouts --count 20 --duration 4 --seed 0
    python scripts/record_rollouts.py --out out/long --count 1 --minutes 10 --seed 1
    python scripts/record_rollouts.py --out out/strip --water strip --added-mass inertia

The closed loop is compared on them: same start, same controls and pushes, the water exchanged.
Needs mujoco and numpy (pip install -e . -e scripts).
"""

import argparse
import shlex
import sys
from dataclasses import replace
from pathlib import Path

from hydro_mujoco.recording.folder import LOCK
from hydro_mujoco.recording.interrupts import ended
from hydro_mujoco.recording.lock import locked
from hydro_mujoco.recording.progress import Progress
from hydro_tools.datasets import DataError, plan, rollouts, scene
from hydro_tools.datasets.waters import ADDED_MASS, ELLIPSOID, IN_INERTIA, IN_LABEL, STRIP, WATERS


def _range(text: str) -> tuple[float, float]:
    try:
        low, high = (float(part) for part in text.split(","))
    except ValueError:
        low, high = 0.0, -1.0
    if not 0 < low <= high:
        raise argparse.ArgumentTypeError(f"`{text}`: expected LOW,HIGH in kg/m^3, such as 990,1030")
    return low, high


def _portable(out: Path) -> str:
    """The folder as it can be repeated elsewhere: absolute paths are cut to the last part."""
    return out.name if out.is_absolute() else out.as_posix()


def parse() -> argparse.Namespace:
    """The command line, checked."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder to write")
    parser.add_argument("--count", type=int, default=10, help="runs (default: %(default)s)")
    length = parser.add_mutually_exclusive_group()
    length.add_argument("--duration", type=float, default=4.0, metavar="S", help="seconds a run (default: %(default)s)")
    length.add_argument("--minutes", type=float, help="minutes a run, instead of --duration")
    parser.add_argument("--seed", type=int, default=0, help="default: %(default)s")
    parser.add_argument(
        "--density-range",
        type=_range,
        default=plan.DENSITY_RANGE,
        metavar="LOW,HIGH",
        help="kg/m^3 (default: 990,1030)",
    )
    parser.add_argument(
        "--water",
        choices=WATERS,
        default=ELLIPSOID.name,
        help="truth, as in gen_task2.py, whose default is strip (here: %(default)s)",
    )
    parser.add_argument(
        "--added-mass",
        choices=ADDED_MASS,
        default=IN_LABEL,
        help="with --water strip, as in gen_task2.py (default: %(default)s)",
    )
    parser.add_argument("--model", help="another scene of that water (default: its own)")
    parser.add_argument("--overwrite", action="store_true", help="replace the rollouts in --out")
    args = parser.parse_args()
    if args.minutes is not None:
        args.duration = 60.0 * args.minutes
    if args.count < 1:
        parser.error(f"--count {args.count}: expected 1 or more")
    if not args.duration >= scene.SAMPLE_PERIOD:
        parser.error(f"--duration {args.duration}: expected at least a sample period, {scene.SAMPLE_PERIOD} s")
    if args.seed < 0:
        parser.error(f"--seed {args.seed}: expected 0 or more")
    if args.added_mass == IN_INERTIA and args.water != STRIP.name:
        parser.error(f"--added-mass {args.added_mass}: the water {args.water} has none; expected --water strip")
    args.model = args.model or WATERS[args.water].model
    return args


def run(args: argparse.Namespace) -> None:
    """Record the folder, unless another process is at it."""
    loaded = scene.load(args.model)
    if args.out.exists() and not args.out.is_dir():
        raise DataError(f"{args.out} is a file: choose a folder for --out")
    args.out.mkdir(parents=True, exist_ok=True)
    with locked(args.out / LOCK):
        _record(args, loaded)


def _record(args: argparse.Namespace, loaded: scene.Scene) -> None:
    """Remove what an earlier run left, record, and write the index last."""
    water = replace(WATERS[args.water], added_mass=args.added_mass)
    held = sorted(path.name for path in args.out.iterdir() if path.name != LOCK)
    if held and not args.overwrite:
        raise DataError(
            f"{args.out} is not empty ({held[0]}, ...): pass --overwrite to replace its rollouts, or choose "
            "another --out"
        )
    for path in (args.out / rollouts.INDEX, *args.out.glob("rollout-*.npz"), *args.out.glob("*.tmp")):
        path.unlink(missing_ok=True)
    progress, entries = Progress(args.count, "rollouts"), []
    for index in range(args.count):
        arrays = rollouts.record(
            loaded, args.seed, index, duration=args.duration, density_range=args.density_range, water=water
        )
        entries.append(rollouts.write_run(args.out, index, arrays))
        progress.advance()
    low, high = args.density_range
    command = (
        f"python scripts/record_rollouts.py --out {shlex.quote(_portable(args.out))} --count {args.count} "
        f"--duration {args.duration:g} --seed {args.seed} --density-range {low:g},{high:g} "
        f"--model {shlex.quote(args.model)}"
    )
    if args.water != ELLIPSOID.name:
        command += f" --water {args.water} --added-mass {args.added_mass}"
    rollouts.write_index(args.out, loaded, args.seed, command, entries, water)


def main() -> int:
    """Run the command line; returns the exit status."""
    args = parse()
    try:
        run(args)
    except (DataError, OSError) as error:
        print(f"record_rollouts.py: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("\nrecord_rollouts.py: stopped; without its rollouts.json the folder is unfinished", file=sys.stderr)
        return ended()
    print(f"{args.out}: {args.count} rollouts of {args.duration:g} s")
    return 0
