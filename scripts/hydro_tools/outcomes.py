"""Outcomes of a campaign, one JSON line each: what was done is not done again."""

import json
from pathlib import Path
from typing import TypeVar

from hydro_mujoco.reading import read_text

Record = TypeVar("Record")


def read(path: Path, record: type[Record]) -> list[Record]:
    """Outcomes so far, of a dataclass; a last line that was cut short is left out."""
    found = []
    for line in read_text(path).splitlines() if path.exists() else ():
        try:
            found.append(record(**json.loads(line)))
        except (json.JSONDecodeError, TypeError):
            continue
    return found
