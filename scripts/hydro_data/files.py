"""Files that are whole or absent, and their fingerprints."""

import hashlib
import json
import os
from pathlib import Path


def write_beside(path: Path, content: bytes) -> None:
    """Write `content` to a temporary name, flush it to the disk, and rename: never half a file."""
    beside = path.with_name(path.name + ".tmp")
    try:
        with open(beside, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(beside, path)
    except OSError:
        beside.unlink(missing_ok=True)
        raise


def write_json(path: Path, value: object) -> None:
    """JSON with a stable layout, written by `write_beside`."""
    write_beside(path, (json.dumps(value, indent=1) + "\n").encode())


def sha256(path: Path) -> str:
    """Fingerprint of a file, read a piece at a time."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
