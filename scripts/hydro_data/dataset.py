"""A data-set folder (`hydro-dataset/1`): shards by any executor, resume after a kill, manifest.

While it grows the folder holds `generation.json`: the settings, and the sha256 of every finished
shard. `manifest.json` replaces it when all shards stand. A shard depends on (seed, split, index of
its trajectories) alone, so a resumed folder has the bytes of an uninterrupted one.
"""

import hashlib
import json
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np

from fanout import FanoutError
from fanout.executor import Executor

from . import VERSION, DataError, features, scene, task2
from .files import sha256, write_beside, write_json
from .progress import Progress
from .proof import Proof

SCHEMA = "hydro-dataset/1"
MANIFEST, GENERATION = "manifest.json", "generation.json"


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
        edges = np.round(np.cumsum(self.splits) * self.trials).astype(int)
        return dict(zip(task2.SPLITS, (int(n) for n in np.diff([0, *edges[:2], self.trials]))))

    def shards(self) -> list[task2.Shard]:
        """Every shard, in order."""
        out = []
        for split, count in self.counts().items():
            of = -(-count // self.shard_size)
            out += [task2.Shard(split, i, of, i * self.shard_size, min(self.shard_size, count - i * self.shard_size))
                    for i in range(of)]
        return out


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


def _read(path: Path) -> dict:
    try:
        value = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: {error}; start again with --overwrite") from error
    if not isinstance(value, dict):
        raise DataError(f"{path}: expected a JSON object; start again with --overwrite")
    return value


def _finished(out: Path, head: dict, plan: dict[str, int]) -> tuple[dict[str, str], list[float] | None]:
    """Shards recorded in `out` as (sha256 by file, noise std); refuses a folder made with other settings."""
    manifest, generation = out / MANIFEST, out / GENERATION
    if generation.is_file():
        found = _read(generation)
        hashes, std = found.get("finished"), found.get("perturbation_std")
        counts = found.get("planned")
    elif manifest.is_file():
        found = _read(manifest)
        entries = [entry for split in found.get("splits", {}).values() for entry in split["shards"]]
        hashes = {entry["file"]: entry["sha256"] for entry in entries}
        counts = {entry["file"]: entry["trajectories"] for entry in entries}
        std = found.get("perturbation_std")
    else:
        raise DataError(f"{out} holds no {MANIFEST} or {GENERATION}, so there is nothing to resume: choose "
                        "another --out, or --overwrite")
    unlike = [key for key in head if found.get(key) != head[key]]
    if unlike:
        details = "; ".join(f"{key} was {found.get(key)!r}, now {head[key]!r}" for key in unlike[:3])
        raise DataError(f"{out} was made with other settings ({details}): repeat them to resume, or --overwrite")
    if counts != plan:
        raise DataError(f"{out} was made with other --trials, --splits or --shard-size: repeat them to resume, "
                        "or --overwrite")
    return dict(hashes), std


def prepare(out: Path, *, resume: bool, overwrite: bool) -> bool:
    """Make the folder; True where there is something to resume. Refuses to mix with what it holds."""
    if out.exists() and not out.is_dir():
        raise DataError(f"{out} is a file: choose a folder for --out")
    out.mkdir(parents=True, exist_ok=True)
    for leftover in out.glob("*.tmp"):
        if resume or overwrite:
            leftover.unlink()
    held = sorted(path.name for path in out.iterdir())
    if held and not (resume or overwrite):
        shown = ", ".join(held[:3]) + (", ..." if len(held) > 3 else "")
        raise DataError(f"{out} is not empty ({shown}): pass --resume to finish it, --overwrite to replace it, "
                        "or choose another --out")
    if overwrite:
        for path in (*out.glob("*-of-*.safetensors"), out / MANIFEST, out / GENERATION):
            path.unlink(missing_ok=True)
        return False
    return bool(held)


def generate(settings: Settings, out: Path, *, executor: Executor, resume: bool = False,
             overwrite: bool = False) -> dict:
    """Make or finish the data set; returns its manifest."""
    loaded = scene.load(settings.model)
    head = _head(settings, loaded)
    shards = settings.shards()
    planned = {shard.file: shard.count for shard in shards}
    hashes: dict[str, str] = {}
    std = None
    if prepare(out, resume=resume, overwrite=overwrite):
        recorded, std = _finished(out, head, planned)
        hashes = {file: digest for file, digest in recorded.items()
                  if (out / file).is_file() and sha256(out / file) == digest}
    if std is None:
        std = [float(s) for s in task2.PERTURBATION * task2.pilot_std(loaded, settings.seed, settings.samples)]
    state = head | {"perturbation_std": std, "planned": planned, "finished": hashes}
    write_json(out / GENERATION, state)

    missing = {shard.file: shard for shard in shards if shard.file not in hashes}
    maker = task2.Maker(loaded, settings.seed, settings.samples, np.array(std))
    if executor.other_machines:
        maker = replace(maker, proof=Proof.of(maker.sample()))
    progress = Progress(settings.trials, "trajectories", done=settings.trials - sum(s.count for s in missing.values()))
    # The one place that writes: workers may be machines without this folder.
    try:
        with closing(executor.run(maker, missing)) as finished:
            for file, content in finished:
                write_beside(out / file, content)
                hashes[file] = hashlib.sha256(content).hexdigest()
                write_json(out / GENERATION, state)
                progress.advance(missing[file].count)
    except FanoutError as error:
        raise DataError(f"{error}; finished shards are kept: go on with --resume") from error

    counts = settings.counts()
    manifest = head | {
        "perturbation_std": std,
        "splits": {
            split: {
                "trajectories": counts[split],
                "shards": [{"file": s.file, "trajectories": s.count, "sha256": hashes[s.file]}
                           for s in shards if s.split == split],
            }
            for split in task2.SPLITS
        },
    }
    write_json(out / MANIFEST, manifest)
    (out / GENERATION).unlink()
    return manifest
