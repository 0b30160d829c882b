"""Inputs of the implementations: recorded samples of Task 2 and training cases cut from them, made where missing."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
from safetensors.numpy import load_file

from ..repository import ROOT
from . import WORK, weights

#: Of the Task 2 data: 160 trajectories of 401 samples, so that 400 steps lie between.
TRIALS, SAMPLES = 160, 401


def task2(trials: int = TRIALS, samples: int = SAMPLES) -> Path:
    """A data set of scripts/gen_task2.py, four fifths of it the training split."""
    folder = WORK / f"task2-{trials}x{samples}"
    if not (folder / "manifest.json").is_file():
        folder.parent.mkdir(parents=True, exist_ok=True)
        command = [
            sys.executable,
            "scripts/gen_task2.py",
            "--water",
            "ellipsoid",
            "--out",
            str(folder),
            "--trials",
            str(trials),
            "--seed",
            "0",
            "--samples",
            str(samples),
            "--resume",
        ]
        if folder.exists() and not (folder / "generation.json").is_file():
            shutil.rmtree(folder)
        subprocess.run(command, cwd=ROOT, check=True)
    return folder


def split(folder: Path, name: str) -> dict[str, np.ndarray]:
    """Tensors of a split, its shards one after the other."""
    listed = json.loads((folder / "manifest.json").read_text())["splits"][name]["shards"]
    shards = [load_file(folder / shard["file"]) for shard in listed]
    return {key: np.concatenate([shard[key] for shard in shards]) for key in ("x", "wrench")}


def recorded(count: int = 64) -> Path:
    """Tensor `x` [count, 35]: consecutive samples of one trajectory."""
    path = WORK / f"recorded-{count}.safetensors"
    if not path.is_file():
        weights.write(path, {"x": split(task2(), "train")["x"][0, :count].copy()})
    return path


def drawn(inputs: int, count: int = 64) -> Path:
    """Tensor `x` [count, inputs]: numbers of deviation 1."""
    path = WORK / f"drawn-{count}x{inputs}.safetensors"
    return weights.write(path, {"x": np.random.default_rng(1).standard_normal((count, inputs)).astype(np.float32)})


#: The paper's field: 512-512-512, h in R^6, no linear part, raw features.
PAPER = {
    "window": 8,
    "heads": 4,
    "embedding": 64,
    "latent": 6,
    "hidden": [512, 512, 512],
    "encoding": "raw",
    "field_sees_force": True,
    "skip": False,
}


def training_case(
    solver: str,
    *,
    batch: int = 32,
    steps: int = 200,
    samples: int = SAMPLES,
    config: dict = PAPER,
    field_alone: bool = False,
) -> dict:
    """The fields of a training case (`training_case` in a task); its files are written anew, with the same numbers."""
    recorded_split = split(task2(), "train")
    x, force = recorded_split["x"][:, :samples], recorded_split["wrench"][:, :samples]

    def standard(values):
        flat = values.reshape(-1, values.shape[-1]).astype(np.float64)
        return ((values - flat.mean(0)) / np.maximum(flat.std(0), 1e-6)).astype(np.float32)

    rng = np.random.default_rng(0)
    rows = []
    while len(rows) < steps * batch:
        rows += rng.permutation(len(x)).tolist()
    order = np.array(rows[: steps * batch], np.uint32).reshape(steps, batch)
    name = f"training-case-{samples}x{batch}x{steps}"
    data = weights.write(WORK / f"{name}.safetensors", {"z": standard(x), "target": standard(force), "order": order})
    sizes = (
        "-".join(str(config[key]) for key in ("window", "embedding", "latent"))
        + f"-{'x'.join(map(str, config['hidden']))}"
    )
    # Without a linear part the field integrates what it is given, and F has 400 steps to run away: with a last layer of
    # the usual start, or a rate of 1e-3, the first losses lie in the thousands and tell nothing of who computes alike.
    first = weights.attention_ode(np.random.default_rng(0), config, x.shape[-1], force.shape[-1], last=0.01)
    path = weights.write(WORK / f"first-{sizes}.safetensors", first)
    return {
        "data": str(data),
        "weights": str(path),
        "model": config,
        "solver": solver,
        "field_alone": field_alone,
        "learning_rate": 3e-4,
        "weight_decay": 1e-2,
        "clip_norm": 1.0,
    }
