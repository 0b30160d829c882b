"""Hostile inputs of the learning side: cards, weights, manifests, training states, flags of `hydro train`."""

import hashlib
import json
import random
import shutil
from pathlib import Path

from ..released import RELEASED
from ..repository import ROOT
from . import odd
from .bases import MODELS, SCENE, Bases
from .running import Case, SceneCase

SIZES = ("config", "sample_period", "normaliser", "envelope", "features", "outputs")
#: What a released card has and the small ones have not.
RICH = ("config", "added_mass", "outputs", "joints", "water", "envelope", "normaliser")


def plugin(bases: Bases, folder: Path, xml: str) -> SceneCase:
    """The scene, compiled and stepped in Python."""
    scene = folder / "scene.xml"
    odd.put(scene, xml)
    return SceneCase(bases.library, scene)


def config(**attributes: object) -> str:
    """Attributes of the plugin as `<config>` elements."""
    words = {
        key: str(value).replace("&", "&amp;").replace("<", "&lt;").replace('"', "&quot;")
        for key, value in attributes.items()
    }
    return "".join(f'<config key="{key}" value="{value}"/>' for key, value in words.items())


def _checkpoint(bases: Bases, folder: Path, rng: random.Random) -> Path:
    out = folder / "checkpoint"
    shutil.copytree(bases.checkpoints / rng.choice(MODELS), out)
    return out


def _use(bases: Bases, folder: Path, rng: random.Random, out: Path) -> Case | SceneCase:
    """A checkpoint in one of its uses."""
    use = rng.choice(("inspect", "evaluate", "evaluate", "plugin"))
    if use == "inspect":
        return Case([bases.program, "inspect", out])
    if use == "plugin":
        return plugin(bases, folder, SCENE.format(config=config(checkpoint=out)))
    flags = rng.choice(
        ([], ["--engine", "candle"], ["--engine", "fused-f16"], ["--start", "estimate"], ["--solver", "dopri5"])
    )
    return Case([bases.program, "evaluate", "--checkpoint", out, "--data", bases.data, *flags])


def card(bases: Bases, folder: Path, rng: random.Random) -> Case | SceneCase:
    """Values of card.json; mostly without its digest, which would find the change first."""
    out = _checkpoint(bases, folder, rng)
    _without_digest(rng, out / "card.json")
    odd.in_json(rng, out / "card.json", SIZES)
    return _use(bases, folder, rng, out)


def _without_digest(rng: random.Random, path: Path) -> None:
    if rng.random() < 0.8:
        whole = json.loads(path.read_text())
        whole.pop("card_sha256", None)
        path.write_text(json.dumps(whole))


def released(bases: Bases, folder: Path, rng: random.Random) -> Case | SceneCase:
    """Card of a released checkpoint: its encoding by links, added mass, torques of joints, kinematics, water."""
    out = folder / "checkpoint"
    shutil.copytree(ROOT / "models" / rng.choice(RELEASED), out)
    _without_digest(rng, out / "card.json")
    odd.in_json(rng, out / "card.json", RICH)
    if rng.random() < 0.3:
        return Case([bases.program, "inspect", out])
    scene = (ROOT / "mjcf/b1_swim.xml").read_text()
    return plugin(bases, folder, scene.replace('value="models/b1-task2"', f'value="{out}"'))


def weights(bases: Bases, folder: Path, rng: random.Random) -> Case | SceneCase:
    """weights.safetensors torn, with a card that vouches for it."""
    out = _checkpoint(bases, folder, rng)
    path = out / "weights.safetensors"
    content = _tensors(rng, path.read_bytes())
    path.write_bytes(content)
    whole = json.loads((out / "card.json").read_text())
    whole["weights_sha256"] = hashlib.sha256(content).hexdigest()
    whole.pop("card_sha256", None)
    (out / "card.json").write_text(json.dumps(whole))
    return _use(bases, folder, rng, out)


def _tensors(rng: random.Random, content: bytes) -> bytes:
    """A safetensors file with a wrong header, or torn."""
    if rng.random() < 0.5:
        return odd.torn(rng, content)
    size = int.from_bytes(content[:8], "little")
    header = odd.json_bytes(rng, json.loads(content[8 : 8 + size]), ("shape", "data_offsets"))
    return len(header).to_bytes(8, "little") + header + content[8 + size :]


def manifest(bases: Bases, folder: Path, rng: random.Random) -> Case:
    """Values of manifest.json, of a data set that is described, trained on or evaluated."""
    data = folder / "data"
    shutil.copytree(bases.data, data)
    odd.in_json(rng, data / "manifest.json", ("samples", "trajectories", "splits", "sample_period"))
    return _data_use(bases, folder, rng, data)


def shard(bases: Bases, folder: Path, rng: random.Random) -> Case:
    """A shard torn, with a manifest that vouches for it."""
    data = folder / "data"
    shutil.copytree(bases.data, data)
    split = rng.choice(("train", "val", "test"))
    path = data / f"{split}-00000-of-00001.safetensors"
    content = _tensors(rng, path.read_bytes())
    path.write_bytes(content)
    whole = json.loads((data / "manifest.json").read_text())
    whole["splits"][split]["shards"][0]["sha256"] = hashlib.sha256(content).hexdigest()
    (data / "manifest.json").write_text(json.dumps(whole))
    return _data_use(bases, folder, rng, data)


def _train(bases: Bases, data: Path, out: Path, *flags: object) -> Case:
    short = ("--hidden=8", "--epochs=1", "--batch=4", "--horizon=20")
    return Case([bases.program, "train", "--data", data, "--out", out, *short, *flags], may_run_on=True)


def _data_use(bases: Bases, folder: Path, rng: random.Random, data: Path) -> Case:
    use = rng.choice(("inspect", "evaluate", "train"))
    if use == "inspect":
        return Case([bases.program, "inspect", data])
    if use == "evaluate":
        return Case([bases.program, "evaluate", "--checkpoint", bases.checkpoints / rng.choice(MODELS), "--data", data])
    return _train(bases, data, folder / "out", "--model", rng.choice(MODELS))


FLAGS = (
    "hidden", "window", "modes", "memory", "heads", "embedding", "latent", "epochs", "batch", "horizon",
    "learning-rate", "patience", "trajectories", "seed", "solver", "adjoint", "encoding", "control", "device",
    "name", "preset",
)  # fmt: skip

NUMBERS = (
    "hidden",
    "window",
    "modes",
    "memory",
    "heads",
    "embedding",
    "latent",
    "epochs",
    "batch",
    "horizon",
    "patience",
    "trajectories",
    "seed",
)


def flags(bases: Bases, folder: Path, rng: random.Random) -> Case:
    """Values of the flags of `hydro train`."""
    model = rng.choice(MODELS)
    given = {name: rng.choice(odd.WORDS) for name in rng.sample(FLAGS, rng.choice((1, 1, 2, 3)))}
    for name in NUMBERS:
        if name in given and rng.random() < 0.8:
            given[name] = str(rng.choice(odd.SIZES))
    if "hidden" in given and rng.random() < 0.5:
        given["hidden"] = rng.choice(("8," * 5000 + "8", "4294967296,4294967296", "65536,65536", "1" + ",1" * 100))
    for name in ("solver", "adjoint", "encoding", "control", "device", "preset"):
        known = {
            "solver": ("euler", "rk4", "dopri5"),
            "adjoint": ("discrete", "continuous"),
            "encoding": ("up", "raw", "hydrodynamic", "links"),
        }
        if name in given and name in known and rng.random() < 0.7:
            given[name] = rng.choice(known[name])
    short = {"hidden": "8", "epochs": "1", "batch": "4", "horizon": "20", **given}
    words = [f"--{name}={value}" for name, value in short.items()]
    command = [bases.program, "train", "--data", bases.data, "--out", folder / "out", "--model", model, *words]
    return Case(command, may_run_on=True)


def _state_digest(state: str, header: dict, content: bytes) -> str:
    """Digest that a training state has of itself: of the header, then of names and tensors, each after its length."""
    tensors = sorted((name, about["data_offsets"]) for name, about in header.items() if name != "__metadata__")
    parts = [state.encode("utf-8", "surrogatepass")]
    for name, (start, end) in tensors:
        parts += [name.encode(), content[start:end]]
    return hashlib.sha256(b"".join(len(part).to_bytes(8, "little") + part for part in parts)).hexdigest()


def state(bases: Bases, folder: Path, rng: random.Random) -> Case:
    """The state of a run in progress, its digest right where its header was changed, then resumed."""
    model = rng.choice(MODELS)
    out = folder / "out"
    shutil.copytree(bases.checkpoints / f"{model}.run", folder / "out.run")
    path = folder / "out.run" / "state.safetensors"
    content = path.read_bytes()
    size = int.from_bytes(content[:8], "little")
    if rng.random() < 0.5:
        header = json.loads(content[8 : 8 + size])
        inner = json.loads(header["__metadata__"]["state"])
        state = json.dumps(odd.json_document(rng, inner, ("place", "optimiser_step", "config")))
        header["__metadata__"] |= {"state": state, "sha256": _state_digest(state, header, content[8 + size :])}
        text = json.dumps(header).encode("utf-8", "surrogatepass")
        path.write_bytes(len(text).to_bytes(8, "little") + text + content[8 + size :])
    else:
        path.write_bytes(_tensors(rng, content))
    from .bases import SIZES as sizes

    words = [*sizes[model], "--epochs=1", "--batch=4", "--horizon=20", "--resume"]
    return Case([bases.program, "train", "--data", bases.data, "--out", out, "--model", model, *words], may_run_on=True)


KINDS = {
    "card": card,
    "released card": released,
    "weights": weights,
    "manifest": manifest,
    "shard": shard,
    "train flags": flags,
    "training state": state,
}
