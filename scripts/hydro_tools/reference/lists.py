"""The lists that the program prints."""

import json
import subprocess
from pathlib import Path
from typing import Any

from hydro_mujoco.errors import DataError

#: Arguments of a list -> its schema.
SCHEMAS = {
    ("gap", "effects"): "hydro-gap-effects/1",
    ("attributes",): "hydro-attributes/1",
}


def read_list(program: Path, command: tuple[str, ...]) -> dict[str, Any]:
    """What `hydro COMMAND --json` prints.

    Raises:
        DataError: the program is not there, fails, or prints another schema.
    """
    words = [str(program), *command, "--json"]
    try:
        done = subprocess.run(words, capture_output=True, text=True, check=False)
    except OSError as error:
        raise DataError(f"{program}: {error.strerror}; build it with `cargo build --release`") from error
    shown = " ".join(words)
    if done.returncode:
        raise DataError(f"`{shown}` failed: {done.stderr.strip() or f'status {done.returncode}'}")
    try:
        found = json.loads(done.stdout)
    except ValueError as error:
        raise DataError(f"`{shown}` printed no JSON: {error}") from error
    schema = found.get("schema") if isinstance(found, dict) else None
    if schema != SCHEMAS[command]:
        raise DataError(f"`{shown}`: its schema is {schema!r}, expected {SCHEMAS[command]!r}")
    return found
