"""A data set: its shards by any executor, resume after a kill, manifest.

A shard depends on the recorder and on (split, index of its trajectories) alone, so a resumed folder has the bytes of an
uninterrupted one.
"""

from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..errors import DataError
from ..jobs import JobError
from ..jobs.executor import Executor
from .folder import check_free, complete, cut, drawn_again, entries, finished, intact, prepare, share, working
from .proof import Proof
from .shards import Maker, Recorder


@dataclass(frozen=True)
class Size:
    """How many trajectories there are, in which splits and files."""

    trials: int
    splits: tuple[float, float, float]
    shard_size: int

    def counts(self) -> dict[str, int]:
        """Trajectories by split; they sum to `trials`."""
        return share(self.trials, self.splits)

    def missing(self) -> list[str]:
        """Splits that are asked for and have no trajectory: too few trials."""
        return [split for (split, count), part in zip(self.counts().items(), self.splits) if part > 0 and not count]


def empty_splits(size: Size) -> str:
    """What is to be said of splits without a trajectory, or ""."""
    empty = size.missing()
    if not empty:
        return ""
    uses = {"train": "nothing can be trained", "val": "training cannot tell when to stop", "test": "no error is known"}
    return f"split {' and '.join(empty)} of {size.trials} trajectories is empty: " + ", ".join(uses[s] for s in empty)


def generate(
    recorder: Recorder,
    size: Size,
    head: Callable[[], dict],
    out: Path,
    *,
    noise_std: Callable[[], np.ndarray],
    executor: Executor,
    resume: bool = False,
    overwrite: bool = False,
    unsaid: Mapping[str, object] | None = None,
) -> dict:
    """Make or finish the data set; returns its manifest.

    head: the manifest without what only a finished data set knows, asked for where the folder can be used; unsaid:
    settings that hold where a head does not name them. noise_std: standard deviation of the noise on each component,
    asked for where the folder has none.
    """
    with working(out):
        # Before the head, which may take long; and nothing is deleted before the head is known.
        check_free(out, resume=resume, overwrite=overwrite)
        known = head()
        shards = cut(size.counts(), size.shard_size)
        planned = {shard.file: shard.count for shard in shards}
        hashes: dict[str, str] = {}
        std = None
        if prepare(out, resume=resume, overwrite=overwrite):
            recorded, std = finished(out, known, planned, unsaid=dict(unsaid or {}))
            hashes = intact(out, recorded)
        if std is None:
            std = [float(s) for s in noise_std()]

        maker = Maker(recorder, np.array(std))
        if executor.other_machines:
            maker = replace(maker, proof=Proof.from_bytes(maker.sample()))
        missing = {shard.file: shard for shard in shards if shard.file not in hashes}

        def last(hashes: dict[str, str]) -> dict:
            again = drawn_again(out, hashes)
            return {"splits": entries(size.counts(), shards, hashes)} | ({"drawn_again": again} if again else {})

        # Workers may be machines without this folder: only this process writes.
        try:
            with closing(executor.run(maker, missing)) as results:
                return complete(out, known | {"perturbation_std": std}, planned, hashes, results, last)
        except JobError as error:
            raise DataError(f"{error}; finished shards are kept: go on with --resume") from error
