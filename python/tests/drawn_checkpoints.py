"""Small checkpoints with weights drawn at random, of every kind and encoding, for tests."""

import hashlib
import json

import numpy as np

#: A base that floats, with one joint.
FEATURES = (
    *("position.fin", "velocity.fin"),
    *(f"quaternion.{part}" for part in "wxyz"),
    *(f"angular_velocity.{axis}" for axis in "xyz"),
    *(f"linear_velocity.{axis}" for axis in "xyz"),
    "density",
)
UNITS = {
    "position": "rad",
    "velocity": "rad/s",
    "quaternion": "1",
    "angular_velocity": "rad/s",
    "linear_velocity": "m/s",
}
OUTPUTS = ("force.x", "force.z", "torque.y", "joint_torque.fin")
LINKS = {
    "links": {
        "links": [
            {
                "name": "hull",
                "origin": [0.0, 0.0, 0.0],
                "rotation": [1.0, 0.0, 0.0, 0.0],
                "centre": [0.05, 0.0, 0.02],
                "along": [1.0, 0.0, 0.0],
            },
            {
                "name": "fin",
                "parent": 0,
                "origin": [-0.3, 0.0, 0.0],
                "rotation": [0.8, 0.0, 0.6, 0.0],
                "joint": {"name": "fin", "kind": "hinge", "axis": [0.0, 0.0, 1.0]},
                "centre": [-0.1, 0.0, 0.01],
                "along": [0.6, 0.8, 0.0],
            },
            {
                "name": "tip",
                "parent": 1,
                "origin": [-0.1, 0.1, 0.0],
                "rotation": [1.0, 0.0, 0.0, 0.0],
                "joint": {"name": "fin", "kind": "slide", "axis": [0.0, 0.6, 0.8]},
                "centre": [0.0, 0.0, 0.0],
                "along": [0.0, 0.0, 1.0],
            },
        ]
    }
}
#: Numbers of an encoded sample.
ENCODED = {"raw": 13, "up": 12, "hydrodynamic": 12 + 3 + 6 + 9 + 3 + 3 + 3 + 1, "links": 40 + 3 * 15}


def perceptron(name, inputs, hidden, outputs, skip):
    """Shapes of a perceptron's tensors."""
    widths = [inputs, *hidden, outputs]
    shapes = {}
    for layer, (before, after) in enumerate(zip(widths, widths[1:], strict=False)):
        shapes |= {f"{name}.{layer}.weight": (after, before), f"{name}.{layer}.bias": (after,)}
    return shapes | ({f"{name}.skip.weight": (outputs, inputs)} if skip else {})


def linear(name, inputs, outputs):
    """Shapes of a linear map's tensors."""
    return {f"{name}.weight": (outputs, inputs), f"{name}.bias": (outputs,)}


def shapes_of(kind, c, n, f):
    """Shapes of the tensors of a kind with the sizes `c`, for n encoded numbers and f outputs."""
    if kind == "relaxation-ode":
        h, m = c["window"] * n, c["memory"]
        memory = perceptron("memory", h, [2 * m], 2 * m, c["skip"]) if m else {}
        return memory | perceptron("field", h + m, c["hidden"], 2 * c["modes"] * f, c["skip"])
    if kind == "mlp":
        return perceptron("field", n, c["hidden"], f, c["skip"])
    if kind == "lstm":
        shapes, inputs = linear("output", c["hidden"][-1], f), n
        for layer, width in enumerate(c["hidden"]):
            shapes |= {
                f"layer.{layer}.input.weight": (4 * width, inputs),
                f"layer.{layer}.recurrent.weight": (4 * width, width),
                f"layer.{layer}.bias": (4 * width,),
            }
            inputs = width
        return shapes | ({"skip.weight": (f, n)} if c["skip"] else {})
    if kind == "cnode":
        g = c["hidden_state"]
        field = perceptron("field", f + g, c["hidden"], (f + g) * (n + 1), False)
        return linear("lift", f + n, g) | field | perceptron("estimate", n, [64], f, True)
    field = perceptron("field", c["latent"] + f * c["field_sees_force"], c["hidden"], f, c["skip"])
    if kind == "mlp-ode":
        return field | perceptron("latent", n, c["latent_hidden"], c["latent"], c["skip"])
    e = c["embedding"]
    attention = linear("embed", n, e) | linear("attention.qkv", e, 3 * e) | linear("mix", e, e)
    return field | attention | linear("latent", e, c["latent"]) | {"attention.lag_bias": (c["heads"], c["window"])}


def draw(folder, kind, config, *, sample_period=0.012, limited=True, solver="euler", seed=0):
    """Writes a checkpoint; limited: with a range of training, which a motion leaves."""
    rng = np.random.default_rng(seed)
    encoding = config["encoding"]
    n, f, features = ENCODED["links" if encoding is LINKS else encoding], len(OUTPUTS), len(FEATURES)
    data, header = b"", {}
    for name, shape in sorted(shapes_of(kind, config, n, f).items()):
        values = rng.normal(0, 0.7 / np.sqrt(shape[-1]), shape).astype("<f4")
        header[name] = {"dtype": "F32", "shape": shape, "data_offsets": [len(data), len(data) + values.nbytes]}
        data += values.tobytes()
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    weights = len(text).to_bytes(8, "little") + text + data
    mean, std = np.full(n, 0.1), rng.uniform(0.3, 3, n)
    mean[12 if encoding == "raw" else 11] = 1000.0  # the density
    if encoding in ("hydrodynamic", LINKS):
        std[12:] *= 300
    card = {
        "schema": "hydro-checkpoint/1",
        "name": "drawn",
        "kind": kind,
        "config": config,
        "features": FEATURES,
        "feature_units": [UNITS.get(name.partition(".")[0], "kg/m^3") for name in FEATURES],
        "outputs": OUTPUTS,
        "output_units": ["N", "N", "N m", "N m"],
        "frames": {
            "angular_velocity": "base",
            "linear_velocity": "base, relative to the water",
            "quaternion": "world_from_base, w x y z",
            "wrench": "base",
        },
        "joints": ["fin"],
        "sample_period": sample_period,
        "solver": solver,
        "normaliser": {
            "input_mean": mean.tolist(),
            "input_std": std.tolist(),
            "output_mean": [3.0, -2.0, 0.5, 0.1],
            "output_std": [20.0, 15.0, 2.0, 0.3],
        },
        "dataset": None,
        "command": "drawn",
        "hydro": "0.2.0",
        "weights_sha256": hashlib.sha256(weights).hexdigest(),
    }
    if limited:
        card["envelope"] = {
            "least": [-0.3] * features,
            "most": [0.4] * features,
            "least_force": [-30.0, -25.0, -3.0, -0.5],
            "most_force": [35.0, 20.0, 3.0, 0.6],
        }
    folder.mkdir()
    (folder / "card.json").write_text(json.dumps(card), encoding="utf-8")
    (folder / "weights.safetensors").write_bytes(weights)
    return folder
