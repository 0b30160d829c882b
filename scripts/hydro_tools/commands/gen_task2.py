"""Make the Task 2 data set: B1 swims freely, its gait, pushes and the water's density keep switching.

    python scripts/gen_task2.py --out data/task2 --trials 1000 --seed 0

Writes `hydro-dataset/1`: shards `{train,val,test}-*.safetensors` and `manifest.json`. A trajectory
has 400 samples at 10 ms (five 2 ms physics steps) and 40 switches of condition; its label is the
water's wrench on the base at the same state as the features, in the base frame about the base
origin [N, N m], clean and with 10 % noise. --regime speeds, densities or gaits draws these from
outside the usual ranges, to test what was trained inside them. The water is strip theory with
added mass and wakes: water that remembers; its shards also hold `generalised` [M,T,18], the water's
force on every degree of freedom (world force, base torque, joint torques), `generalised_hydrostatic`,
the buoyancy in it, and `added_mass` [M,T,6], that part of the wrench. With --added-mass inertia the
label is without that part, and the manifest lists the matrices. --water ellipsoid is MuJoCo's own
fluid, without memory. The same seed gives the same bytes at any number of workers, here or on the
nodes of a Ray cluster (--ray). Needs pip install -e . -e scripts, and scripts[ray] for --ray.
"""

import argparse
import math
import os
import sys
import time
from dataclasses import replace
from pathlib import Path

from hydro_mujoco.jobs import JobError
from hydro_mujoco.jobs.executor import Executor
from hydro_mujoco.jobs.here import Here
from hydro_mujoco.jobs.processes import Processes
from hydro_mujoco.recording import arguments
from hydro_mujoco.recording.dataset import empty_splits
from hydro_mujoco.recording.interrupts import ended
from hydro_tools.datasets import DataError, dataset, plan, regime
from hydro_tools.datasets.waters import ADDED_MASS, IN_INERTIA, IN_LABEL, STRIP, WATERS
from hydro_tools.jobs.cluster import Cluster


def parse() -> argparse.Namespace:
    """The command line, checked."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("data/task2"), help="folder (default: %(default)s)")
    parser.add_argument(
        "--trials", type=arguments.count, default=1000, help="trajectories in all (default: %(default)s)"
    )
    parser.add_argument("--seed", type=arguments.seed, default=0, help="default: %(default)s")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--workers", type=arguments.count, help=f"processes (default: all {os.cpu_count() or 1} cores)")
    where.add_argument(
        "--ray",
        metavar="ADDRESS",
        help="a Ray cluster does it: auto, host:6379, ray://host:10001, or "
        "local for one on this machine; files are written here",
    )
    parser.add_argument(
        "--regime", choices=regime.REGIMES, default=regime.USUAL.name, help="ranges to draw from (default: %(default)s)"
    )
    parser.add_argument(
        "--splits",
        type=arguments.splits,
        help="shares of train,val,test (default: 0.8,0.1,0.1; 0,0,1 outside the usual regime)",
    )
    parser.add_argument(
        "--samples", type=arguments.count, default=400, help="samples a trajectory (default: %(default)s)"
    )
    parser.add_argument(
        "--shard-size", type=arguments.count, default=50, help="trajectories a file (default: %(default)s)"
    )
    parser.add_argument(
        "--water",
        choices=WATERS,
        default=STRIP.name,
        help="truth: strip is strip theory with added mass in the inertia and a wake a strip; ellipsoid is MuJoCo's "
        "own fluid, as identified (default: %(default)s)",
    )
    parser.add_argument(
        "--switch",
        choices=plan.SWITCHING,
        help="what each of the 40 switches changes: the density, and gait and push now and then (mixed; the "
        "ellipsoid's default) or always (all; the strips' default)",
    )
    parser.add_argument(
        "--waterline",
        type=float,
        metavar="Z",
        help="with --water strip: the surface, above the base's start [m] (default: the robot is deep; the features "
        "hold no depth)",
    )
    parser.add_argument(
        "--added-mass",
        choices=ADDED_MASS,
        default=IN_LABEL,
        help="with --water strip: its force is in the label, or it is left to the inertia of the model that a "
        "checkpoint drives, which is stable there (default: %(default)s)",
    )
    parser.add_argument("--model", help="another scene of that water (default: its own)")
    clash = parser.add_mutually_exclusive_group()
    clash.add_argument("--resume", action="store_true", help="finish what a former run left")
    clash.add_argument("--overwrite", action="store_true", help="replace the data set in --out")
    args = parser.parse_args()
    if args.samples < 2:
        parser.error("--samples: a trajectory has at least 2")
    if args.waterline is not None and (args.water != STRIP.name or not math.isfinite(args.waterline)):
        parser.error(f"--waterline {args.waterline}: expected a height [m], with --water {STRIP.name}")
    if args.added_mass == IN_INERTIA and args.water != STRIP.name:
        parser.error(f"--added-mass {args.added_mass}: the water {args.water} has none; expected --water strip")
    if args.added_mass == IN_INERTIA and args.waterline is not None:
        parser.error("--added-mass inertia: it changes at the surface; expected no --waterline")
    args.switch = args.switch or WATERS[args.water].switch
    args.splits = args.splits or ((0.8, 0.1, 0.1) if args.regime == regime.USUAL.name else (0.0, 0.0, 1.0))
    return args


def executor(args: argparse.Namespace) -> Executor:
    """The executor that makes the shards: this process, processes, or a cluster."""
    if args.ray:
        return Cluster(args.ray)
    workers = args.workers or os.cpu_count() or 1
    return Processes(workers) if workers > 1 else Here()


def main() -> int:
    """Run the command line; returns the exit status."""
    args = parse()
    settings = dataset.Settings(
        name=args.out.resolve().name,
        trials=args.trials,
        seed=args.seed,
        samples=args.samples,
        splits=args.splits,
        shard_size=args.shard_size,
        model=args.model or WATERS[args.water].model,
        regime=regime.REGIMES[args.regime],
        water=replace(WATERS[args.water], waterline=args.waterline, added_mass=args.added_mass),
        switch=args.switch,
    )
    if empty := empty_splits(settings.size):
        print(f"gen_task2.py: {empty}", file=sys.stderr)
    start = time.monotonic()
    try:
        with executor(args) as workers:
            manifest = dataset.generate(
                settings, args.out, executor=workers, resume=args.resume, overwrite=args.overwrite
            )
    except (DataError, JobError, OSError) as error:
        print(f"gen_task2.py: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(f"\ngen_task2.py: stopped; finished shards are kept in {args.out}: go on with --resume", file=sys.stderr)
        return ended()
    counts = ", ".join(f"{split} {part['trajectories']}" for split, part in manifest["splits"].items())
    print(
        f"{args.out}: {counts} trajectories of {args.samples} samples in {time.monotonic() - start:.1f} s "
        f"({workers.description})"
    )
    return 0
