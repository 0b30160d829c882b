"""Raw blocks of a part on disk, `<part>.json`; the page is made from these alone."""

import json
from pathlib import Path

from . import BenchmarkError

SCHEMA = "hydro-bench/1"


def _short(value):
    """Nine digits are more than a clock has, and single precision needs no more."""
    match value:
        case float() if value == float(f"{value:.9g}") or not value.is_integer():
            return float(f"{value:.9g}")
        case dict():
            return {key: _short(each) for key, each in value.items()}
        case list() | tuple():
            return [_short(each) for each in value]
    return value


def write(folder: Path, part: str, groups: dict, *, quick: bool, stamp: dict) -> None:
    """One part's file, the older one replaced."""
    folder.mkdir(parents=True, exist_ok=True)
    content = {"schema": SCHEMA, "part": part, "quick": quick, **stamp, "groups": _short(groups)}
    (folder / f"{part}.json").write_text(json.dumps(content, separators=(",", ":")) + "\n")


def read(folder: Path, parts) -> dict[str, dict]:
    """The parts that are there, in the order of `parts`."""
    found = {}
    for part in parts:
        path = folder / f"{part}.json"
        if path.is_file():
            record = json.loads(path.read_text())
            if record.get("schema") != SCHEMA:
                raise BenchmarkError(f"{path}: schema {record.get('schema')!r}, this program reads {SCHEMA!r}")
            found[part] = record
    return found
