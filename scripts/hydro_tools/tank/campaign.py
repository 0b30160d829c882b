"""All runs of the tank as files: raw traces, and the table of processed forces.

A folder (`hydro-towing/1`): `run-NNN.npz`, number repeat * 64 + run, with the arrays of `recording.Run`
(`numpy.load` opens them); `conditions.csv`, one line a tow; `manifest.json` with the seed, every
parameter of the tank and each file's sha256.
"""

import csv
import io
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import scipy

from hydro_mujoco import DataError
from hydro_mujoco.reading import check
from hydro_mujoco.recording import folder
from hydro_mujoco.recording.files import npz_bytes, sha256, write_beside

from . import VERSION, cell, conditions, motion, processing, recording, shedding, wake
from .drag import DENSITY, VISCOSITY
from .force import LAG, LAG_SPEED, LAGGING, STIRRING

SCHEMA = "hydro-towing/1"
TABLE = "conditions.csv"
#: Largest file of a run [byte].
LARGEST = 1 << 30
COLUMNS = (
    "condition",
    "repeat",
    "run",
    "configuration",
    "direction",
    "speed",
    "thigh",
    "calf",
    "velocity_x",
    "velocity_y",
    "force_x",
    "force_y",
    "spread_x",
    "spread_y",
    "error_x",
    "error_y",
)


def file_name(repeat: int, run: int) -> str:
    """File name of a run."""
    return f"run-{repeat * conditions.RUNS + run:03d}.npz"


def _head(seed: int) -> dict:
    """Everything that determines the bytes of every run."""
    return {
        "schema": SCHEMA,
        "generator": f"gen_task1.py {VERSION}",
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "seed": seed,
        "frame": "base",
        "rate": cell.RATE,
        "step": recording.STEP,
        "water": {"density": DENSITY, "viscosity": VISCOSITY, "stirring": STIRRING},
        "conditions": {
            "speeds": list(conditions.SPEEDS),
            "directions": list(conditions.DIRECTIONS),
            "thighs": list(conditions.THIGHS),
            "calves": list(conditions.CALVES),
        },
        "tow": {
            "rest": motion.REST,
            "settle": motion.SETTLE,
            "ramp": motion.RAMP,
            "start_up": motion.START_UP,
            "steady": motion.STEADY,
        },
        "wakes": {"cap": wake.CAP, "drift": wake.DRIFT, "lagging": LAGGING, "lag": LAG, "lag_speed": LAG_SPEED},
        "vortices": {"lift": shedding.LIFT, "damping": shedding.DAMPING},
        "cell": {
            "wet_weight": cell.WET_WEIGHT,
            "zero": cell.ZERO,
            "misalignment": cell.MISALIGNMENT,
            "drift_rate": cell.DRIFT_RATE,
            "drift_walk": cell.DRIFT_WALK,
            "noise": cell.NOISE,
            "vibration": cell.VIBRATION,
            "vibration_band": list(cell.VIBRATION_BAND),
        },
    }


def _run_bytes(run: recording.Run) -> bytes:
    return npz_bytes(
        {
            "reading": run.reading.astype(np.float32),
            "rate": np.float64(run.rate),
            "condition": run.condition,
            "marks": run.marks,
            "rest": np.float64(run.rest),
            "truth": run.truth.astype(np.float32),
            "truth_rate": np.float64(run.truth_rate),
        }
    )


def read(path: Path) -> recording.Run:
    """A run from its file."""
    try:
        check(path, most=LARGEST)
        with np.load(path, allow_pickle=False) as arrays:
            held = dict(arrays)
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: {error}; tow again with --overwrite") from error
    names = tuple(recording.Run.__dataclass_fields__)
    missing = [name for name in names if name not in held]
    if missing:
        raise DataError(f"{path} lacks {', '.join(missing)}; it holds {', '.join(held)}")
    values = {name: float(held[name]) if held[name].ndim == 0 else held[name] for name in names}
    return recording.Run(**values | {"reading": values["reading"].astype(float)})


def tow(
    out: Path, seed: int, runs: Iterable[tuple[int, int]], *, resume: bool = False, overwrite: bool = False
) -> None:
    """Record the runs, each given as (repeat, run), into the folder `out`, and write the table."""
    numbers = {file_name(*each): each for each in sorted(runs)}
    folder.fill(
        out,
        _head(seed),
        dict.fromkeys(numbers, 1),
        lambda file: _run_bytes(recording.tow(seed, *numbers[file])),
        lambda hashes: {"files": [{"file": file, "sha256": hashes[file]} for file in numbers]},
        resume=resume,
        overwrite=overwrite,
        files=("run-*.npz", TABLE),
        unit="runs of the tank",
    )
    write_beside(out / TABLE, _table(out, numbers).encode())


def _table(out: Path, numbers: dict[str, tuple[int, int]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    # One cell: its random walk is estimated from all runs together.
    intensity = float(np.mean([processing.walk(read(out / file)) for file in numbers]))
    for file, (repeat, number) in numbers.items():
        for part in processing.steady(read(out / file), intensity):
            condition, stance = part.condition, part.condition.stance
            writer.writerow(
                [
                    condition.index,
                    repeat,
                    number,
                    condition.configuration,
                    stance.direction,
                    condition.speed,
                    stance.thigh,
                    stance.calf,
                    *(f"{v:.9g}" for v in condition.features[2:]),
                    *(f"{v:.6g}" for values in (part.mean, part.spread, part.error) for v in values),
                ]
            )
    return text.getvalue()


def checked(out: Path, file: str, hashes: dict[str, str]) -> recording.Run:
    """A run whose bytes are those of the manifest."""
    if file not in hashes or not (out / file).is_file() or sha256(out / file) != hashes[file]:
        raise DataError(f"{out / file}: missing, or not what {folder.MANIFEST} says; finish the tank with --resume")
    return read(out / file)


def manifest(out: Path) -> dict:
    """The manifest of a finished tank."""
    if not (out / folder.MANIFEST).is_file():
        raise DataError(f"{out} holds no {folder.MANIFEST}: the tank was not towed to its end; go on with --resume")
    return folder.read(out / folder.MANIFEST)


def fingerprint(out: Path) -> str:
    """sha256 of the manifest, which holds that of every run."""
    manifest(out)
    return sha256(out / folder.MANIFEST)
