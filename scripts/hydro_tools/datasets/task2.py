"""Trajectories of Task 2, one block at a time: the work that a worker does."""

from dataclasses import dataclass

import numpy as np
from safetensors.numpy import save

from . import plan, simulation
from .folder import Shard
from .proof import Proof
from .regime import Regime
from .scene import SAMPLE_PERIOD, Scene

#: Noise added at each step, as a share of the standard deviation of each clean component.
PERTURBATION = 0.1
#: Trajectories of the pilot that measures that deviation, whatever the size of the data set.
PILOT = 64
#: Trajectories simulated side by side; bounds memory, changes no number.
BLOCK = 50

SPLITS = {"train": plan.Stream.TRAIN, "val": plan.Stream.VAL, "test": plan.Stream.TEST}


def _record(scene: Scene, regime: Regime, seed: int, stream: int, first: int, count: int, samples: int):
    plans = [
        plan.task2(seed, stream, first + i, samples=samples, joint_range=scene.joint_range, regime=regime)
        for i in range(count)
    ]
    return plans, simulation.simulate(scene, plans)


def pilot_std(scene: Scene, regime: Regime, seed: int, samples: int) -> np.ndarray:
    """Standard deviation [6] of the clean wrench over PILOT trajectories of the regime that are in no split."""
    _, record = _record(scene, regime, seed, plan.Stream.PILOT, 0, PILOT, samples)
    return record.wrench.reshape(-1, 6).std(axis=0)


def shard_bytes(scene: Scene, regime: Regime, seed: int, shard: Shard, samples: int, noise_std: np.ndarray) -> bytes:
    """The shard as safetensors: x, wrench, wrench_clean, hydrostatic f32, time f32, condition i32.

    noise_std: standard deviation of the noise that is added to each component [6].
    """
    stream = SPLITS[shard.split]
    blocks = {name: [] for name in ("x", "wrench", "wrench_clean", "hydrostatic", "condition")}
    for first in range(shard.first, shard.first + shard.count, BLOCK):
        count = min(BLOCK, shard.first + shard.count - first)
        plans, record = _record(scene, regime, seed, stream, first, count, samples)
        noise = np.stack(
            [
                plan.generator(seed, plan.Stream.NOISE, stream, first + i, *regime.key).normal(size=(samples, 6))
                for i in range(count)
            ]
        )
        blocks["x"].append(record.x.astype(np.float32))
        blocks["wrench"].append((record.wrench + noise_std * noise).astype(np.float32))
        blocks["wrench_clean"].append(record.wrench.astype(np.float32))
        blocks["hydrostatic"].append(record.hydrostatic.astype(np.float32))
        blocks["condition"].append(np.stack([p.condition for p in plans]).astype(np.int32))
    tensors = {name: np.concatenate(parts) for name, parts in blocks.items()}
    tensors["time"] = (np.arange(samples) * SAMPLE_PERIOD).astype(np.float32)
    return save(tensors)


@dataclass(frozen=True)
class Maker:
    """Work of a fan-out: shard -> its bytes. It carries the compiled scene, so a worker needs no file.

    noise_std as in `shard_bytes`; proof: of `sample`, where workers may be other machines.
    """

    scene: Scene
    regime: Regime
    seed: int
    samples: int
    noise_std: np.ndarray
    proof: Proof | None = None

    def __call__(self, shard: Shard) -> bytes:
        if self.proof:
            self.proof.check(self.sample)
        return shard_bytes(self.scene, self.regime, self.seed, shard, self.samples, self.noise_std)

    def sample(self) -> bytes:
        """One trajectory, as a shard of its own: what a proof is made of."""
        return shard_bytes(self.scene, self.regime, self.seed, Shard("train", 0, 1, 0, 1), self.samples, self.noise_std)
