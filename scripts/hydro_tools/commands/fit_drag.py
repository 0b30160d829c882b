"""Linear and quadratic drag fitted to a data set by least squares: the yardstick of a learned model.

    python scripts/fit_drag.py --data data/mine
    python scripts/fit_drag.py --data data/mine --model my.xml --checkpoint out/mine

Open loop: every output is a sum of the base's velocities and of their signed squares (whole matrices), fitted
to the training split and judged on the test split. nRMSE as `hydro evaluate` has it: each output by its own
standard deviation on the training split. Closed loop: the model is stepped in its own water, in the
checkpoint's and in fitted drag (never negative, an axis by itself), with the same sinusoidal commands from the
same start; printed is how far the bases are apart. --out writes that drag as JSON, `linear` and `quadratic` [6] of
surge, sway, heave, roll, pitch, yaw; buoyancy is taken out first where the data set tells it.
"""

import argparse
import json
import sys
from pathlib import Path

import mujoco
import numpy as np
from safetensors.numpy import load_file
from scipy.optimize import nnls

import hydro_mujoco
from hydro_mujoco.plugin import load_plugin
from hydro_mujoco.reading import check, read_json
from hydro_mujoco.recording.files import write_json

START, AMPLITUDE, FREQUENCY = (0.5, 0.2, 0.1), 0.3, 0.3


def _shards(folder: Path, name: str) -> list[dict[str, np.ndarray]]:
    """The arrays of each shard of a split."""
    paths = sorted(folder.glob(f"{name}-*.safetensors"))
    for path in paths:
        check(path, most=None)
    return [load_file(path) for path in paths]


def split(folder: Path, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Features [rows, n] and clean labels [rows, f] of a split."""
    shards = _shards(folder, name)
    if not shards:
        raise OSError(f"{folder}: no shard of the split `{name}`")
    rows = [np.concatenate([shard[key] for shard in shards]) for key in ("x", "wrench_clean")]
    return tuple(part.reshape(-1, part.shape[-1]).astype(float) for part in rows)


def buoyancy(folder: Path, name: str) -> np.ndarray | float:
    """Buoyancy in the labels of a split [rows, f]; 0 where the data set does not tell it."""
    shards = _shards(folder, name)
    if not all("hydrostatic" in shard for shard in shards):
        return 0.0
    rows = np.concatenate([shard["hydrostatic"] for shard in shards])
    return rows.reshape(-1, rows.shape[-1]).astype(float)


def names(items: list) -> list[str]:
    """Names of features or outputs in a manifest."""
    return [item["name"] if isinstance(item, dict) else item for item in items]


def open_loop(manifest: dict, train: tuple, test: tuple) -> np.ndarray:
    """nRMSE of each output by whole matrices of drag."""
    kinds = ("linear_velocity", "angular_velocity")
    columns = [k for k, name in enumerate(names(manifest["features"])) if name.startswith(kinds)]

    def terms(rows):
        speed = rows[:, columns]
        return np.concatenate([speed, np.abs(speed) * speed], 1)

    (x, y), (x_test, y_test) = train, test
    coefficients, *_ = np.linalg.lstsq(terms(x), y, rcond=None)
    return np.sqrt(((terms(x_test) @ coefficients - y_test) ** 2).mean(0)) / y.std(0)


def by_axis(manifest: dict, train: tuple) -> tuple[np.ndarray, np.ndarray]:
    """Linear and quadratic drag [6] of each axis, never negative."""
    features, (x, y) = names(manifest["features"]), train
    linear, quadratic = np.zeros(6), np.zeros(6)
    for column, output in enumerate(names(manifest["outputs"])):
        kind, first = ("linear_velocity", 0) if output.startswith("force") else ("angular_velocity", 3)
        speed = x[:, features.index(f"{kind}.{output[-1]}")]
        axis = first + "xyz".index(output[-1])
        (linear[axis], quadratic[axis]), _ = nnls(-np.stack([speed, np.abs(speed) * speed], 1), y[:, column])
    return linear, quadratic


def in_drag(path: str, checkpoint: str, body: str, linear: np.ndarray, quadratic: np.ndarray) -> mujoco.MjModel:
    """The model with this drag at the origin of the recorded body in place of the water that a checkpoint learned."""
    spec = hydro_mujoco.with_checkpoint(path, checkpoint)
    # What the checkpoint did not learn stays beside the drag, as it stays beside the checkpoint.
    instance = next(each for each in spec.plugins if each.config.get("checkpoint"))
    config = dict(instance.config)
    del config["checkpoint"]
    kept = json.loads(config.get("effects") or '{"effects": []}')["effects"]
    drags = [
        {"effect": name, "target": body, "parameters": {"point": [0, 0, 0], "matrix": np.diag(values).tolist()}}
        for name, values in (("linear_drag", linear), ("quadratic_drag", quadratic))
    ]
    instance.config = config | {"effects": json.dumps({"schema": "hydro-effects/1", "effects": [*kept, *drags]})}
    return spec.compile()


def way(model: mujoco.MjModel, steps: int) -> np.ndarray:
    """Places of the base [steps + 1, 3] under sinusoidal commands, from the start on."""
    data = mujoco.MjData(model)
    data.qvel[:3] = START
    low, high = model.actuator_ctrlrange.T
    places = [data.qpos[:3].copy()]
    for step in range(steps):
        phase = 2 * np.pi * FREQUENCY * step * model.opt.timestep + np.arange(model.nu)
        data.ctrl[:] = AMPLITUDE * np.sin(phase) * (high - low) / 2
        mujoco.mj_step(model, data)
        places.append(data.qpos[:3].copy())
    return np.array(places)


def main() -> int:
    """Run the command line; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, help="folder of a data set")
    parser.add_argument("--model", help="MJCF that was recorded: compares the closed loop")
    parser.add_argument("--checkpoint", help="checkpoint trained on the data, for the closed loop")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the drag of each axis as JSON")
    parser.add_argument("--steps", type=int, default=1000, help="of the closed loop (default: %(default)s)")
    args = parser.parse_args()
    if bool(args.model) != bool(args.checkpoint):
        parser.error("--model and --checkpoint go together")
    try:
        manifest = read_json(args.data / "manifest.json")
        train, test = split(args.data, "train"), split(args.data, "test")
        error = open_loop(manifest, train, test)
        print(f"fitted drag: nRMSE {np.sqrt((error**2).mean()):.3f}; by output {np.round(error, 3).tolist()}")
        if args.out:
            train_drag = (train[0], train[1] - buoyancy(args.data, "train"))
            pair = zip(("linear", "quadratic"), by_axis(manifest, train_drag))
            source = {"seed": manifest.get("seed"), "rows": len(train[0])}
            write_json(args.out, {"source": source} | {name: values.tolist() for name, values in pair})
        if args.model:
            check(args.model, f"model {args.model}")
            load_plugin()
            true = way(mujoco.MjModel.from_xml_path(args.model), args.steps)
            waters = {
                "checkpoint": hydro_mujoco.with_checkpoint(args.model, args.checkpoint).compile(),
                "fitted drag": in_drag(args.model, args.checkpoint, manifest["body"], *by_axis(manifest, train)),
            }
            gone = np.linalg.norm(true[-1] - true[0])
            for name, model in waters.items():
                apart = np.linalg.norm(way(model, args.steps)[-1] - true[-1])
                print(f"{name}: {apart:.3f} m apart after {args.steps} steps, {gone:.2f} m from the start")
    except (OSError, ValueError, hydro_mujoco.DataError) as fault:
        print(f"fit_drag.py: {fault}", file=sys.stderr)
        return 1
    return 0
