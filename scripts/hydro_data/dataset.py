"""The Task 2 data set: shards by worker processes, resume after a kill, manifest.

A shard depends on (seed, split, index of its trajectories) alone, so a resumed folder has the bytes
of an uninterrupted one.
"""

import multiprocessing
import os
import threading
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing.connection import wait
from pathlib import Path

import mujoco
import numpy as np

from . import VERSION, DataError, features, scene, task2
from .files import write_json
from .folder import GENERATION, MANIFEST, SCHEMA, Shard, cut, entries, finished, intact, prepare, share
from .progress import Progress


@dataclass(frozen=True)
class Settings:
    """What determines the bytes of a data set."""

    name: str
    trials: int
    seed: int
    samples: int
    splits: tuple[float, float, float]
    shard_size: int
    model: str

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
    }


_SCENE: scene.Scene | None = None


def _worker_start(model: str) -> None:
    """Load the scene once a process; die with the parent, however it dies."""
    global _SCENE
    _SCENE = scene.load(model)
    parent = multiprocessing.parent_process()

    def follow() -> None:
        wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


def _worker_shard(folder: Path, seed: int, shard: Shard, samples: int, noise_std: np.ndarray) -> str:
    return task2.write_shard(_SCENE, folder, seed, shard, samples, noise_std)


def generate(settings: Settings, out: Path, *, workers: int, resume: bool = False, overwrite: bool = False) -> dict:
    """Make or finish the data set; returns its manifest."""
    loaded = scene.load(settings.model)
    head = _head(settings, loaded)
    shards = settings.shards()
    planned = {shard.file: shard.count for shard in shards}
    hashes: dict[str, str] = {}
    std = None
    if prepare(out, resume=resume, overwrite=overwrite):
        recorded, std = finished(out, head, planned)
        hashes = intact(out, recorded)
    if std is None:
        std = [float(s) for s in task2.PERTURBATION * task2.pilot_std(loaded, settings.seed, settings.samples)]
    state = head | {"perturbation_std": std, "planned": planned, "finished": hashes}
    write_json(out / GENERATION, state)

    missing = [shard for shard in shards if shard.file not in hashes]
    progress = Progress(settings.trials, "trajectories", done=settings.trials - sum(s.count for s in missing))
    for shard, digest in _make(settings, out, loaded, missing, np.array(std), workers):
        hashes[shard.file] = digest
        write_json(out / GENERATION, state)
        progress.advance(shard.count)

    manifest = head | {"perturbation_std": std, "splits": entries(settings.counts(), shards, hashes)}
    write_json(out / MANIFEST, manifest)
    (out / GENERATION).unlink()
    return manifest


def _make(settings: Settings, out: Path, loaded: scene.Scene, missing: list[Shard], noise_std: np.ndarray,
          workers: int):
    """Yield (shard, sha256) as shards are written."""
    if workers == 1:
        for shard in missing:
            yield shard, task2.write_shard(loaded, out, settings.seed, shard, settings.samples, noise_std)
        return
    pool = ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn"),
                               initializer=_worker_start, initargs=(settings.model,))
    try:
        jobs = {pool.submit(_worker_shard, out, settings.seed, shard, settings.samples, noise_std): shard
                for shard in missing}
        for job in as_completed(jobs):
            yield jobs[job], job.result()
    except BrokenProcessPool as error:
        raise DataError("a worker process was killed; finished shards are kept: go on with --resume") from error
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
