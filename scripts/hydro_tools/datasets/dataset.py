"""The Task 2 data set: B1's head of the manifest, and its recorder."""

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from hydro_mujoco.jobs.executor import Executor
from hydro_mujoco.recording import dataset, kinematics
from hydro_mujoco.recording.features import FRAMES, OUTPUT_UNITS, OUTPUTS
from hydro_mujoco.recording.folder import SCHEMA

from . import VERSION, DataError, plan, scene, task2
from .regime import USUAL, Regime
from .waters import ELLIPSOID, Water


@dataclass(frozen=True)
class Settings:
    """Everything that determines the bytes of a data set."""

    name: str
    trials: int
    seed: int
    samples: int
    splits: tuple[float, float, float]
    shard_size: int
    model: str
    regime: Regime = USUAL
    water: Water = ELLIPSOID
    switch: str = plan.MIXED

    @property
    def size(self) -> dataset.Size:
        """How many trajectories, in which splits and files."""
        return dataset.Size(self.trials, self.splits, self.shard_size)


def _tree(loaded: scene.Scene) -> dict:
    """The links of the robot: its hulls."""
    base = loaded.model.body(scene.BASE).id
    try:
        return kinematics.tree(loaded.model, base, kinematics.hulls(loaded.model, base))
    except DataError as error:
        raise DataError(f"model {loaded.path}: {error}") from error


def _head(settings: Settings, loaded: scene.Scene, recorder: task2.Task2) -> dict:
    """The manifest without what only a finished data set knows."""
    head = {
        "schema": SCHEMA,
        "name": settings.name,
        "features": loaded.layout.names(),
        "feature_units": loaded.layout.units(),
        "outputs": list(OUTPUTS),
        "output_units": list(OUTPUT_UNITS),
        "frames": FRAMES,
        "kinematics": _tree(loaded),
        "sample_period": scene.SAMPLE_PERIOD,
        "physics_timestep": loaded.model.opt.timestep,
        "samples": settings.samples,
        "seed": settings.seed,
        "generator": f"gen_task2.py {VERSION}",
        "mujoco": mujoco.__version__,
        "numpy": np.__version__,
        "model": settings.model,
        "model_sha256": loaded.sha256,
        "perturbation": task2.PERTURBATION,
    } | settings.regime.recorded()
    head |= {} if settings.switch == plan.MIXED else {"switch": settings.switch}
    if water := settings.water.recorded():
        head |= water | {
            "added_mass_share": recorder.added_mass_share().tolist(),
            "generalised": ["force.x", "force.y", "force.z", *OUTPUTS[3:], *loaded.joints],
        }
    return head


def generate(
    settings: Settings, out: Path, *, executor: Executor, resume: bool = False, overwrite: bool = False
) -> dict:
    """Make or finish the data set; returns its manifest."""
    loaded = scene.load(settings.model)
    recorder = task2.Task2(loaded, settings.regime, settings.seed, settings.samples, settings.water, settings.switch)
    return dataset.generate(
        recorder,
        settings.size,
        lambda: _head(settings, loaded, recorder),
        out,
        noise_std=lambda: task2.PERTURBATION * recorder.pilot_std(),
        executor=executor,
        resume=resume,
        overwrite=overwrite,
        unsaid={"regime": USUAL.name, "switch": plan.MIXED, "water": ELLIPSOID.name},
    )
