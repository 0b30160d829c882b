"""A log into trials: read, converted, split, resampled, written."""

import os
import re
import secrets
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from ..errors import DataError, Notice
from ..recording.files import write_beside, write_json, write_npz
from ..recording.interrupts import held_back, saying
from ..recording.lock import locked
from .assemble import Assembly, described, periods
from .gather import gather
from .log import Log
from .mapping.parse import parse
from .model import load
from .report import Report
from .scratch import blocks
from .signals import Signals
from .start import refuse_unmapped
from .suspicion import suspect
from .trial import Trial
from .windows import windows
from .words import counted, seconds

#: End of the name of the file that stands while trials are replaced; `hydro gap` refuses a folder that has one.
UNFINISHED = ".unfinished"
#: What is said of a conversion that Ctrl-C stops.
STOPPED = "stopped; no half-written file is left"


@dataclass(frozen=True)
class Conversion:
    """Trials of a log, and what was done to get them. Iterates over the trials."""

    trials: list[Trial]
    report: Report

    def __iter__(self) -> Iterator[Trial]:
        return iter(self.trials)

    def __len__(self) -> int:
        return len(self.trials)


def convert(
    log: Log,
    model: str | os.PathLike | mujoco.MjSpec,
    mapping: str | os.PathLike | Mapping[str, Any],
    out: str | os.PathLike | None = None,
    *,
    overwrite: bool = False,
) -> Conversion:
    """Convert a log; where `out` is given, write NAME-NN.npz and NAME.conversion.json there.

    Raises:
        DataError: with one message; nothing is written then.
        KeyboardInterrupt: nothing is half written then.
    """
    with saying(f"hydro trials: {STOPPED}"):
        return _convert(log, model, mapping, out, overwrite)


def _convert(
    log: Log,
    model: str | os.PathLike | mujoco.MjSpec,
    mapping: str | os.PathLike | Mapping[str, Any],
    out: str | os.PathLike | None,
    overwrite: bool,
) -> Conversion:
    nominal = load(model)
    parsed = parse(mapping, nominal)
    report = Report(str(log.path), log.kind, log.is_table)
    signals = gather(log, parsed, report)
    refuse_unmapped(nominal, signals, parsed.name)
    suspect(signals, nominal, report)
    pieces = windows(signals, parsed, report)
    spacing = periods(signals, parsed, nominal, report)
    stem = re.sub(r"[^\w.+-]+", "_", log.path.stem) or "log"
    assembly = Assembly(signals, parsed, nominal, spacing, report)
    for window in pieces:
        assembly.add(f"{stem}-{len(assembly):02}", window)
    trials = assembly.trials()
    if not trials:
        raise DataError(f"{log.path}: no row of a trial has a reading, {seconds(spacing.rows)} apart")
    report.signals = _described(signals, spacing.rows)
    report.trials = [_listed(trial, spacing.rows) for trial in trials]
    if signals.state and not all(trial.initial_state is not None for trial in trials):
        report.note("trials without a start: a part of [state] has no sample there; `hydro gap` estimates it")
    if len(trials) == 1:
        report.note("one trial alone verifies nothing: `length` in [trials] cuts it into several")
    if out is not None:
        _write(Path(out), stem, trials, report, overwrite)
    return Conversion(trials, report)


def _described(signals: Signals, period: float) -> list[dict[str, Any]]:
    said = [(name, described(signal, period)) for name, signal in {**signals.sensors, **signals.joints}.items()]
    said += [
        (name, f"{counted(signal.times.size, 'command')} of `{signal.source.topic}`, each held until the next")
        for name, signal in signals.actuators.items()
    ]
    return [{"name": name, "what": what} for name, what in said]


def _listed(trial: Trial, period: float) -> dict[str, Any]:
    count = len(trial.sensor_times)
    missing = sum(np.isnan(trial.readings[block]).sum(0) for block in blocks(*trial.readings.shape)) / count
    return {
        "name": trial.name,
        "start": trial.start,
        "seconds": float(trial.sensor_times[-1] - trial.sensor_times[0]),
        "rows": count,
        "period": period,
        "initial_state": trial.initial_state is not None,
        "missing": {name: float(missing[columns].mean()) for name, columns in trial.signals.items()},
    }


def _write(out: Path, stem: str, trials: list[Trial], report: Report, overwrite: bool) -> None:
    """Write all of the files, or none; a marker stands as long as some are of this conversion and some are not."""
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DataError(f"folder {out}: {error.strerror}") from error
    with locked(out / f".{stem}.lock"):
        _write_alone(out, stem, trials, report, overwrite)


def _write_alone(out: Path, stem: str, trials: list[Trial], report: Report, overwrite: bool) -> None:
    paths = [out / f"{trial.name}.npz" for trial in trials]
    beside, marker = out / f"{stem}.conversion.json", out / f".{stem}{UNFINISHED}"
    own = re.compile(re.escape(stem) + r"-\d+\.npz")
    killed = re.compile(rf"\.?{re.escape(stem)}(-\d+\.npz|\.conversion\.json)(\.[0-9a-f]{{12}}){{1,2}}(\.tmp)?")
    former = sorted(path for path in out.iterdir() if own.fullmatch(path.name))
    if former and marker.exists():
        warnings.warn(f"{out}: a conversion was cut short there; its trials are made again", Notice, stacklevel=4)
    elif former and not overwrite:
        raise DataError(f"{former[0]} is there already: --overwrite (overwrite=True) replaces the trials of this log")
    staged = {path: path.with_name(f".{path.name}.{secrets.token_hex(6)}") for path in paths}
    try:
        for path in out.iterdir():
            if killed.fullmatch(path.name):
                path.unlink()
        for trial, path in zip(trials, staged.values()):
            write_npz(path, trial.arrays())
        with held_back():
            write_beside(marker, b"")
            for path, new in staged.items():
                os.replace(new, path)
            for path in set(former) - set(paths):
                path.unlink()
            write_json(beside, report.json())
            marker.unlink()
    except OSError as error:
        raise DataError(f"folder {out}: {error.strerror or error}") from error
    finally:
        for new in staged.values():
            new.unlink(missing_ok=True)
