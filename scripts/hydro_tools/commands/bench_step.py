"""A step of two builds of the plugin: is the new one slower?

    python scripts/bench_step.py OLD.so NEW.so [--pairs 5] [--blocks 12]

Each pair is a process of either library, one after the other; which is first changes. Each steps a B1 in the water of
two checkpoints, and a body in drag. Printed: medians of the processor time of `mj_step`, the ratio new to old (median
of the pairs, least to most), and whether both move the bodies to the same bits.
"""

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from tqdm import tqdm

from hydro_mujoco.plugin import LIBRARY as CHOSEN

from ..benchmarks import BenchmarkError
from ..repository import ROOT


def steps(library: Path, blocks: int) -> dict[str, dict]:
    """Microseconds and end of every scene, by a process that loads this library."""
    command = [sys.executable, "-m", "hydro_tools.water_costs.one_build", str(blocks)]
    environment = os.environ | {CHOSEN: str(library.resolve()), "PYTHONPATH": str(ROOT / "scripts")}
    run = subprocess.run(command, env=environment, capture_output=True, text=True)
    if run.returncode:
        raise BenchmarkError(f"{library}: {run.stderr.strip().rpartition(chr(10))[2]}")
    return json.loads(run.stdout)


def table(old: list[dict], new: list[dict]) -> str:
    """Medians, and ratios pair by pair."""
    lines = ["| scene | old [us] | new [us] | new / old | motion |", "|---|---|---|---|---|"]
    for name in old[0]:
        before, after = (np.array([each[name]["microseconds"] for each in runs]) for runs in (old, new))
        ratio = after / before
        same = all(a[name]["end"] == b[name]["end"] for a, b in zip(old, new, strict=True))
        lines.append(
            f"| {name} | {np.median(before):.2f} | {np.median(after):.2f} | {np.median(ratio):.3f} "
            f"({ratio.min():.3f} to {ratio.max():.3f}) | {'the same bits' if same else 'another'} |"
        )
    return "\n".join(lines)


def main() -> int:
    """Run the command line; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old", type=Path, help="libhydro_plugin.so of the build to compare with")
    parser.add_argument("new", type=Path, help="libhydro_plugin.so of the other build")
    parser.add_argument("--pairs", type=int, default=5, help="default: %(default)s")
    parser.add_argument(
        "--blocks", type=int, default=12, help="blocks of 1000 steps a scene and process; default: %(default)s"
    )
    args = parser.parse_args()
    for library in (args.old, args.new):
        if not library.is_file():
            parser.error(f"{library}: no such file; expected a libhydro_plugin.so")
    old, new = [], []
    both = [(args.old, old), (args.new, new)]
    try:
        for pair in tqdm(range(args.pairs), unit="pair"):
            for library, found in both[:: 1 - 2 * (pair % 2)]:
                found.append(steps(library, args.blocks))
    except BenchmarkError as error:
        print(f"bench_step.py: {error}", file=sys.stderr)
        return 1
    print(table(old, new))
    return 0
