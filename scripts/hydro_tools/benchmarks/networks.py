"""The same networks in numpy, in double precision: the check of every implementation."""

import json
from pathlib import Path

import numpy as np
from safetensors.numpy import load_file


def _silu(x: np.ndarray) -> np.ndarray:
    return x / (1 + np.exp(-x))


def read(checkpoint: Path) -> tuple[dict, dict[str, np.ndarray]]:
    """Card and weights (f64) of a checkpoint."""
    card = json.loads((checkpoint / "card.json").read_text())
    weights = load_file(checkpoint / "weights.safetensors")
    return card, {name: value.astype(np.float64) for name, value in weights.items()}


def field(weights: dict[str, np.ndarray], x: np.ndarray, *, relaxing: bool = False) -> np.ndarray:
    """x [.., inputs] -> [.., outputs]; `relaxing`: -1 stands on the diagonal of the linear part."""
    y, index = x, 0
    while f"field.{index}.weight" in weights:
        y = (_silu(y) if index else y) @ weights[f"field.{index}.weight"].T + weights[f"field.{index}.bias"]
        index += 1
    if "field.skip.weight" in weights:
        skip = weights["field.skip.weight"]
        y = y + x @ (skip - np.eye(*skip.shape) if relaxing else skip).T
    return y


def encode(card: dict, x: np.ndarray) -> np.ndarray:
    """Raw features [.., n] -> standardised inputs; the quaternion becomes the up direction where the card says so."""
    encoding = card["config"]["encoding"]
    if encoding not in ("raw", "up"):
        raise ValueError(f"encoding `{encoding}` is not known here: there are raw and up")
    if encoding == "up":
        at = card["features"].index("quaternion.w")
        w, i, j, k = (x[..., at + n] for n in range(4))
        scale = 2 / (w * w + i * i + j * j + k * k)
        up = np.stack([scale * (i * k - w * j), scale * (j * k + w * i), 1 - scale * (i * i + j * j)], -1)
        x = np.concatenate([x[..., :at], up, x[..., at + 4 :]], -1)
    norm = card["normaliser"]
    return np.clip((x - norm["input_mean"]) / norm["input_std"], -20, 20)


def latents(config: dict, weights: dict[str, np.ndarray], z: np.ndarray) -> np.ndarray:
    """z [W-1+S, n] -> h [S, l]."""
    over_features = config.get("tokens") == "features"
    return (_over_features if over_features else _over_samples)(config, weights, z)


def _over_features(config: dict, weights: dict[str, np.ndarray], z: np.ndarray) -> np.ndarray:
    """Attention among the numbers of a window, each a token; newest sample first."""
    window, heads, width = config["window"], config["heads"], config["embedding"]
    rows = np.concatenate([z[window - 1 - lag : len(z) - lag] for lag in range(window)], -1)
    tokens = rows[..., None] * weights["tokens.weight"] + weights["tokens.bias"]

    def affine(name, value):
        return value @ weights[f"{name}.weight"].T + weights[f"{name}.bias"]

    parts = affine("attention.qkv", tokens).reshape(*tokens.shape[:2], 3, heads, width // heads)
    query, key, value = np.moveaxis(parts, 2, 0)
    scores = np.einsum("sihd,sjhd->shij", query, key) / (width // heads) ** 0.5
    power = np.exp(scores - scores.max(-1, keepdims=True))
    attended = np.einsum("shij,sjhd->sihd", power / power.sum(-1, keepdims=True), value)
    pooled = (tokens + affine("mix", attended.reshape(tokens.shape))).mean(1)
    return affine("latent", pooled)


def _over_samples(config: dict, weights: dict[str, np.ndarray], z: np.ndarray) -> np.ndarray:
    """Attention of the newest sample over those of a window."""
    window, heads, width = config["window"], config["heads"], config["embedding"]
    depth, steps = width // heads, len(z) + 1 - window

    def affine(name, value):
        return value @ weights[f"{name}.weight"].T + weights[f"{name}.bias"]

    embeddings = affine("embed", z)
    query, key, value = affine("attention.qkv", embeddings).reshape(len(z), 3, heads, depth).transpose(1, 0, 2, 3)
    # [S, W] by lag, the newest first.
    seen = np.arange(steps)[:, None] + window - 1 - np.arange(window)
    scores = np.einsum("shd,swhd->shw", query[window - 1 :], key[seen]) / depth**0.5
    scores += weights["attention.lag_bias"] - 4.0 ** (1 - np.arange(heads))[:, None] * np.arange(window)
    power = np.exp(scores - scores.max(-1, keepdims=True))
    attended = np.einsum("shw,swhd->shd", power / power.sum(-1, keepdims=True), value[seen])
    return affine("latent", embeddings[window - 1 :] + affine("mix", attended.reshape(steps, width)))


def walk(checkpoint: Path, x: np.ndarray) -> np.ndarray:
    """Forces [S, f] (SI) after each sample x [S, n], from zero force and a past that was the first sample."""
    card, weights = read(checkpoint)
    norm = card["normaliser"]
    mean, std = np.array(norm["output_mean"]), np.array(norm["output_std"])
    z = encode(card, x)
    if card["kind"] == "mlp":
        return mean + std * field(weights, z)
    config = card["config"]
    h = latents(config, weights, np.concatenate([np.repeat(z[:1], config["window"] - 1, 0), z]))
    force, forces = (0 - mean) / std, []
    for latent in h:  # Euler, the card's
        force = force + field(weights, np.concatenate([force, latent]), relaxing=config["skip"])
        forces.append(mean + std * force)
    return np.array(forces)


def trajectory(checkpoint: Path, x: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Forces [T, f] (SI) of an Attention-ODE at samples x [T, n], from the force `start` [f] at the first; Euler."""
    card, weights = read(checkpoint)
    config, norm = card["config"], card["normaliser"]
    mean, std = np.array(norm["output_mean"]), np.array(norm["output_std"])
    z = encode(card, x)
    h = latents(config, weights, np.concatenate([np.repeat(z[:1], config["window"] - 1, 0), z]))
    force = (start - mean) / std
    forces = [force]
    for latent in h[1:] if config.get("end_of_step") else h[:-1]:
        force = force + field(weights, np.concatenate([force, latent]), relaxing=config["skip"])
        forces.append(force)
    return mean + std * np.array(forces)
