"""Trials in memory as the files that `hydro gap` reads."""

import os
import shutil
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np

from ..errors import DataError
from ..reading import opened
from ..recording.files import npz_bytes, sha256

#: Dimensions of the arrays of a trial: those that it must have, those that it may have.
REQUIRED = {"control_times": 1, "control_data": 2, "sensordata_times": 1, "sensordata_data": 2}
OPTIONAL = {"initial_state": 1, "state_times": 1, "state_data": 2}
MAPPINGS = ("control_signal_mapping", "sensordata_signal_mapping", "state_signal_mapping")
#: Largest file of each format [byte] (crates/gap/src/trial).
LARGEST = {".npz": 1 << 33, ".csv": 1 << 32}


@runtime_checkable
class SavesToDisk(Protocol):
    """A `mujoco.sysid.SystemTrajectory`."""

    def save_to_disk(self, path: Path) -> None:
        """Write the npz."""


#: A file, a trajectory of mujoco.sysid, or the arrays of one by the names in its npz.
Trial = str | os.PathLike[str] | SavesToDisk | Mapping[str, Any]
#: Of one call: a folder; or several, with names of their own or in order.
Trials = str | os.PathLike[str] | Iterable[Trial] | Mapping[str, Trial]


def write(trials: Iterable[Trial] | Mapping[str, Trial], folder: Path, *, overwrite: bool) -> None:
    """Write trials into a folder, whole or not at all; the same trials give the same bytes.

    Raises:
        DataError: a trial is at fault, or the folder holds others and `overwrite` is False.
    """
    named = _named(trials)
    try:
        _write(named, folder, overwrite)
    except OSError as error:
        raise DataError(f"{folder} cannot be written: {error}") from error


def _write(named: Mapping[str, Trial], folder: Path, overwrite: bool) -> None:
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f"{folder.name}.", dir=folder.parent) as beside:
        made = Path(beside, folder.name)
        made.mkdir()
        for name, trial in named.items():
            _write_one(name, trial, made)
        if folder.exists():
            if _contents(folder) == _contents(made):
                return
            if not overwrite:
                raise DataError(f"{folder} holds other trials; overwrite=True replaces them, or choose another out")
            shutil.rmtree(folder)
        os.replace(made, folder)


def _named(trials: Iterable[Trial] | Mapping[str, Trial]) -> dict[str, Trial]:
    if isinstance(trials, Mapping):
        if REQUIRED.keys() & trials.keys():
            raise DataError("trials is one trial's arrays; expected a list of trials, a dict of them, or a folder")
        named = dict(trials)
    else:
        named = {}
        for at, trial in enumerate(trials):
            name = _name(trial, at)
            if name in named:
                raise DataError(
                    f"trials: two are called `{name}`, {_told(named[name])} and {_told(trial)}; expected names that "
                    "differ: give a dict {name: trial}"
                )
            named[name] = trial
    if not named:
        raise DataError("trials is empty; expected at least one")
    for name in named:
        if not name or name.startswith(".") or "/" in name or "\0" in name:
            raise DataError(f"trial `{name}`: a name is that of a file without its ending")
    return named


def _name(trial: Trial, at: int) -> str:
    return Path(trial).stem if isinstance(trial, str | os.PathLike) else f"trial_{at:02}"


def _told(trial: Trial) -> str:
    """A trial in a message: its file, or its type."""
    return os.fspath(trial) if isinstance(trial, str | os.PathLike) else f"a {type(trial).__name__} without a name"


def _write_one(name: str, trial: Trial, folder: Path) -> None:
    if isinstance(trial, str | os.PathLike):
        source = Path(trial)
        if source.suffix not in LARGEST:
            raise DataError(f"trial `{name}` is {source}; expected a file {' or '.join(LARGEST)}")
        with (
            opened(source, f"trial `{name}`, {source}", LARGEST[source.suffix]) as file,
            open(folder / f"{name}{source.suffix}", "xb") as copy,
        ):
            shutil.copyfileobj(file, copy)
    elif isinstance(trial, Mapping):
        folder.joinpath(f"{name}.npz").write_bytes(npz_bytes(_arrays(name, trial)))
    elif isinstance(trial, SavesToDisk):
        trial.save_to_disk(folder / f"{name}.npz")
    else:
        raise DataError(
            f"trial `{name}` is a {type(trial).__name__}; expected a path, a mujoco.sysid.SystemTrajectory, or a "
            f"dict of arrays: {', '.join(REQUIRED)}"
        )


def _arrays(name: str, trial: Mapping[str, Any]) -> dict[str, np.ndarray[Any, Any]]:
    known = {**REQUIRED, **OPTIONAL, **dict.fromkeys(MAPPINGS, 0)}
    if missing := [array for array in REQUIRED if array not in trial]:
        raise DataError(f"trial `{name}` has no {missing[0]}; expected {', '.join(REQUIRED)}")
    if unknown := [str(array) for array in trial if array not in known]:
        raise DataError(f"trial `{name}`: unknown array {unknown[0]}; there are: {', '.join(known)}")
    arrays = {}
    for array, value in trial.items():
        if array in MAPPINGS:
            arrays[array] = np.asarray(str(value))
            continue
        try:
            found = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise DataError(f"trial `{name}`: {array} is no array of numbers ({error})") from error
        if found.ndim != known[array]:
            raise DataError(f"trial `{name}`: {array} has shape {found.shape}; expected {known[array]} dimensions")
        arrays[array] = found
    for part in ("control", "sensordata", "state"):
        times, rows = arrays.get(f"{part}_times"), arrays.get(f"{part}_data")
        if times is not None and rows is not None and len(times) != len(rows):
            raise DataError(f"trial `{name}`: {part}_data has {len(rows)} rows, {part}_times {len(times)}")
    return arrays


def _contents(folder: Path) -> dict[str, str]:
    """Fingerprints of a folder's files, by name."""
    return {path.name: sha256(path) for path in folder.iterdir() if path.is_file()}
