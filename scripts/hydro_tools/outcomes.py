"""Outcomes of a campaign, one JSON line each: what was done is not done again."""

import json
from pathlib import Path
from typing import TypeVar

Record = TypeVar("Record")


def read(path: Path, record: type[Record]) -> list[Record]:
    """Outcomes so far, of a dataclass; a last line that was cut short is left out."""
    found = []
    for line in path.read_text().splitlines() if path.is_file() else ():
        try:
            found.append(record(**json.loads(line)))
        except (json.JSONDecodeError, TypeError):
            continue
    return found
