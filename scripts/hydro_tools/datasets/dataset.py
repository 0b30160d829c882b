"""The Task 2 data set: shards by any executor, resume after a kill, manifest.

A shard depends on (seed, regime, split, index of its trajectories) alone, so a resumed folder has the bytes
of an uninterrupted one.
"""

from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np

from hydro_tools.jobs import JobError
from hydro_tools.jobs.executor import Executor

from . import VERSION, DataError, features, kinematics, scene, task2
from .folder import SCHEMA, Shard, complete, cut, entries, finished, intact, prepare, share
from .proof import Proof
from .regime import USUAL, Regime


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

    def counts(self) -> dict[str, int]:
        """Trajectories by split; they sum to `trials`."""
        return share(self.trials, self.splits)

    def shards(self) -> list[Shard]:
        """Every shard, in order."""
        return cut(self.counts(), self.shard_size)


def _head(settings: Settings, loaded: scene.Scene) -> dict:
    """The manifest without what only a finished data set knows."""
    return {
        "schema": SCHEMA,
        "name": settings.name,
        "features": features.names(loaded.joints),
        "feature_units": features.units(loaded.joints),
        "outputs": list(features.OUTPUTS),
        "output_units": list(features.OUTPUT_UNITS),
        "frames": features.FRAMES,
        "kinematics": kinematics.tree(loaded),
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


def generate(
    settings: Settings, out: Path, *, executor: Executor, resume: bool = False, overwrite: bool = False
) -> dict:
    """Make or finish the data set; returns its manifest."""
    loaded = scene.load(settings.model)
    head = _head(settings, loaded)
    shards = settings.shards()
    planned = {shard.file: shard.count for shard in shards}
    hashes: dict[str, str] = {}
    std = None
    if prepare(out, resume=resume, overwrite=overwrite):
        recorded, std = finished(out, head, planned, unsaid={"regime": USUAL.name})
        hashes = intact(out, recorded)
    if std is None:
        std = [
            float(s)
            for s in task2.PERTURBATION * task2.pilot_std(loaded, settings.regime, settings.seed, settings.samples)
        ]

    maker = task2.Maker(loaded, settings.regime, settings.seed, settings.samples, np.array(std))
    if executor.other_machines:
        maker = replace(maker, proof=Proof.from_bytes(maker.sample()))
    missing = {shard.file: shard for shard in shards if shard.file not in hashes}
    # Workers may be machines without this folder: only this process writes.
    try:
        with closing(executor.run(maker, missing)) as results:
            return complete(
                out,
                head | {"perturbation_std": std},
                planned,
                hashes,
                results,
                lambda hashes: {"splits": entries(settings.counts(), shards, hashes)},
            )
    except JobError as error:
        raise DataError(f"{error}; finished shards are kept: go on with --resume") from error
