"""Drive a scene, whatever its water, with the start, controls and pushes of a recorded rollout."""

from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np

from hydro_mujoco.plugin import WRENCH

from ..repository import ROOT
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
            folder = Path(config.get("checkpoint", "")) if checkpoint is None else checkpoint
            # The plugin cannot know where the scene stands: it is given an absolute path.
            if config.get("checkpoint") and not folder.is_absolute():
                folder = next((place for base in (Path.cwd(), ROOT) if (place := base / folder).is_dir()), folder)
            if config.get("checkpoint"):
                config["checkpoint"] = str(folder)
            plugin.config = config
        model = spec.compile()
    except ValueError as error:
        raise DataError(f"{path}: {error}") from error
    if not plugins:
        scene.set_density(model, density)
    return model


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
