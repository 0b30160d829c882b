"""`hydro gap run` on one hidden-effect case."""

import os
import subprocess
from pathlib import Path

from hydro_mujoco import DataError
from hydro_mujoco.reading import read_json


def run(program: Path, case: Path, out: Path, limit: float, threads: int) -> str | None:
    """One case on so many threads; returns what went wrong."""
    log, known = out.with_suffix(".log"), out.with_suffix(".toml")
    # How well the nominal is known stands in the open half of a case.
    try:
        uncertainty = read_json(case / "case.json").get("uncertainty", {})
    except DataError as error:
        return str(error)
    known.write_text("".join(f"{name} = {deviation}\n" for name, deviation in uncertainty.items()))
    command = [
        program,
        "gap",
        "run",
        "--model",
        case / "nominal.xml",
        "--trials",
        case / "trials",
        "--out",
        out,
        "--uncertainty",
        known,
    ]
    environment = os.environ | {"RAYON_NUM_THREADS": str(threads)}
    with open(log, "w") as file:
        try:
            code = subprocess.run(
                command, stdout=file, stderr=subprocess.STDOUT, timeout=limit, check=False, env=environment
            ).returncode
        except subprocess.TimeoutExpired:
            return f"{case.name}: no verdict within {limit:g} s, see {log}"
    return None if code == 0 else f"{case.name}: exit status {code}, see {log}"
