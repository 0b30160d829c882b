"""Logs of real vehicles as trials for `hydro gap`: `from_mcap`, `from_rosbag`, `from_ulog`, ...

log/          readers: MCAP, ROS bags, ULog, DataFlash and telemetry, csv, parquet, DataFrame
mapping/      mapping files: which field is which sensor, actuator or state
model.py      what of a model can be mapped
units.py      units of logs
frames.py     frames of vectors and attitudes
clock.py      times of samples
geodetic.py   latitude, longitude and height as metres
turning.py    velocities from the world into a body, or back
signals.py    mapped fields in the model's units and frames
suspicion/    what looks wrong: frames, units, signs
windows.py    where trials begin and end
resample.py   signals on other times
start.py      the state that a trial starts from
assemble.py   a window as a trial
trial.py      a trial, and its file
convert.py    a log into trials
report.py     what a conversion did
proposal/     what a log holds, and a mapping for it
words.py      names and numbers in messages

The command is `python -m hydro_mujoco.trials`, and `hydro trials` of an installed wheel; docs/logs.md describes it.
"""

import os
from collections.abc import Mapping
from typing import Any, TypeAlias

import mujoco

from .convert import Conversion
from .convert import convert as _convert
from .log import FrameLog, open_log
from .proposal import Proposal
from .proposal import propose as _propose
from .trial import Trial

__all__ = [
    "Conversion",
    "Proposal",
    "Trial",
    "from_ardupilot",
    "from_csv",
    "from_dataframe",
    "from_mcap",
    "from_parquet",
    "from_rosbag",
    "from_ulog",
    "propose",
]

#: An MJCF or a spec; a mapping's TOML file or its content.
Model: TypeAlias = str | os.PathLike | mujoco.MjSpec
Map: TypeAlias = str | os.PathLike | Mapping[str, Any]


def from_mcap(
    path: str | os.PathLike,
    *,
    model: Model,
    mapping: Map,
    out: str | os.PathLike | None = None,
    overwrite: bool = False,
) -> Conversion:
    """Trials of an MCAP file: ROS 2 (CDR), JSON and Protobuf messages. Needs the extra `mcap`.

    Args:
        path: the log.
        model: the nominal MJCF, or a spec, whose sensors and actuators the mapping names.
        mapping: path of a TOML file `hydro-mapping/1` (docs/logs.md), or its content as a dict.
        out: folder for NAME-NN.npz, one a trial, which `hydro gap run --trials` reads, and NAME.conversion.json;
            nothing is written without it.
        overwrite: replace trials of this log in `out`.

    Returns:
        Conversion: `trials`, arrays in the model's units and frames [SI, radians], and `report`, what was resampled,
        dropped and is suspected.

    Raises:
        DataError: the log cannot be read or lacks a mapped topic or field, the mapping names what the model lacks, or
            no trial is long enough. Nothing is written then.
    """
    return _convert(open_log(path, "mcap"), model, mapping, out, overwrite=overwrite)


def from_rosbag(
    path: str | os.PathLike,
    *,
    model: Model,
    mapping: Map,
    out: str | os.PathLike | None = None,
    overwrite: bool = False,
) -> Conversion:
    """Trials of a ROS 2 bag (its folder, a .db3 or .mcap file) or a ROS 1 .bag; as `from_mcap`. Extra `rosbags`."""
    return _convert(open_log(path, "rosbag"), model, mapping, out, overwrite=overwrite)


def from_ulog(
    path: str | os.PathLike,
    *,
    model: Model,
    mapping: Map,
    out: str | os.PathLike | None = None,
    overwrite: bool = False,
) -> Conversion:
    """Trials of a PX4 ULog; as `from_mcap`. Extra `ulog`."""
    return _convert(open_log(path, "ulog"), model, mapping, out, overwrite=overwrite)


def from_ardupilot(
    path: str | os.PathLike,
    *,
    model: Model,
    mapping: Map,
    out: str | os.PathLike | None = None,
    overwrite: bool = False,
) -> Conversion:
    """Trials of an ArduPilot DataFlash log (.bin), or of telemetry (.tlog); as `from_mcap`. Extra `ardupilot`."""
    kind = "tlog" if os.fspath(path).lower().endswith(".tlog") else "dataflash"
    return _convert(open_log(path, kind), model, mapping, out, overwrite=overwrite)


def from_csv(
    path: str | os.PathLike,
    *,
    model: Model,
    mapping: Map,
    out: str | os.PathLike | None = None,
    overwrite: bool = False,
) -> Conversion:
    """Trials of a csv file, a column a field; as `from_mcap`. Extra `tables`."""
    return _convert(open_log(path, "csv"), model, mapping, out, overwrite=overwrite)


def from_parquet(
    path: str | os.PathLike,
    *,
    model: Model,
    mapping: Map,
    out: str | os.PathLike | None = None,
    overwrite: bool = False,
) -> Conversion:
    """Trials of a parquet file, a column a field; as `from_mcap`. Extra `tables`."""
    return _convert(open_log(path, "parquet"), model, mapping, out, overwrite=overwrite)


def from_dataframe(
    frame: Any,
    *,
    model: Model,
    mapping: Map,
    out: str | os.PathLike | None = None,
    name: str = "table",
    overwrite: bool = False,
) -> Conversion:
    """Trials of a DataFrame of pandas or polars, a column a field; as `from_mcap`. name: of the trials. Extra `tables`.

    An index of times counts as a column of its name, or `time`.
    """
    return _convert(FrameLog(frame, name), model, mapping, out, overwrite=overwrite)


def propose(path: str | os.PathLike, model: Model, *, kind: str | None = None) -> Proposal:
    """What a log holds, and a mapping for it: sensors and actuators of the model by type of message and name.

    Args:
        path: the log, of any kind that can be read.
        model: the nominal MJCF, or a spec.
        kind: `mcap`, `rosbag`, `ulog`, `dataflash`, `tlog`, `csv`, `parquet`; by default by the file's name.

    Returns:
        Proposal: `topics`, `toml` (the mapping's text, to be saved and used as it is once nothing is left out) and
        `open`, sensors and actuators for which nothing was found. `str()` of it shows all.

    Raises:
        DataError: the log or the model cannot be read.
    """
    return _propose(open_log(path, kind), model)
