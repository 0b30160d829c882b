"""Record a data set from any MJCF with a free body, for `hydro train`.

    python -m hydro_mujoco.record --model my.xml --out data/mine
    hydro train --data data/mine --out out/mine --preset demo

Writes `hydro-dataset/1`: shards `{train,val,test}-*.safetensors` and `manifest.json`. Features: positions and
velocities of the robot's hinges and slides by name, the base's quaternion, angular and linear velocity, and the water's
density where --density varies it. Label: the water's wrench on the base at the same state, in the base frame about the
base origin [N, N m]. The robot is driven by its actuators, pushed, and started anyhow; the same seed gives the same
bytes at any number of workers. What of effects is recorded, and what stays beside a checkpoint: docs/any-robot.md.
"""

import argparse
import os
import sys
import time
import warnings
from pathlib import Path
from typing import Any

from ..errors import DataError, Notice
from ..recording import arguments
from ..recording.interrupts import ended
from . import record, water


def parse(words: list[str] | None = None) -> argparse.Namespace:
    """The command line, checked."""
    parser = argparse.ArgumentParser(
        prog="python -m hydro_mujoco.record",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--model", type=Path, required=True, help="MJCF")
    parser.add_argument("--out", type=Path, required=True, help="folder of the data set")
    parser.add_argument(
        "--trials", type=arguments.count, default=500, help="trajectories in all (default: %(default)s)"
    )
    parser.add_argument("--samples", type=arguments.count, default=400, help="of each (default: %(default)s)")
    parser.add_argument("--seed", type=arguments.seed, default=0, help="default: %(default)s")
    parser.add_argument("--body", help="body whose motion is recorded (default: the first with a free joint)")
    parser.add_argument("--water", choices=water.KINDS, help="what is the label (default: all that the model has)")
    parser.add_argument("--buoyancy", action="store_true", help="gravcomp counts as the water's too")
    parser.add_argument(
        "--density", type=float, nargs=2, metavar=("LOW", "HIGH"), help="vary it, kg/m^3; it becomes a feature"
    )
    parser.add_argument(
        "--sample-period", type=float, metavar="S", help="a multiple of the timestep (default: nearest to 0.01)"
    )
    parser.add_argument(
        "--noise", type=float, default=0.0, help="on the label, share of its deviation (default: %(default)s)"
    )
    parser.add_argument(
        "--effort", type=float, default=1.0, help="share of actuators' ranges and of pushes (default: %(default)s)"
    )
    parser.add_argument("--frequency", type=float, nargs=2, metavar=("LOW", "HIGH"), help="of gaits, Hz")
    parser.add_argument("--contacts", action="store_true", help="bodies touch each other and the ground")
    parser.add_argument(
        "--splits", type=arguments.splits, default=(0.8, 0.1, 0.1), help="train,val,test (default: 0.8,0.1,0.1)"
    )
    parser.add_argument(
        "--shard-size", type=arguments.count, default=50, help="trajectories a file (default: %(default)s)"
    )
    parser.add_argument(
        "--workers", type=arguments.count, default=os.cpu_count() or 1, help="processes (default: all cores)"
    )
    parser.add_argument("--plugin", type=Path, help="plugin library, for models with hydro.wrench")
    clash = parser.add_mutually_exclusive_group()
    clash.add_argument("--resume", action="store_true", help="finish what a former run left")
    clash.add_argument("--overwrite", action="store_true", help="replace the data set in --out")
    return parser.parse_args(words)


def _show(message: Warning | str, category: type[Warning], *_: object, **__: object) -> None:
    if issubclass(category, Notice):
        print(f"record: note: {message}", file=sys.stderr)


def main(words: list[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    args = parse(words)
    options: dict[str, Any] = {
        key: tuple(value) if isinstance(value, list) else value for key, value in vars(args).items()
    }
    start = time.monotonic()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("always", Notice)
            warnings.showwarning = _show
            manifest = record(options.pop("model"), options.pop("out"), **options)
    except (DataError, OSError) as error:
        print(f"record: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(f"\nrecord: stopped; finished shards are kept in {args.out}: go on with --resume", file=sys.stderr)
        return ended()
    counts = ", ".join(f"{split} {part['trajectories']}" for split, part in manifest["splits"].items())
    sizes = ", ".join(f"{name} {std:.3g}" for name, std in zip(manifest["outputs"], manifest["wrench_std"]))
    print(
        f"{args.out}: {counts} trajectories of {args.samples} samples, {manifest['sample_period']:g} s apart, in "
        f"{time.monotonic() - start:.1f} s\n"
        f"body {manifest['body']}, water {manifest['water']['kind']}, {len(manifest['features'])} features; "
        f"deviation of the wrench: {sizes}"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
