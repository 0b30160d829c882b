"""Linear and quadratic drag fitted to a data set by least squares: the yardstick of a learned model.

    python scripts/fit_drag.py --data data/mine

Every output is a sum of the base's velocities and of their signed squares (whole matrices), fitted to the training
split and judged on the test split. nRMSE as `hydro evaluate` has it: each output by its own standard deviation on
the training split.
"""

import argparse
import json
import sys
from pathlib import Path

import numpy as np
from safetensors.numpy import load_file


def split(folder: Path, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Features [rows, n] and clean labels [rows, f] of a split."""
    shards = [load_file(path) for path in sorted(folder.glob(f"{name}-*.safetensors"))]
    if not shards:
        raise OSError(f"{folder}: no shard of the split `{name}`")
    rows = [np.concatenate([shard[key] for shard in shards]) for key in ("x", "wrench_clean")]
    return tuple(part.reshape(-1, part.shape[-1]).astype(float) for part in rows)


def main() -> int:
    """Run the command line; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, help="folder of a data set")
    args = parser.parse_args()
    try:
        manifest = json.loads((args.data / "manifest.json").read_text())
        (x, y), (x_test, y_test) = split(args.data, "train"), split(args.data, "test")
    except (OSError, ValueError) as error:
        print(f"fit_drag.py: {error}", file=sys.stderr)
        return 1
    names = [item["name"] if isinstance(item, dict) else item for item in manifest["features"]]
    velocities = [k for k, name in enumerate(names) if name.startswith(("linear_velocity", "angular_velocity"))]

    def terms(rows):
        speed = rows[:, velocities]
        return np.concatenate([speed, np.abs(speed) * speed], 1)

    coefficients, *_ = np.linalg.lstsq(terms(x), y, rcond=None)
    error = np.sqrt(((terms(x_test) @ coefficients - y_test) ** 2).mean(0)) / y.std(0)
    print(
        f"{args.data}: nRMSE of fitted drag {np.sqrt((error**2).mean()):.3f}; by output {np.round(error, 3).tolist()}"
    )
    return 0
