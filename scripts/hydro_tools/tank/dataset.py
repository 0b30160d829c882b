"""The data sets of Task 1: folders `hydro-dataset/1` for `hydro train`.

A trajectory depends on (seed, split, index), on what is drawn for a split, and (1.1) on the tank's
runs alone, so an interrupted folder that is resumed has the bytes of one made in one go.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from safetensors.numpy import save

from hydro_mujoco import DataError
from hydro_mujoco.recording import folder
from hydro_mujoco.recording.folder import SCHEMA, SPLITS, Shard
from hydro_mujoco.recording.randomness import generator

from . import VERSION, campaign, processing, task1
from .conditions import Condition

#: Trajectories by default: every condition once, and sequences of five of them.
TRIALS = {"1.1": 192, "1.2": 2000, "1.3": 2000}


@dataclass(frozen=True)
class Settings:
    """Everything that determines the bytes of one data set."""

    task: str
    trials: int
    seed: int
    splits: tuple[float, float, float]
    by: str
    shard_size: int

    @property
    def partition(self) -> task1.Partition:
        """Content of each split."""
        return task1.Partition(self.seed, self.splits, self.by)

    def tows(self) -> set[tuple[int, int]]:
        """Runs (repeat, number) of the tank that it needs: none but for 1.1."""
        if self.task != "1.1":
            return set()
        held = self.partition.towed(self.trials)
        return {(repeat, Condition(condition).run) for tows in held.values() for condition, repeat in tows}

    def counts(self) -> dict[str, int]:
        """Trajectories by split; refuses a split that is to have a share and gets nothing."""
        if self.task == "1.1":
            counts = {split: len(tows) for split, tows in self.partition.towed(self.trials).items()}
        else:
            counts = folder.share(self.trials, self.splits)
        empty = [split for split, part in zip(SPLITS, self.splits) if part > 0 and counts[split] == 0]
        if empty:
            raise DataError(
                f"task {self.task}: {self.trials} trajectories leave {', '.join(empty)} without any; "
                "raise --trials, or give it no share by --splits"
            )
        return counts


def _head(settings: Settings, more: dict) -> dict:
    return {
        "schema": SCHEMA,
        "name": f"task{settings.task}",
        "features": list(task1.FEATURES),
        "feature_units": list(task1.FEATURE_UNITS),
        "outputs": list(task1.OUTPUTS),
        "output_units": list(task1.OUTPUT_UNITS),
        "frames": task1.FRAMES,
        "sample_period": task1.PERIOD,
        "samples": task1.SAMPLES[settings.task],
        "seed": settings.seed,
        "generator": f"gen_task1.py {VERSION}",
        "numpy": np.__version__,
        "source": "strip theory, a stand-in for a towing tank: nothing is measured",
        "task": settings.task,
        "split_by": settings.by,
        **more,
    }


def _shard_bytes(samples: int, trajectories: list[dict[str, np.ndarray]]) -> bytes:
    """The shard as safetensors: x, wrench, wrench_clean, hydrostatic f32, time f32, condition i32."""
    tensors = {
        name: np.stack([t[name] for t in trajectories]).astype(np.float32) for name in ("x", "wrench", "wrench_clean")
    }
    # Zeroed at rest, the cell shows nothing of gravity and buoyancy.
    tensors["hydrostatic"] = np.zeros_like(tensors["wrench"])
    tensors["condition"] = np.stack([t["condition"] for t in trajectories]).astype(np.int32)
    tensors["time"] = (np.arange(samples) * task1.PERIOD).astype(np.float32)
    return save(tensors)


def _constant(settings: Settings, tank: Path) -> Callable[[str, int], dict[str, np.ndarray]]:
    """Makes trajectory (split, index) of 1.1 from the tank's files."""
    towed = settings.partition.towed(settings.trials)
    hashes = {entry["file"]: entry["sha256"] for entry in campaign.manifest(tank)["files"]}

    def make(split: str, index: int) -> dict[str, np.ndarray]:
        condition, repeat = towed[split][index]
        run = campaign.checked(tank, campaign.file_name(repeat, Condition(condition).run), hashes)
        part = next(part for part in processing.steady(run) if part.condition.index == condition)
        return task1.constant(run, part, generator(settings.seed, task1.WINDOW, condition, repeat))

    return make


def _switched(settings: Settings, std: np.ndarray) -> Callable[[str, int], dict[str, np.ndarray]]:
    """Makes trajectory (split, index) of 1.2, and of 1.3 where `std` is not zero."""
    pools = settings.partition.drawn()

    def make(split: str, index: int) -> dict[str, np.ndarray]:
        number = SPLITS.index(split)
        trajectory = task1.switched(settings.seed, number, index, pools[split])
        return (
            task1.perturbed(trajectory, std, generator(settings.seed, task1.NOISE, number, index))
            if std.any()
            else trajectory
        )

    return make


def generate(settings: Settings, out: Path, tank: Path, *, resume: bool = False, overwrite: bool = False) -> dict:
    """Make or finish the data set of one task; 1.1 reads the runs in `tank`. Returns its manifest."""
    counts = settings.counts()
    shards = {shard.file: shard for shard in folder.cut(counts, settings.shard_size)}
    std = np.zeros(len(task1.OUTPUTS))
    if settings.task == "1.1":
        more = {"tank_sha256": campaign.fingerprint(tank)}
        make = _constant(settings, tank)
    else:
        if settings.task == "1.3":
            std = task1.PERTURBATION * task1.pilot_std(settings.seed)
        more = {"perturbation": task1.PERTURBATION if std.any() else 0.0, "perturbation_std": [float(s) for s in std]}
        make = _switched(settings, std)
    if settings.by == "configuration":
        more["configurations"] = settings.partition.configurations()

    def content(file: str) -> bytes:
        shard: Shard = shards[file]
        made = [make(shard.split, shard.first + i) for i in range(shard.count)]
        return _shard_bytes(task1.SAMPLES[settings.task], made)

    return folder.fill(
        out,
        _head(settings, more),
        {file: shard.count for file, shard in shards.items()},
        content,
        lambda hashes: {"splits": folder.entries(counts, list(shards.values()), hashes)},
        resume=resume,
        overwrite=overwrite,
    )
