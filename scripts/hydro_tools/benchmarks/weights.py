"""First weights and checkpoints, drawn by numpy: the same file for every implementation."""

import hashlib
import json
from pathlib import Path

import numpy as np
from safetensors.numpy import save

from hydro_mujoco.recording.files import write_beside

from ..repository import ROOT


def _uniform(rng: np.random.Generator, outputs: int, inputs: int, up: float) -> np.ndarray:
    return rng.uniform(-up, up, (outputs, inputs)).astype(np.float32)


def field(rng: np.random.Generator, widths: list[int], *, last: float = 0.1) -> dict[str, np.ndarray]:
    """`field.0.weight` ...: a perceptron of these widths, drawn as hydro draws it; `last` scales the last layer."""
    tensors = {}
    for index, (inputs, outputs) in enumerate(zip(widths, widths[1:])):
        gain = last if index == len(widths) - 2 else 3**0.5
        tensors[f"field.{index}.weight"] = _uniform(rng, outputs, inputs, gain / inputs**0.5)
        tensors[f"field.{index}.bias"] = np.zeros(outputs, np.float32)
    return tensors


def attention_ode(
    rng: np.random.Generator, config: dict, inputs: int, outputs: int, *, last: float = 0.1
) -> dict[str, np.ndarray]:
    """All weights of an Attention-ODE without linear part, by the names of `weights.safetensors`."""
    width, latent = config["embedding"], config["latent"]
    tensors = {}
    for name, rows, columns, up in (
        ("embed", width, inputs, (3 / inputs) ** 0.5),
        ("attention.qkv", 3 * width, width, width**-0.5),
        ("mix", width, width, (3 / width) ** 0.5),
        ("latent", latent, width, (3 / width) ** 0.5),
    ):
        tensors[f"{name}.weight"] = _uniform(rng, rows, columns, up)
        tensors[f"{name}.bias"] = np.zeros(rows, np.float32)
    tensors["attention.lag_bias"] = np.zeros((config["heads"], config["window"]), np.float32)
    return tensors | field(rng, [outputs + latent, *config["hidden"], outputs], last=last)


def write(path: Path, tensors: dict[str, np.ndarray]) -> Path:
    """A safetensors file. Renamed into place: an implementation may have mapped the one that it replaces."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_beside(path, save(tensors))
    return path


def checkpoint(folder: Path, tensors: dict[str, np.ndarray], **card) -> Path:
    """A checkpoint folder: the released card with the fields `card` in place of its own."""
    folder.mkdir(parents=True, exist_ok=True)
    content = save(tensors)
    write_beside(folder / "weights.safetensors", content)
    released = json.loads((ROOT / "models/b1-task2/card.json").read_text())
    # The range of the training data is that of the released one's features.
    released.pop("envelope", None)
    whole = released | {"name": folder.name, "dataset": None, "metrics": None, "command": "scripts/bench.sh"} | card
    whole["weights_sha256"] = hashlib.sha256(content).hexdigest()
    (folder / "card.json").write_text(json.dumps(whole, indent=1))
    return folder


def bare_field(folder: Path, widths: list[int], *, seed: int) -> Path:
    """A checkpoint that is a perceptron and nothing else: raw inputs, identity for a normaliser."""
    inputs, outputs = widths[0], widths[-1]
    joints = [f"j{index}" for index in range(inputs)]
    tensors = field(np.random.default_rng(seed), widths, last=1.0)
    return checkpoint(
        folder,
        tensors,
        kind="mlp",
        config={"hidden": widths[1:-1], "encoding": "raw", "skip": False},
        features=[f"position.{joint}" for joint in joints],
        feature_units=["rad"] * inputs,
        joints=joints,
        normaliser={
            "input_mean": [0.0] * inputs,
            "input_std": [1.0] * inputs,
            "output_mean": [0.0] * outputs,
            "output_std": [1.0] * outputs,
        },
    )


def random_ode(folder: Path, config: dict, *, seed: int) -> Path:
    """An Attention-ODE for B1 with random weights, small at the end so that its force stays small.

    The normaliser is the released one, with the quaternion as it is for a raw encoding.
    """
    released = json.loads((ROOT / "models/b1-task2/card.json").read_text())
    features, normaliser = released["features"], dict(released["normaliser"])
    at = features.index("quaternion.w")
    for name, value in (("input_mean", 0.0), ("input_std", 1.0)):
        short = normaliser[name]
        normaliser[name] = short[:at] + [value] * 4 + short[at + 3 :]
    whole = {"encoding": "raw", "field_sees_force": True, "skip": False} | config
    tensors = attention_ode(np.random.default_rng(seed), whole, len(features), len(released["outputs"]), last=0.01)
    return checkpoint(folder, tensors, kind="attention-ode", config=whole, normaliser=normaliser)
