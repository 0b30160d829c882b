"""Hostile inputs of the plugin and of URDF, and files that are no files: pipes, devices, folders, odd names."""

import functools
import os
import random
import shutil
from pathlib import Path

from ..soak import catalogue
from . import odd
from .bases import EFFECTS, SCENE, Bases, gap_flags
from .learning import config, plugin
from .running import Case, SceneCase

ATTRIBUTES = (
    "checkpoint",
    "effects",
    "density",
    "waterline",
    "current",
    "joints",
    "solver",
    "engine",
    "initial_force",
    "wrench_scale",
)


@functools.cache
def _catalogue() -> tuple[dict, ...]:
    """Every effect of the catalogue with typical values, on the parts of the scene."""
    parts = {"hull": "hull", "fin": "fin", "hinge": "thigh", "tail": "fin"}
    return tuple(each.entry() | {"target": parts[each.target]} for each in catalogue.effects())


def effects(bases: Bases, folder: Path, rng: random.Random) -> SceneCase:
    """Named effects in an MJCF."""
    some = {**EFFECTS, "effects": rng.sample(_catalogue(), rng.choice((1, 1, 2, 3)))}
    document = some if rng.random() < 0.7 else EFFECTS
    text = odd.json_bytes(rng, document, ("parameters", "parameters")).decode("utf-8", "replace").replace("\0", "")
    if rng.random() < 0.3:
        path = folder / "effects.json"
        path.write_text(text)
        return plugin(bases, folder, SCENE.format(config=config(effects=path)))
    return plugin(bases, folder, SCENE.format(config=config(effects=text)))


def attributes(bases: Bases, folder: Path, rng: random.Random) -> SceneCase:
    """Attributes of the plugin."""
    given: dict = {"checkpoint": bases.checkpoints / rng.choice(("attention-ode", "mlp", "cnode"))}
    for name in rng.sample(ATTRIBUTES, rng.choice((1, 1, 2, 3))):
        words = [rng.choice(odd.WORDS) for _ in range(rng.choice((1, 1, 3, 6, 1000)))]
        given[name] = " ".join(words) if rng.random() < 0.8 else rng.choice(odd.TEXTS).replace("\0", "")
    return plugin(bases, folder, SCENE.format(config=config(**given)))


def scene(bases: Bases, folder: Path, rng: random.Random) -> SceneCase:
    """Numbers of a scene with a checkpoint: time steps, sizes, gravity."""
    whole = SCENE.format(config=config(checkpoint=bases.checkpoints / "attention-ode", density=1000))
    if rng.random() < 0.3:
        step = rng.choice(("1e-300", "1e-9", "1e300", "10", "0.1", "0.0033", "1e-5"))
        return plugin(bases, folder, whole.replace('timestep="0.002"', f'timestep="{step}"'))
    return plugin(bases, folder, odd.text(rng, whole))


def _arm(links: int, joint: str) -> str:
    mass = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    parts = [f'<link name="l{i}">{mass}</link>' for i in range(links + 1)]
    parts += [joint.format(i=i, parent=i, child=i + 1) for i in range(links)]
    return "<robot name='arm'>" + "".join(parts) + "</robot>"


_FIXED = '<joint name="j{i}" type="fixed"><parent link="l{parent}"/><child link="l{child}"/></joint>'


def urdf(bases: Bases, folder: Path, rng: random.Random) -> Case:
    """A robot: deep, in loops, with links twice, with impossible numbers."""
    path, change = folder / "robot.urdf", rng.random()
    if change < 0.1:
        whole = _arm(rng.choice((100, 3000)), _FIXED)
    elif change < 0.2:
        ring = '<joint name="back" type="fixed"><parent link="l3"/><child link="l0"/></joint></robot>'
        whole = _arm(3, _FIXED).replace("</robot>", ring)
    elif change < 0.25:
        whole = _arm(3, _FIXED).replace('name="l2"', 'name="l1"', 1)
    elif change < 0.35:
        whole = "<robot name='deep'>" + "<link>" * rng.choice((1000, 100_000)) + "</robot>"
    elif change < 0.4:
        whole = '<!DOCTYPE r [<!ENTITY a "aaaaaaaaaa">]>' + _arm(2, _FIXED)
    elif change < 0.9:
        whole = odd.text(rng, bases.urdf.read_text())
    else:
        whole = odd.torn(rng, bases.urdf.read_bytes())
    odd.put(path, whole)
    return Case([bases.program, "inspect", path])


#: Inputs by the file that is replaced: folder copied, file in it, command.
_USES = (
    "card",
    "weights",
    "manifest",
    "shard",
    "trial",
    "archive",
    "nominal",
    "uncertainty",
    "effect",
    "urdf",
    "rollouts",
    "stage",
    "state",
)


def _command(bases: Bases, folder: Path, use: str) -> tuple[Path, list]:
    """A sound input copied, the file of it to be replaced, and the command that reads it."""
    program, case = bases.program, folder / "case"
    if use in ("card", "weights"):
        shutil.copytree(bases.checkpoints / "mlp", case)
        name = {"card": "card.json", "weights": "weights.safetensors"}[use]
        return case / name, [program, "evaluate", "--checkpoint", case, "--data", bases.data]
    if use in ("manifest", "shard"):
        shutil.copytree(bases.data, case)
        name = {"manifest": "manifest.json", "shard": "test-00000-of-00001.safetensors"}[use]
        return case / name, [program, "evaluate", "--checkpoint", bases.checkpoints / "mlp", "--data", case]
    if use == "effect":
        shutil.copytree(bases.own_effects, case)
        return case / "tether.toml", [program, "gap", "effects", "--effects", case]
    if use == "urdf":
        case.mkdir()
        shutil.copy(bases.urdf, case / "robot.urdf")
        return case / "robot.urdf", [program, "inspect", case / "robot.urdf"]
    if use == "rollouts":
        shutil.copytree(bases.rollouts, case)
        return case / "rollout-000.npz", [program, "inspect", case]
    if use == "stage":
        shutil.copytree(bases.results, case)
        return case / "find.json", [program, "gap", "report", "--out", case]
    if use == "state":
        shutil.copytree(bases.checkpoints / "mlp.run", folder / "out.run")
        flags = ["--model", "mlp", "--hidden=8", "--epochs=1", "--batch=4", "--horizon=20", "--resume"]
        return folder / "out.run/state.safetensors", [
            program,
            "train",
            "--data",
            bases.data,
            "--out",
            folder / "out",
            *flags,
        ]
    shutil.copytree(bases.gap, case)
    files = {
        "trial": "trials/t0.csv",
        "archive": "archives/t0.npz",
        "nominal": "nominal.xml",
        "uncertainty": "uncertainty.toml",
    }
    trials = "archives" if use == "archive" else "trials"
    flags = ["--uncertainty", case / "uncertainty.toml"] if use == "uncertainty" else []
    return case / files[use], [program, "gap", "find", *gap_flags(case, trials, folder / "out"), *flags]


def special(bases: Bases, folder: Path, rng: random.Random) -> Case:
    """A pipe, a device, a folder, a loop of links, an empty or a huge sparse file in place of a file."""
    path, command = _command(bases, folder, rng.choice(_USES))
    path.unlink()
    change = rng.choice(
        ("pipe", "zero", "null", "folder", "loop", "dangling", "empty", "sparse", "full", "random", "closed")
    )
    if change == "pipe":
        os.mkfifo(path)
    elif change == "folder":
        path.mkdir()
    elif change == "empty":
        path.touch()
    elif change == "sparse":
        with open(path, "wb") as file:
            file.truncate(rng.choice((2**31, 2**34, 2**40)))
    elif change == "closed":
        path.write_text("x")
        path.chmod(0)
    else:
        target = {
            "loop": path.name,
            "dangling": "nowhere",
            "zero": "/dev/zero",
            "null": "/dev/null",
            "full": "/dev/full",
            "random": "/dev/urandom",
        }
        path.symlink_to(target[change])
    return Case(command, may_run_on=False)


def names(bases: Bases, folder: Path, rng: random.Random) -> Case | SceneCase:
    """Folders whose names are no UTF-8, hold line breaks, or are long; everything in them is sound."""
    name = rng.choice(
        (
            b"caf\xe9",
            b"\xff\xfe",
            b"a\nb",
            b"-x",
            b" ",
            b"n" * 250,
            "ünïcödé".encode(),
            b"$(x)`y`",
            b"a'b\"c",
            b"%s%n{}",
        )
    )
    place = Path(os.fsdecode(os.fsencode(folder) + b"/" + name))
    place.mkdir()
    use = rng.choice(("train", "evaluate", "inspect", "find", "run", "plugin"))
    if use == "train":
        flags = ["--model", "mlp", "--hidden=8", "--epochs=1", "--batch=4", "--horizon=20"]
        return Case([bases.program, "train", "--data", bases.data, "--out", place / "out", *flags])
    if use in ("find", "run"):
        shutil.copytree(bases.gap, place / "case")
        return Case([bases.program, "gap", use, *gap_flags(place / "case", "trials", place / "out")], may_run_on=True)
    shutil.copytree(bases.checkpoints / "mlp", place / "model")
    if use == "plugin":
        # MuJoCo's XML is UTF-8: the attribute holds what the name is in it.
        text = os.fsencode(place / "model").decode("utf-8", "replace")
        return plugin(bases, folder, SCENE.format(config=config(checkpoint=text)))
    words = {"evaluate": ["--checkpoint", place / "model", "--data", bases.data], "inspect": [place / "model"]}
    return Case([bases.program, use, *words[use]])


KINDS = {"effects": effects, "attributes": attributes, "scene": scene, "urdf": urdf, "no file": special, "names": names}
