"""Drive a scene, whatever its water, with the start, controls and pushes of a recorded rollout."""

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np

from hydro_mujoco.plugin import WRENCH
from hydro_mujoco.reading import read_json

from ..repository import ROOT
from ..strip_water import forces, simulation, strips
from . import DataError, scene

#: Sensor that the plugin fills: force and torque in the base frame.
WRENCH_SENSOR = "water_wrench"


def compile_scene(path: str, *, density: float, checkpoint: Path | None = None) -> mujoco.MjModel:
    """The scene in water of `density` kg/m^3: the plugin's where the scene names one, else MuJoCo's own."""
    file = scene.find(path)
    try:
        spec = mujoco.MjSpec.from_file(str(file))
        plugins = [plugin for plugin in spec.plugins if plugin.plugin_name == WRENCH]
        for plugin in plugins:
            config = dict(plugin.config) | {"density": repr(float(density))}
            if config.get("checkpoint"):
                config["checkpoint"] = str(_folder(config["checkpoint"] if checkpoint is None else checkpoint))
            plugin.config = config
        model = spec.compile()
    except ValueError as error:
        raise DataError(f"{path}: {error}") from error
    if not plugins:
        scene.set_density(model, density)
    return model


def _folder(checkpoint: str | Path) -> Path:
    """An absolute path, where it can be found: the plugin cannot know where the scene stands."""
    folder = Path(checkpoint)
    if folder.is_absolute():
        return folder
    return next((place for base in (Path.cwd(), ROOT) if (place := base / folder).is_dir()), folder)


def water_of(path: str, checkpoint: Path | None = None) -> dict | None:
    """The water that the checkpoint of a scene was trained in, as its card says; None for MuJoCo's own."""
    file = scene.find(path)
    try:
        # MuJoCo reads a plugin's attributes only where the plugin is loaded.
        plugins = [node for node in ElementTree.parse(file).iter("plugin") if node.get("plugin") == WRENCH]
    except ElementTree.ParseError as error:
        raise DataError(f"{path}: {error}") from error
    configs = [config for node in plugins for config in node.iter("config") if config.get("key") == "checkpoint"]
    named = next((value for config in configs if (value := config.get("value"))), None)
    if named is None:
        return None
    return read_json(_folder(checkpoint or named) / "card.json").get("water")


def replay_in_strips(loaded: scene.Scene, run: dict[str, np.ndarray]) -> Iterator[mujoco.MjData]:
    """As `replay`, in the truth of strips. A recording holds no wakes: they begin as in steady motion."""
    sim = simulation.Simulation(simulation.dry(loaded.model), forces.water(loaded.model, strips.b1()), 1)
    sim.density[:] = run["density"]
    base, (data,) = loaded.model.body(scene.BASE).id, sim.datas
    data.qpos[:], data.qvel[:] = run["qpos"][0], run["qvel"][0]
    sim.settle([0])
    yield data
    for ctrl, push in zip(run["ctrl"], run["push"]):
        data.ctrl[:], data.xfrc_applied[base] = ctrl, push
        for _ in range(loaded.system.substeps):
            sim.step([0])
        yield data


def replay(model: mujoco.MjModel, run: dict[str, np.ndarray], sample_period: float) -> Iterator[mujoco.MjData]:
    """Yield the state (one MjData, changed in place) at each sample of the run, the start included."""
    base = model.body(scene.BASE).id
    substeps = round(sample_period / model.opt.timestep)
    data = mujoco.MjData(model)
    if model.nq != run["qpos"].shape[1] or model.nu != run["ctrl"].shape[1]:
        raise DataError(
            f"the scene has {model.nq} positions and {model.nu} controls, the rollout "
            f"{run['qpos'].shape[1]} and {run['ctrl'].shape[1]}"
        )
    data.qpos[:], data.qvel[:] = run["qpos"][0], run["qvel"][0]
    yield data
    for ctrl, push in zip(run["ctrl"], run["push"]):
        data.ctrl[:], data.xfrc_applied[base] = ctrl, push
        mujoco.mj_step(model, data, substeps)
        yield data
