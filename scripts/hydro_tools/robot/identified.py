"""The fluid coefficients that `real_to_sim.py` identified from towing data: `identified.json` beside this file.

    {"schema": "hydro-identified/1", "coefficients": {part: [blunt, slender, angular, Kutta, Magnus]}, "from": {...}}

`from` says of which data and by which command. The water's density is that of the scenes.
"""

import json
from math import isfinite
from pathlib import Path

from .hull import FLUID_COEFFICIENTS

SCHEMA = "hydro-identified/1"
FILE = Path(__file__).with_name("identified.json")


def read(path: Path = FILE) -> dict[str, tuple[float, ...]]:
    """`fluidcoef` by part; ValueError where the file is not what it should be."""
    again = "write it again with `python scripts/real_to_sim.py --write`"
    try:
        held = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ValueError(f"{path.name}: {error}; {again}") from error
    if not isinstance(held, dict) or held.get("schema") != SCHEMA:
        raise ValueError(f"{path.name}: expected an object with the schema {SCHEMA}; {again}")
    found = held.get("coefficients")
    if not isinstance(found, dict) or set(found) != set(FLUID_COEFFICIENTS):
        raise ValueError(f"{path.name}: expected coefficients of {', '.join(FLUID_COEFFICIENTS)}; {again}")
    for part, values in found.items():
        if not (
            isinstance(values, list)
            and len(values) == 5
            and all(isinstance(v, (int, float)) and isfinite(v) and v >= 0 for v in values)
        ):
            raise ValueError(f"{path.name}: {part} has {values}, expected five numbers that are not negative; {again}")
    return {part: tuple(float(v) for v in found[part]) for part in FLUID_COEFFICIENTS}
