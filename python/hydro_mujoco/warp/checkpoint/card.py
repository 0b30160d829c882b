"""A checkpoint's card and weights, as far as MuJoCo Warp gets them."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import DataError
from ...reading import TEXT, read, read_json
from ..support import refuse

SCHEMA = "hydro-checkpoint/1"
#: Kinds of networks.
KINDS = ("relaxation-ode", "mlp-ode", "attention-ode", "lstm", "cnode", "mlp")
#: Methods of the kinds whose equation is stepped, one step a sample.
SOLVERS = ("euler", "rk4")
STEPPED = ("attention-ode", "mlp-ode", "cnode")
#: Encodings with closed forms of the water's force: asked in twice the range of their training (network.rs).
CLOSED_FORMS = ("hydrodynamic", "links")
REACH = 2.0
#: Largest file of weights [byte]: the most weights of a model, and a header (crates/model/src/checkpoint/mod.rs).
MOST_BYTES = 4 * (1 << 26) + TEXT


@dataclass(frozen=True)
class Card:
    """What a checkpoint is.

    Attributes:
        kind: of network. config: its sizes. encoding: of a sample. links: of the encoding `links`, as in the card.
        features: names, n of them, in order. outputs: names, f of them. joints: that the features name.
        sample_period: [s]. solver: method of a step.
        input_mean, input_std: of encoded numbers (SI). output_mean, output_std: of outputs [N, N m], shape (f,).
        range: least and greatest of each feature that the network is asked at (SI), shape (2, n); infinite without one.
        forces: least and greatest of each output [N, N m], shape (2, f); infinite without them.
        added_mass: matrix over the density by name of body [m^3, m^4, m^5], shape (6, 6) each.
        weights: by name, in double precision.
    """

    kind: str
    config: dict[str, Any]
    encoding: str
    links: list[dict[str, Any]]
    features: list[str]
    outputs: list[str]
    joints: list[str]
    sample_period: float
    solver: str
    input_mean: np.ndarray
    input_std: np.ndarray
    output_mean: np.ndarray
    output_std: np.ndarray
    range: np.ndarray
    forces: np.ndarray
    added_mass: dict[str, np.ndarray]
    weights: dict[str, np.ndarray]


def read_card(folder: Path, where: str, solver: str = "") -> Card:
    """The card and weights in a folder that the plugin has read and found right.

    Args:
        where: the instance, for messages.
        solver: in place of the card's.

    Raises:
        DataError: it is of a kind, or has a setting, that MuJoCo Warp does not get; or the files are gone.
    """
    name = f"{where}: checkpoint {folder}"
    card = read_json(folder / "card.json", f"{name}, card.json")
    weights = read_weights(folder / "weights.safetensors", f"{name}, weights.safetensors")
    where = f"{where}, checkpoint {folder.name}"
    kind, config, solver = card["kind"], card["config"], solver or card["solver"]
    if card["schema"] != SCHEMA:
        refuse(where, f"schema `{card['schema']}`", (SCHEMA,))
    if kind not in KINDS:
        refuse(where, f"kind `{kind}`", KINDS)
    if kind in STEPPED and solver not in SOLVERS:
        refuse(where, f"solver `{solver}`", SOLVERS)
    if config.get("tokens", "samples") != "samples":
        refuse(where, f"attention over `{config['tokens']}`", ("samples",))
    encoding = config["encoding"]
    links = encoding["links"]["links"] if isinstance(encoding, dict) else []
    encoding = "links" if links else str(encoding)
    limits, forces = _ranges(card, REACH if encoding in CLOSED_FORMS else 1.0)
    numbers = {name: np.array(values, dtype=float) for name, values in card["normaliser"].items()}
    return Card(
        kind=kind,
        config=config,
        encoding=encoding,
        links=links,
        features=card["features"],
        outputs=card["outputs"],
        joints=card["joints"],
        sample_period=float(card["sample_period"]),
        solver=solver,
        range=limits,
        forces=forces,
        added_mass={each["body"]: np.reshape(each["matrix"], (6, 6)) for each in card.get("added_mass", [])},
        weights=weights,
        **numbers,
    )


def _ranges(card: dict[str, Any], reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Ranges of features and of forces: those of the training, `reach` times as wide, forces by its square."""
    n, f = len(card["features"]), len(card["outputs"])
    if card.get("envelope") is None:
        return np.outer([-np.inf, np.inf], np.ones(n)), np.outer([-np.inf, np.inf], np.ones(f))

    def wide(least: str, most: str, by: float) -> np.ndarray:
        ends = np.array([card["envelope"][least], card["envelope"][most]])
        return ends.mean(axis=0) + by * (ends - ends.mean(axis=0))

    return wide("least", "most", reach), wide("least_force", "most_force", reach**2)


def read_weights(path: Path, name: str) -> dict[str, np.ndarray]:
    """The tensors of a file of safetensors, in double precision. name: of the file, for messages.

    Raises:
        DataError: there is no such file, it is none of safetensors, or a tensor is not of single precision.

    Source: https://github.com/huggingface/safetensors#format
    """
    data = read(path, name, MOST_BYTES)
    try:
        return _tensors(data)
    except (ValueError, RecursionError) as error:
        raise DataError(f"{name}: {error}") from error


def _tensors(data: bytes) -> dict[str, np.ndarray]:
    start = 8 + int.from_bytes(data[:8], "little")
    found = {}
    for name, tensor in json.loads(data[8:start]).items():
        if name == "__metadata__":
            continue
        if tensor["dtype"] != "F32":
            raise ValueError(f"tensor `{name}` is of {tensor['dtype']}, expected F32")
        first, end = tensor["data_offsets"]
        numbers = np.frombuffer(data[start + first : start + end], "<f4")
        found[name] = numbers.reshape(tensor["shape"]).astype(float)
    return found
