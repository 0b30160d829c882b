"""Trajectories of Task 2, one block at a time: the work that a worker process does."""

import hashlib
from pathlib import Path

import numpy as np
from safetensors.numpy import save

from . import plan, simulation
from .files import write_beside
from .folder import Shard
from .scene import SAMPLE_PERIOD, Scene

#: Noise added at each step, as a share of the standard deviation of each clean component.
PERTURBATION = 0.1
#: Trajectories of the pilot that measures that deviation, whatever the size of the data set.
PILOT = 64
#: Trajectories simulated side by side; bounds memory, changes no number.
BLOCK = 50

SPLITS = {"train": plan.Stream.TRAIN, "val": plan.Stream.VAL, "test": plan.Stream.TEST}


def _record(scene: Scene, seed: int, stream: int, first: int, count: int, samples: int):
    plans = [plan.task2(seed, stream, first + i, samples=samples, joint_range=scene.joint_range) for i in range(count)]
    return plans, simulation.simulate(scene, plans)


def pilot_std(scene: Scene, seed: int, samples: int) -> np.ndarray:
    """Standard deviation [6] of the clean wrench over PILOT trajectories that are in no split."""
    _, record = _record(scene, seed, plan.Stream.PILOT, 0, PILOT, samples)
    return record.wrench.reshape(-1, 6).std(axis=0)


def shard_bytes(scene: Scene, seed: int, shard: Shard, samples: int, noise_std: np.ndarray) -> bytes:
    """The shard as safetensors: x, wrench, wrench_clean, hydrostatic f32, time f32, condition i32.

    noise_std: standard deviation of the noise that is added to each component [6].
    """
    stream = SPLITS[shard.split]
    blocks = {name: [] for name in ("x", "wrench", "wrench_clean", "hydrostatic", "condition")}
    for first in range(shard.first, shard.first + shard.count, BLOCK):
        count = min(BLOCK, shard.first + shard.count - first)
        plans, record = _record(scene, seed, stream, first, count, samples)
        noise = np.stack([plan.generator(seed, plan.Stream.NOISE, stream, first + i).normal(size=(samples, 6))
                          for i in range(count)])
        blocks["x"].append(record.x.astype(np.float32))
        blocks["wrench"].append((record.wrench + noise_std * noise).astype(np.float32))
        blocks["wrench_clean"].append(record.wrench.astype(np.float32))
        blocks["hydrostatic"].append(record.hydrostatic.astype(np.float32))
        blocks["condition"].append(np.stack([p.condition for p in plans]).astype(np.int32))
    tensors = {name: np.concatenate(parts) for name, parts in blocks.items()}
    tensors["time"] = (np.arange(samples) * SAMPLE_PERIOD).astype(np.float32)
    return save(tensors)


def write_shard(scene: Scene, folder: Path, seed: int, shard: Shard, samples: int, noise_std: np.ndarray) -> str:
    """Make the shard, write it beside its name and rename it; returns its sha256."""
    content = shard_bytes(scene, seed, shard, samples, noise_std)
    write_beside(folder / shard.file, content)
    return hashlib.sha256(content).hexdigest()

