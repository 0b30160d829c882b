"""Logs of real vehicles as trials for `hydro gap`: `from_mcap`, `from_rosbag`, `from_ulog`, ...

log/          readers: MCAP, ROS bags, ULog, DataFlash and telemetry, csv, parquet, DataFrame
mapping/      mapping files: which field is which sensor, actuator or state
model.py      what of a model can be mapped
units.py      units of logs
frames.py     frames of vectors and attitudes
clock.py      times of samples
geodetic.py   latitude, longitude and height as metres
turning.py    velocities from the world into a body, or back
scratch.py    long tables of numbers, on disk
signals.py    samples of sensors, actuators, joints and states
gather.py     mapped fields as signals, in the model's units and frames
continuity.py attitudes and angles that go on from block to block
suspicion/    what looks wrong: frames, units, signs
windows.py    where trials begin and end
resample.py   signals on other times
start.py      the state that a trial starts from
assemble.py   windows as trials
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
    """Trials of an MCAP file: ROS 2 (CDR), JSON and Protobuf messages.

    Args:
        path: a file .mcap. Log time is when a message was logged; of a file that is cut, what is before the cut is
            read.
        model: the nominal MJCF, or a spec, whose sensors and actuators the mapping names.
        mapping: path of a TOML file `hydro-mapping/1` (docs/logs.md), or its content as a dict.
        out: folder for NAME-NN.npz, one a trial, which `hydro gap run --trials` reads, and NAME.conversion.json;
            nothing is written without it.
        overwrite: replace trials of this log in `out`.

    Returns:
        Conversion: iterates over its trials. Of each, `sensor(NAME)` (rows, dim) in the sensor's unit and frame [SI,
        radians; by default x east, y north, z up and x forward, y left, z up], `sensor_times` (rows,) [s],
        `controls` (m, nu); `report`: what was resampled, dropped and is suspected.

    Raises:
        DataError: the file cannot be read, the extra `mcap` is missing, a mapped topic or field is not in the log,
            the mapping names what the model lacks, or no trial is long enough. Nothing is written then.
        KeyboardInterrupt: nothing is half written then.

    Source: MCAP format specification (mcap.dev/spec); frames of ROS messages: REP 103.

    >>> from hydro_mujoco import trials
    >>> found = trials.from_mcap("dive.mcap", model="nominal.xml", mapping="ros.toml")
    >>> trial = found.trials[0]
    >>> trial.sensor("imu_gyro").shape[1], trial.controls.shape[1]
    (3, 8)
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
    """Trials of a ROS 2 bag or a ROS 1 bag.

    Args:
        path: a ROS 2 bag's folder with metadata.yaml, its .db3 or .mcap file, or a ROS 1 .bag. Log time is when a
            message was recorded.
        model: the nominal MJCF, or a spec, whose sensors and actuators the mapping names.
        mapping: path of a TOML file `hydro-mapping/1` (docs/logs.md), or its content as a dict.
        out: folder for NAME-NN.npz, one a trial, which `hydro gap run --trials` reads, and NAME.conversion.json;
            nothing is written without it.
        overwrite: replace trials of this log in `out`.

    Returns:
        Conversion: iterates over its trials. Of each, `sensor(NAME)` (rows, dim) in the sensor's unit and frame [SI,
        radians; by default x east, y north, z up and x forward, y left, z up], `sensor_times` (rows,) [s],
        `controls` (m, nu); `report`: what was resampled, dropped and is suspected.

    Raises:
        DataError: the file cannot be read, the extra `rosbags` is missing, a mapped topic or field is not in the log,
            the mapping names what the model lacks, or no trial is long enough. Nothing is written then.
        KeyboardInterrupt: nothing is half written then.

    Source: rosbag2 storage formats sqlite3 and MCAP; ROS 1 "Bags/Format/2.0" (wiki.ros.org); frames: REP 103.

    >>> from hydro_mujoco import trials
    >>> found = trials.from_rosbag("dive_ros2", model="nominal.xml", mapping="ros.toml", out="trials")
    >>> [trial.name for trial in found]
    ['dive_ros2-00', 'dive_ros2-01', 'dive_ros2-02']
    """
    return _convert(open_log(path, "rosbag"), model, mapping, out, overwrite=overwrite)


def from_ulog(
    path: str | os.PathLike,
    *,
    model: Model,
    mapping: Map,
    out: str | os.PathLike | None = None,
    overwrite: bool = False,
) -> Conversion:
    """Trials of a PX4 ULog.

    PX4 writes NED and FRD: give `frame`, and the numbers are turned.

    Args:
        path: a file .ulg. Log time is the field `timestamp`, since boot; instance n of a topic is `NAME[n]`.
        model: the nominal MJCF, or a spec, whose sensors and actuators the mapping names.
        mapping: path of a TOML file `hydro-mapping/1` (docs/logs.md), or its content as a dict.
        out: folder for NAME-NN.npz, one a trial, which `hydro gap run --trials` reads, and NAME.conversion.json;
            nothing is written without it.
        overwrite: replace trials of this log in `out`.

    Returns:
        Conversion: iterates over its trials. Of each, `sensor(NAME)` (rows, dim) in the sensor's unit and frame [SI,
        radians; by default x east, y north, z up and x forward, y left, z up], `sensor_times` (rows,) [s],
        `controls` (m, nu); `report`: what was resampled, dropped and is suspected.

    Raises:
        DataError: the file cannot be read, the extra `ulog` is missing, a mapped topic or field is not in the log,
            the mapping names what the model lacks, or no trial is long enough. Nothing is written then.
        KeyboardInterrupt: nothing is half written then.

    Source: PX4 user guide, "ULog File Format"; units and frames: PX4 msg/*.msg.

    >>> from hydro_mujoco import trials
    >>> rates = {"topic": "vehicle_angular_velocity", "fields": ["xyz[0]", "xyz[1]", "xyz[2]"], "frame": "FRD"}
    >>> motors = {f"t{n + 1}": {"topic": "actuator_motors", "field": f"control[{n}]"} for n in range(8)}
    >>> mapping = {"schema": "hydro-mapping/1", "sensors": {"imu_gyro": rates}, "actuators": motors}
    >>> len(trials.from_ulog("dive.ulg", model="nominal.xml", mapping=mapping))
    1
    """
    return _convert(open_log(path, "ulog"), model, mapping, out, overwrite=overwrite)


def from_ardupilot(
    path: str | os.PathLike,
    *,
    model: Model,
    mapping: Map,
    out: str | os.PathLike | None = None,
    overwrite: bool = False,
) -> Conversion:
    """Trials of an ArduPilot DataFlash log, or of its telemetry.

    ArduPilot writes NED and FRD, degrees and widths of pulses: give `frame` and `unit`, and the numbers are converted.

    Args:
        path: a file .bin (log time TimeUS, since boot; an instance is `IMU[0]`), or a .tlog of MAVLink messages (log
            time is when they arrived).
        model: the nominal MJCF, or a spec, whose sensors and actuators the mapping names.
        mapping: path of a TOML file `hydro-mapping/1` (docs/logs.md), or its content as a dict.
        out: folder for NAME-NN.npz, one a trial, which `hydro gap run --trials` reads, and NAME.conversion.json;
            nothing is written without it.
        overwrite: replace trials of this log in `out`.

    Returns:
        Conversion: iterates over its trials. Of each, `sensor(NAME)` (rows, dim) in the sensor's unit and frame [SI,
        radians; by default x east, y north, z up and x forward, y left, z up], `sensor_times` (rows,) [s],
        `controls` (m, nu); `report`: what was resampled, dropped and is suspected.

    Raises:
        DataError: the file cannot be read, the extra `ardupilot` is missing, a mapped topic or field is not in the log,
            the mapping names what the model lacks, or no trial is long enough. Nothing is written then.
        KeyboardInterrupt: nothing is half written then.

    Source: ArduPilot, "Logging" (AP_Logger: FMT, FMTU, UNIT, MULT); MAVLink common.xml.

    >>> from hydro_mujoco import trials
    >>> rates = {"topic": "IMU", "fields": ["GyrX", "GyrY", "GyrZ"], "frame": "FRD"}
    >>> servos = {f"t{n}": {"topic": "RCOU", "field": f"C{n}", "unit": "us"} for n in range(1, 9)}
    >>> mapping = {"schema": "hydro-mapping/1", "sensors": {"imu_gyro": rates}, "actuators": servos}
    >>> (trial,) = trials.from_ardupilot("dive.bin", model="nominal.xml", mapping=mapping)
    >>> bool(abs(trial.controls).max() <= 1)
    True
    """
    return _convert(
        open_log(path, "tlog" if os.fspath(path).lower().endswith(".tlog") else "dataflash"),
        model,
        mapping,
        out,
        overwrite=overwrite,
    )


def from_csv(
    path: str | os.PathLike,
    *,
    model: Model,
    mapping: Map,
    out: str | os.PathLike | None = None,
    overwrite: bool = False,
) -> Conversion:
    """Trials of a csv file, a column a field.

    Units and frames are those that the mapping says; SI, radians and the frames of the model where it says none.

    Args:
        path: a file .csv with a line of names. Times are those of the column that `[time] clock` names, else of `time`,
            `t` or `timestamp`: numbers [s, or the unit that the mapping says] or dates (ISO 8601).
        model: the nominal MJCF, or a spec, whose sensors and actuators the mapping names.
        mapping: path of a TOML file `hydro-mapping/1` (docs/logs.md), or its content as a dict.
        out: folder for NAME-NN.npz, one a trial, which `hydro gap run --trials` reads, and NAME.conversion.json;
            nothing is written without it.
        overwrite: replace trials of this log in `out`.

    Returns:
        Conversion: iterates over its trials. Of each, `sensor(NAME)` (rows, dim) in the sensor's unit and frame [SI,
        radians; by default x east, y north, z up and x forward, y left, z up], `sensor_times` (rows,) [s],
        `controls` (m, nu); `report`: what was resampled, dropped and is suspected.

    Raises:
        DataError: the file cannot be read, the extra `tables` is missing, a mapped topic or field is not in the log,
            the mapping names what the model lacks, or no trial is long enough. Nothing is written then.
        KeyboardInterrupt: nothing is half written then.

    Source: RFC 4180.

    >>> from hydro_mujoco import trials
    >>> rates = {"fields": ["gx", "gy", "gz"], "unit": "deg/s"}
    >>> mapping = {"schema": "hydro-mapping/1", "sensors": {"imu_gyro": rates}}
    >>> mapping["actuators"] = {f"t{n}": {"constant": 0} for n in range(1, 9)}
    >>> (trial,) = trials.from_csv("dive.csv", model="nominal.xml", mapping=mapping)
    >>> bool(abs(trial.sensor("imu_gyro")).max() < 2)
    True
    """
    return _convert(open_log(path, "csv"), model, mapping, out, overwrite=overwrite)


def from_parquet(
    path: str | os.PathLike,
    *,
    model: Model,
    mapping: Map,
    out: str | os.PathLike | None = None,
    overwrite: bool = False,
) -> Conversion:
    """Trials of a parquet file, a column a field.

    Units and frames are those that the mapping says; SI, radians and the frames of the model where it says none.

    Args:
        path: a file .parquet or .pq. Times as in `from_csv`.
        model: the nominal MJCF, or a spec, whose sensors and actuators the mapping names.
        mapping: path of a TOML file `hydro-mapping/1` (docs/logs.md), or its content as a dict.
        out: folder for NAME-NN.npz, one a trial, which `hydro gap run --trials` reads, and NAME.conversion.json;
            nothing is written without it.
        overwrite: replace trials of this log in `out`.

    Returns:
        Conversion: iterates over its trials. Of each, `sensor(NAME)` (rows, dim) in the sensor's unit and frame [SI,
        radians; by default x east, y north, z up and x forward, y left, z up], `sensor_times` (rows,) [s],
        `controls` (m, nu); `report`: what was resampled, dropped and is suspected.

    Raises:
        DataError: the file cannot be read, the extra `tables` is missing, a mapped topic or field is not in the log,
            the mapping names what the model lacks, or no trial is long enough. Nothing is written then.
        KeyboardInterrupt: nothing is half written then.

    Source: Apache Parquet format.

    >>> from hydro_mujoco import trials
    >>> rates = {"fields": ["gx", "gy", "gz"], "unit": "deg/s"}
    >>> mapping = {"schema": "hydro-mapping/1", "sensors": {"imu_gyro": rates}}
    >>> mapping["actuators"] = {f"t{n}": {"constant": 0} for n in range(1, 9)}
    >>> len(trials.from_parquet("dive.parquet", model="nominal.xml", mapping=mapping))
    1
    """
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
    """Trials of a DataFrame of pandas or polars, a column a field.

    Units and frames are those that the mapping says; SI, radians and the frames of the model where it says none.

    Args:
        frame: a DataFrame. Its index counts as a column, of its name or `time`, where it is of times. Times as in
            `from_csv`.
        model: the nominal MJCF, or a spec, whose sensors and actuators the mapping names.
        mapping: path of a TOML file `hydro-mapping/1` (docs/logs.md), or its content as a dict.
        out: folder for NAME-NN.npz, one a trial, which `hydro gap run --trials` reads, and NAME.conversion.json;
            nothing is written without it.
        name: of the trials.
        overwrite: replace trials of this name in `out`.

    Returns:
        Conversion: iterates over its trials. Of each, `sensor(NAME)` (rows, dim) in the sensor's unit and frame [SI,
        radians; by default x east, y north, z up and x forward, y left, z up], `sensor_times` (rows,) [s],
        `controls` (m, nu); `report`: what was resampled, dropped and is suspected.

    Raises:
        DataError: it is no DataFrame, the extra `tables` is missing, a mapped topic or field is not in the log,
            the mapping names what the model lacks, or no trial is long enough. Nothing is written then.
        KeyboardInterrupt: nothing is half written then.

    >>> import pandas
    >>> from hydro_mujoco import trials
    >>> table = pandas.read_csv("dive.csv", index_col="time")
    >>> rates = {"fields": ["gx", "gy", "gz"], "unit": "deg/s"}
    >>> mapping = {"schema": "hydro-mapping/1", "sensors": {"imu_gyro": rates}}
    >>> mapping["actuators"] = {f"t{n}": {"constant": 0} for n in range(1, 9)}
    >>> [trial.name for trial in trials.from_dataframe(table, model="nominal.xml", mapping=mapping, name="noon")]
    ['noon-00']
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
        DataError: the log or the model cannot be read, or the extra for this kind of log is missing.

    >>> from hydro_mujoco import trials
    >>> proposal = trials.propose("dive_ros2", "nominal.xml")
    >>> proposal.open
    ['velocity', 'rov_water']
    """
    return _propose(open_log(path, kind), model)
