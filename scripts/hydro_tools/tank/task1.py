"""Trajectories of Task 1: features, the force of the water, and which condition each sample belongs to.

1.1  One constant condition, 100 samples: a window of a tow's steady part. `wrench` is what the tank
     measured, processed (see `processing`); `wrench_clean` the water's force at the same instants, which only
     a stand-in knows: what differs is the cell's error and what the low-pass takes.
1.2  Five conditions of ten samples, drawn from the 192. They are simulated with the strips of the
     tank, not joined from its means: after a switch the wakes and the drag's lag need their time, and
     the vortices go on (`motion.switching` says what is idealised). No cell, so `wrench` is the clean one.
1.3  The trajectories of 1.2 with white noise, a tenth of each clean force's standard deviation.

Features [4]: thigh and calf angle [rad] that the four legs share, velocity x and y [m/s] relative to
the water. Force x and y [N]. Base frame. Samples are 0.1 s apart: wakes take 0.3 to 4 s to pass the robot.
"""

from dataclasses import dataclass

import numpy as np

from hydro_mujoco import DataError
from hydro_mujoco.recording.folder import SPLITS, share
from hydro_mujoco.recording.randomness import generator

from . import force, motion
from .conditions import CONFIGURATIONS, COUNT, Condition
from .processing import Steady
from .recording import Run

FEATURES = ("position.thigh", "position.calf", "linear_velocity.x", "linear_velocity.y")
FEATURE_UNITS = ("rad", "rad", "m/s", "m/s")
OUTPUTS, OUTPUT_UNITS = ("force.x", "force.y"), ("N", "N")
FRAMES = {"wrench": "base", "linear_velocity": "base, relative to the water"}
#: Samples a trajectory, and seconds between them.
SAMPLES = {"1.1": 100, "1.2": 50, "1.3": 50}
PERIOD = 0.1
#: Conditions in a trajectory of 1.2 and 1.3; rows of the strips' simulation in a sample.
SWITCHED, SUBSTEPS = 5, 4
#: Noise of 1.3 over the standard deviation of each clean force; trajectories that measure the latter.
PERTURBATION, PILOT = 0.1, 64
#: Random streams.
ORDER, WINDOW, SWITCH, VORTICES, NOISE = 201, 202, 203, 204, 205
PILOT_SPLIT = len(SPLITS)
#: How trajectories are parted into splits.
BY = ("trajectory", "configuration")


@dataclass(frozen=True)
class Partition:
    """Which condition may occur in which split: seed, shares of train, val, test, and one of BY."""

    seed: int
    shares: tuple[float, float, float]
    by: str

    def _dealt(self, items: int, stream: int) -> dict[str, list[int]]:
        order = generator(self.seed, ORDER, stream).permutation(items)
        counts = share(items, self.shares)
        edges = np.cumsum([0, *counts.values()])
        return {split: [int(i) for i in order[a:b]] for split, a, b in zip(SPLITS, edges, edges[1:])}

    def configurations(self) -> dict[str, list[int]]:
        """Leg configurations of each split, disjoint, where trajectories are parted by them."""
        return self._dealt(CONFIGURATIONS, 0)

    def drawn(self) -> dict[str, list[int]]:
        """Conditions from which trajectories of 1.2 and 1.3 are drawn: all, or those of the split's configurations."""
        if self.by == "trajectory":
            return {split: list(range(COUNT)) for split in SPLITS}
        held = self.configurations()
        return {split: [c for c in range(COUNT) if Condition(c).configuration in held[split]] for split in SPLITS}

    def towed(self, trials: int) -> dict[str, list[tuple[int, int]]]:
        """Tows (condition, repeat) that make the trajectories of 1.1.

        All repeats of a condition stay in one split: its windows differ in noise alone.
        """
        once = min(trials, COUNT)
        if self.by == "trajectory":
            order = [int(c) for c in generator(self.seed, ORDER, 1).permutation(COUNT)[:once]]
            counts = share(once, self.shares)
            edges = np.cumsum([0, *counts.values()])
            held = {split: order[a:b] for split, a, b in zip(SPLITS, edges, edges[1:])}
        else:
            order = [int(c) for c in generator(self.seed, ORDER, 1).permutation(COUNT)[:once]]
            allowed = {split: set(conditions) for split, conditions in self.drawn().items()}
            held = {split: [c for c in order if c in allowed[split]] for split in SPLITS}
        rank = {condition: i for i, condition in enumerate(order)}
        return {
            split: [
                (c, repeat)
                for repeat in range(-(-trials // once))
                for c in conditions
                if repeat * once + rank[c] < trials
            ]
            for split, conditions in held.items()
        }


def constant(run: Run, part: Steady, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """A trajectory of 1.1 from a tow of a run; rng places its window."""
    samples, stride = SAMPLES["1.1"], round(PERIOD * run.rate)
    spare = len(part.time) - ((samples - 1) * stride + 1)
    if spare < 0:
        raise DataError(
            f"condition {part.condition.index}: its steady part lasts {len(part.time) / run.rate:.1f} s, "
            f"a trajectory {samples * PERIOD:g} s"
        )
    rows = int(rng.integers(spare + 1)) + stride * np.arange(samples)
    at = np.arange(len(run.truth)) / run.truth_rate
    clean = np.stack([np.interp(part.time[rows], at, run.truth[:, axis]) for axis in range(2)], axis=1)
    return {
        "x": np.tile(part.condition.features, (samples, 1)),
        "wrench": part.force[rows],
        "wrench_clean": clean,
        "condition": np.full(samples, part.condition.index),
    }


def switched(seed: int, split: int, index: int, pool: list[int]) -> dict[str, np.ndarray]:
    """Trajectory `index` of 1.2: SWITCHED different conditions out of `pool`."""
    if len(pool) < SWITCHED:
        raise DataError(
            f"a trajectory switches between {SWITCHED} conditions, this split has {len(pool)}: give it a larger share"
        )
    drawn = generator(seed, SWITCH, split, index).choice(pool, SWITCHED, replace=False)
    sequence = tuple(Condition(int(c)) for c in drawn)
    held = SAMPLES["1.2"] // SWITCHED
    path = motion.switching(sequence, samples=held, period=PERIOD, substeps=SUBSTEPS)
    clean = force.along(path, generator(seed, VORTICES, split, index)).total[::SUBSTEPS, :2]
    x = np.repeat([condition.features for condition in sequence], held, axis=0)
    return {"x": x, "wrench": clean, "wrench_clean": clean, "condition": np.repeat(drawn, held)}


def pilot_std(seed: int) -> np.ndarray:
    """Standard deviation [2] N of the clean force over PILOT trajectories that are in no split."""
    everything = list(range(COUNT))
    clean = [switched(seed, PILOT_SPLIT, i, everything)["wrench_clean"] for i in range(PILOT)]
    return np.concatenate(clean).std(axis=0)


def perturbed(trajectory: dict[str, np.ndarray], std: np.ndarray, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """The same with noise of `std` [2] N on every sample's force."""
    clean = trajectory["wrench_clean"]
    return trajectory | {"wrench": clean + std * rng.normal(size=clean.shape)}
