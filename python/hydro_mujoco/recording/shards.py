"""The bytes of one shard, a block of trajectories at a time: the work that a worker does."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from safetensors.numpy import save

from ..errors import DataError
from .folder import Shard
from .plan import Plan, Stream
from .proof import Proof
from .simulation import Recording
from .system import System

#: Trajectories simulated side by side; bounds memory, changes no number.
BLOCK = 50

#: Trajectories of a shard that may be drawn again, as a share of it, beside one.
TOO_OFTEN = 0.5

SPLITS = {"train": Stream.TRAIN, "val": Stream.VAL, "test": Stream.TEST}


class Recorder(Protocol):
    """Makes the plans of a data set; it can be pickled, and what it draws depends on its arguments alone."""

    @property
    def system(self) -> System:
        """The model."""
        ...

    @property
    def samples(self) -> int:
        """Of a trajectory."""
        ...

    @property
    def attempts(self) -> int:
        """How often a trajectory is drawn before it is given up."""
        ...

    def plan(self, stream: int, index: int, attempt: int) -> Plan:
        """What happens in a trajectory."""
        ...

    def noise(self, stream: int, index: int) -> np.random.Generator:
        """Random numbers of its noise."""
        ...

    def simulate(self, plans: Sequence[Plan]) -> Recording:
        """What the plans lead to."""
        ...


def record(
    recorder: Recorder, stream: int, first: int, count: int, *, drawn_again: list[str]
) -> tuple[list[Plan], Recording]:
    """Trajectories `first` to `first + count`. Unstable ones are drawn again; why, one each, goes to `drawn_again`."""
    plans = [recorder.plan(stream, first + i, 0) for i in range(count)]
    recording = recorder.simulate(plans)
    for attempt in range(1, recorder.attempts):
        unstable = np.flatnonzero(recording.fault)
        if not unstable.size:
            break
        drawn_again.extend(recording.fault[unstable])
        again = [recorder.plan(stream, first + int(i), attempt) for i in unstable]
        recording.put(unstable, recorder.simulate(again))
        for i, plan in zip(unstable, again):
            plans[i] = plan
    left = np.flatnonzero(recording.fault)
    if left.size:
        what = "diverged" if recorder.attempts == 1 else f"is unstable in each of {recorder.attempts} draws"
        raise DataError(
            f"trajectory {first + left[0]} {what} ({recording.fault[left[0]]}); nothing was written for this shard"
        )
    return plans, recording


def shard_bytes(recorder: Recorder, shard: Shard, noise_std: np.ndarray) -> bytes:
    """The shard as safetensors: x, wrench, wrench_clean, hydrostatic f32, time f32, condition i32, and the
    recording's extra arrays f32.

    noise_std: standard deviation of the noise that is added to each component of the wrench. `hydrostatic` is there
    where buoyancy is known. The metadata's `drawn_again` counts trajectories drawn again, where there are any.
    """
    stream, system, samples = SPLITS[shard.split], recorder.system, recorder.samples
    outputs = list(system.outputs)
    blocks: dict[str, list[np.ndarray]] = {
        name: [] for name in ("x", "wrench", "wrench_clean", "hydrostatic", "condition")
    }
    drawn_again: list[str] = []
    for first in range(shard.first, shard.first + shard.count, BLOCK):
        count = min(BLOCK, shard.first + shard.count - first)
        plans, recording = record(recorder, stream, first, count, drawn_again=drawn_again)
        wrench, hydrostatic = (np.take(values, outputs, -1) for values in (recording.wrench, recording.hydrostatic))
        noise = np.stack([recorder.noise(stream, first + i).normal(size=(samples, len(outputs))) for i in range(count)])
        blocks["x"].append(recording.x.astype(np.float32))
        blocks["wrench"].append((wrench + noise_std * noise).astype(np.float32))
        blocks["wrench_clean"].append(wrench.astype(np.float32))
        blocks["hydrostatic"].append(hydrostatic.astype(np.float32))
        blocks["condition"].append(np.stack([plan.condition for plan in plans]).astype(np.int32))
        for name, values in recording.extra.items():
            blocks.setdefault(name, []).append(values.astype(np.float32))
    if not system.knows_buoyancy:
        del blocks["hydrostatic"]
    if len(drawn_again) > TOO_OFTEN * shard.count + 1:
        raise DataError(
            f"{len(drawn_again)} of {len(drawn_again) + shard.count} trajectories are unstable, for example: "
            f"{drawn_again[0]}; give the model a smaller timestep or integrator implicitfast, or drive it less hard "
            "(--effort 0.3)"
        )
    # `save` takes the memory as it lies, whatever the strides.
    tensors = {name: np.ascontiguousarray(np.concatenate(parts)) for name, parts in blocks.items()}
    tensors["time"] = (np.arange(samples) * system.sample_period).astype(np.float32)
    return save(tensors, {"drawn_again": str(len(drawn_again))} if drawn_again else None)


def deviation(recordings: Sequence[Recording], outputs: Sequence[int]) -> np.ndarray:
    """Standard deviation of each component of the clean wrench, over all samples."""
    clean = np.concatenate([np.take(recording.wrench, outputs, -1) for recording in recordings])
    return clean.reshape(-1, len(outputs)).std(axis=0)


@dataclass(frozen=True)
class Maker:
    """Work of a fan-out: shard -> its bytes. It carries the compiled model, so a worker needs no file.

    noise_std as in `shard_bytes`; proof: of `sample`, where workers may be other machines.
    """

    recorder: Recorder
    noise_std: np.ndarray
    proof: Proof | None = None

    def __call__(self, shard: Shard) -> bytes:
        if self.proof:
            self.proof.check(self.sample)
        return shard_bytes(self.recorder, shard, self.noise_std)

    def sample(self) -> bytes:
        """One trajectory, as a shard of its own: what a proof is made of."""
        return shard_bytes(self.recorder, Shard("train", 0, 1, 0, 1), self.noise_std)
