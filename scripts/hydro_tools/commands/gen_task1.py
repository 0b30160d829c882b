"""Make the Task 1 data sets: B1 towed through a tank that is simulated by strip theory.

    python scripts/gen_task1.py --out data/task1 --seed 0
    python scripts/gen_task1.py --out data/task1 --task 1.2 1.3 --trials 500 --split-by configuration

Stands in for the measured towing tank of the paper, whose data are not public; what is literature and
what is judgement in it is said in hydro_tools/tank/*.py. No part of it uses MuJoCo. Writes

    OUT/raw/      what the load cell recorded: run-NNN.npz, conditions.csv, manifest.json (with task 1.1)
    OUT/figures/  raw.svg, speeds.svg (with task 1.1)
    OUT/1.1, 1.2, 1.3   `hydro-dataset/1`: 100 samples of one tow; 5 conditions of 10 samples; the same with noise

The same seed gives the same bytes. Needs pip install -e . -e scripts[tank].
"""

import argparse
import os
import sys
import time
from pathlib import Path

# One thread: sums in one order.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

from hydro_mujoco.recording import arguments  # noqa: E402
from hydro_mujoco.recording.interrupts import ended  # noqa: E402
from hydro_tools.datasets import DataError  # noqa: E402
from hydro_tools.tank import campaign, dataset, task1  # noqa: E402


def parse() -> argparse.Namespace:
    """The command line, checked."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("data/task1"), help="folder (default: %(default)s)")
    parser.add_argument(
        "--task",
        nargs="+",
        choices=sorted(task1.SAMPLES),
        default=sorted(task1.SAMPLES),
        help="which data sets (default: all)",
    )
    parser.add_argument("--seed", type=arguments.seed, default=0, help="default: %(default)s")
    parser.add_argument(
        "--trials",
        type=arguments.count,
        help="trajectories of each data set (default: "
        + ", ".join(f"{n} of {task}" for task, n in dataset.TRIALS.items())
        + "); more than 192 of 1.1 tow conditions again",
    )
    parser.add_argument(
        "--splits",
        type=arguments.splits,
        default=(0.8, 0.1, 0.1),
        help="shares of train,val,test (default: 0.8,0.1,0.1)",
    )
    parser.add_argument(
        "--split-by",
        choices=task1.BY,
        default=task1.BY[0],
        help="configuration: no leg configuration of one split occurs in another (default: %(default)s)",
    )
    parser.add_argument(
        "--shard-size", type=arguments.count, default=500, help="trajectories a file (default: %(default)s)"
    )
    clash = parser.add_mutually_exclusive_group()
    clash.add_argument("--resume", action="store_true", help="finish what a former run left")
    clash.add_argument("--overwrite", action="store_true", help="replace what --out holds of these tasks")
    args = parser.parse_args()
    args.task = sorted(set(args.task))
    return args


def draw(raw: Path, figures: Path) -> None:
    """Pictures of the recorded runs."""
    from hydro_tools.tank import figures as pictures

    # The fastest tow of the middle configuration where it was towed, else the last run.
    files = [entry["file"] for entry in campaign.manifest(raw)["files"]]
    shown = "run-027.npz" if "run-027.npz" in files else files[-1]
    pictures.raw(campaign.read(raw / shown), figures / "raw.svg")
    pictures.speeds(raw / campaign.TABLE, figures / "speeds.svg")


def main() -> int:
    """Run the command line; returns the exit status."""
    args = parse()
    start = time.monotonic()
    wanted = [
        dataset.Settings(
            task=task,
            trials=args.trials or dataset.TRIALS[task],
            seed=args.seed,
            splits=args.splits,
            by=args.split_by,
            shard_size=args.shard_size,
        )
        for task in args.task
    ]
    flags = {"resume": args.resume, "overwrite": args.overwrite}
    raw = args.out / "raw"
    try:
        for settings in wanted:
            settings.counts()
        for settings in wanted:
            if tows := settings.tows():
                campaign.tow(raw, args.seed, tows, **flags)
                draw(raw, args.out / "figures")
            manifest = dataset.generate(settings, args.out / settings.task, raw, **flags)
            counts = ", ".join(f"{split} {part['trajectories']}" for split, part in manifest["splits"].items())
            print(f"{args.out / settings.task}: {counts} trajectories of {manifest['samples']} samples")
    except (DataError, OSError) as error:
        print(f"gen_task1.py: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(f"\ngen_task1.py: stopped; finished files are kept in {args.out}: go on with --resume", file=sys.stderr)
        return ended()
    print(f"{time.monotonic() - start:.1f} s")
    return 0
