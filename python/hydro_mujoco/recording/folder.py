"""A growing data-set folder (`hydro-dataset/1`): its shards, finished ones, resuming.

While it grows the folder holds `generation.json`: the settings, and the sha256 of every finished
shard. `manifest.json` replaces it when all shards stand.
"""

import hashlib
import reprlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from safetensors import safe_open

from ..errors import DataError
from ..reading import read_json
from .files import sha256, write_beside, write_json
from .lock import locked
from .progress import Progress

SCHEMA = "hydro-dataset/1"
MANIFEST, GENERATION, LOCK = "manifest.json", "generation.json", ".lock"
SPLITS = ("train", "val", "test")


@dataclass(frozen=True)
class Shard:
    """`count` trajectories of `split`, the first of which is number `first`; file `index` of `of`."""

    split: str
    index: int
    of: int
    first: int
    count: int

    @property
    def file(self) -> str:
        """Name of its file."""
        return f"{self.split}-{self.index:05d}-of-{self.of:05d}.safetensors"


def share(total: int, shares: tuple[float, float, float]) -> dict[str, int]:
    """Number of trajectories by split; they sum to `total`."""
    edges = np.round(np.cumsum(shares) * total).astype(int)
    return dict(zip(SPLITS, (int(n) for n in np.diff([0, *edges[:2], total]))))


def cut(counts: dict[str, int], shard_size: int) -> list[Shard]:
    """Every shard of splits with `counts` trajectories, in order."""
    out = []
    for split, count in counts.items():
        of = -(-count // shard_size)
        out += [Shard(split, i, of, i * shard_size, min(shard_size, count - i * shard_size)) for i in range(of)]
    return out


def entries(counts: dict[str, int], made: list[Shard], hashes: dict[str, str]) -> dict:
    """The manifest's `splits`: trajectories and shards, with their sha256."""
    return {
        split: {
            "trajectories": count,
            "shards": [
                {"file": s.file, "trajectories": s.count, "sha256": hashes[s.file]} for s in made if s.split == split
            ],
        }
        for split, count in counts.items()
    }


def read(path: Path) -> dict:
    """A JSON object of such a folder."""
    try:
        value = read_json(path)
    except DataError as error:
        raise DataError(f"{error}; start again with --overwrite") from error
    if not isinstance(value, dict):
        raise DataError(f"{path}: expected a JSON object; start again with --overwrite")
    return value


def finished(
    out: Path, head: dict, plan: dict[str, int], unsaid: dict | None = None
) -> tuple[dict[str, str], list[float] | None]:
    """Shards recorded in `out` as (sha256 by file, noise std); refuses a folder made with other settings.

    unsaid: settings that hold where a head does not name them.
    """
    manifest, generation = out / MANIFEST, out / GENERATION
    if generation.is_file():
        found = read(generation)
        hashes, std = found.get("finished") or {}, found.get("perturbation_std")
        counts = found.get("planned")
    else:
        found = read(manifest)
        listed = found.get("files") or [
            entry for split in found.get("splits", {}).values() for entry in split["shards"]
        ]
        hashes = {entry["file"]: entry["sha256"] for entry in listed}
        counts = {entry["file"]: entry.get("trajectories", 1) for entry in listed}
        std = found.get("perturbation_std")
    found, head = (unsaid or {}) | found, (unsaid or {}) | head
    unlike = [key for key in head if found.get(key) != head[key]]
    if unlike:
        details = "; ".join(
            f"{key} was {reprlib.repr(found.get(key))}, now {reprlib.repr(head[key])}" for key in unlike[:3]
        )
        raise DataError(f"{out} was made with other settings ({details}): repeat them to resume, or --overwrite")
    if counts != plan:
        raise DataError(
            f"{out} was made with other --trials, --splits or --shard-size: repeat them to resume, or --overwrite"
        )
    return dict(hashes), std


@contextmanager
def working(out: Path) -> Iterator[None]:
    """Make the folder, and keep other processes from it."""
    if out.exists() and not out.is_dir():
        raise DataError(f"{out} is a file: choose a folder for --out")
    out.mkdir(parents=True, exist_ok=True)
    with locked(out / LOCK):
        yield


def check_free(out: Path, *, resume: bool, overwrite: bool) -> bool:
    """True where there is something to resume. Refuses to mix with what is there, and to resume what is no data set.

    Changes nothing. What a write that was cut off has left counts where neither is asked for.
    """
    held = sorted(path.name for path in out.iterdir() if path.name != LOCK)
    if held and not (resume or overwrite):
        shown = ", ".join(held[:3]) + (", ..." if len(held) > 3 else "")
        raise DataError(
            f"{out} is not empty ({shown}): pass --resume to finish it, --overwrite to replace it, "
            "or choose another --out"
        )
    if overwrite:
        return False
    held = [name for name in held if not name.endswith(".tmp")]
    if held and not ((out / MANIFEST).is_file() or (out / GENERATION).is_file()):
        raise DataError(
            f"{out} holds no {MANIFEST} or {GENERATION}, so there is nothing to resume: choose "
            "another --out, or --overwrite"
        )
    return bool(held)


def prepare(out: Path, *, resume: bool, overwrite: bool, files: tuple[str, ...] = ("*-of-*.safetensors",)) -> bool:
    """True where there is something to resume. Refuses to mix with what the folder holds.

    files: patterns of what --overwrite may delete, beside the manifest.
    """
    resumes = check_free(out, resume=resume, overwrite=overwrite)
    for leftover in out.glob("*.tmp"):
        leftover.unlink()
    if overwrite:
        for path in (*(path for pattern in files for path in out.glob(pattern)), out / MANIFEST, out / GENERATION):
            path.unlink(missing_ok=True)
    return resumes


def intact(out: Path, hashes: dict[str, str]) -> dict[str, str]:
    """Those of the recorded files that are there with the recorded bytes."""
    return {file: digest for file, digest in hashes.items() if (out / file).is_file() and sha256(out / file) == digest}


def drawn_again(out: Path, files: Iterable[str]) -> int:
    """Trajectories that shards say were unstable and drawn again."""
    total = 0
    for file in files:
        with safe_open(out / file, "numpy") as shard:
            total += int((shard.metadata() or {}).get("drawn_again", 0))
    return total


def complete(
    out: Path,
    head: dict,
    planned: dict[str, int],
    hashes: dict[str, str],
    results: Iterable[tuple[str, bytes]],
    closing: Callable[[dict[str, str]], dict],
    *,
    unit: str = "trajectories",
) -> dict:
    """Write the files that are missing as they come; returns the manifest, `head` and `closing(sha256 by file)`.

    planned: units by file, for the record and the progress; hashes: sha256 of the files that stand; results:
    (file, bytes) of all others, in any order.
    """
    hashes = dict(hashes)
    state = head | {"planned": planned, "finished": hashes}
    write_json(out / GENERATION, state)
    progress = Progress(sum(planned.values()), unit, done=sum(planned[file] for file in hashes))
    for file, content in results:
        write_beside(out / file, content)
        hashes[file] = hashlib.sha256(content).hexdigest()
        write_json(out / GENERATION, state)
        progress.advance(planned[file])
    manifest = head | closing(hashes)
    write_json(out / MANIFEST, manifest)
    (out / GENERATION).unlink()
    return manifest


def fill(
    out: Path,
    head: dict,
    planned: dict[str, int],
    make: Callable[[str], bytes],
    closing: Callable[[dict[str, str]], dict],
    *,
    resume: bool,
    overwrite: bool,
    files: tuple[str, ...] = ("*-of-*.safetensors",),
    unit: str = "trajectories",
) -> dict:
    """Make or finish a folder in this process, file by file, as `complete` does; returns its manifest.

    make: the bytes of a file.
    """
    with working(out):
        hashes: dict[str, str] = {}
        if prepare(out, resume=resume, overwrite=overwrite, files=files):
            hashes = intact(out, finished(out, head, planned)[0])
        results = ((file, make(file)) for file in planned if file not in hashes)
        return complete(out, head, planned, hashes, results, closing, unit=unit)
