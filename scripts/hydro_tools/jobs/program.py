"""A job that is a command line: run in a folder of its own, what it leaves there comes back, packed.

The program and what it reads must be on the nodes, at the paths that the command line names.
"""

import io
import os
import subprocess
import tarfile
import tempfile
from dataclasses import dataclass
from pathlib import Path

from hydro_mujoco.jobs import JobError

#: Stands for the folder in a command line.
HERE = "{here}"
#: Lines of a failed program's last words that are told.
LAST_LINES = 3


@dataclass(frozen=True)
class Job:
    """A command line, and the packed files that its folder holds when it begins."""

    words: list[str]
    files: bytes | None = None


@dataclass(frozen=True)
class Program:
    """Work for an executor; `environment` is added to the node's own."""

    environment: tuple[tuple[str, str], ...] = ()

    def __call__(self, job: Job) -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            if job.files is not None:
                unpack(job.files, Path(folder))
            command = [word.replace(HERE, folder) for word in job.words]
            try:
                done = subprocess.run(
                    command,
                    env=os.environ | dict(self.environment),
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.PIPE,
                    text=True,
                    check=False,
                )
            except OSError as error:
                raise JobError(f"{command[0]}: {error.strerror} on this node") from error
            if done.returncode:
                last = " / ".join(done.stderr.strip().splitlines()[-LAST_LINES:])
                raise JobError(f"exit status {done.returncode}: {last}")
            return packed(Path(folder))


def packed(folder: Path, below: str = "") -> bytes:
    """The files below a folder, or those of them that stand below `below`, in the order of their names."""
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w") as archive:
        for path in sorted((folder / below).rglob("*")):
            if path.is_file():
                archive.add(path, arcname=str(path.relative_to(folder)), recursive=False)
    return out.getvalue()


def unpack(content: bytes, folder: Path) -> list[Path]:
    """Write packed files below a folder, each beside and renamed; returns them."""
    written = []
    with tarfile.open(fileobj=io.BytesIO(content)) as archive:
        for member in archive.getmembers():
            path = (folder / member.name).resolve()
            if not member.isfile() or folder.resolve() not in path.parents:
                raise JobError(f"packed files hold {member.name!r}, which is no file below the folder")
            path.parent.mkdir(parents=True, exist_ok=True)
            beside = path.with_name(path.name + ".part")
            beside.write_bytes(archive.extractfile(member).read())
            beside.replace(path)
            written.append(path)
    return written
