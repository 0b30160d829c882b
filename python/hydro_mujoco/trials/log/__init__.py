"""Logs, read as numbers against time.

base.py       `Log`: topics, and fields of them as `Samples`
mcap.py       MCAP
rosbag.py     ROS 2 and ROS 1 bags
ulog.py       PX4 ULog
dataflash.py  ArduPilot DataFlash
tlog.py       ArduPilot telemetry
table.py      csv, parquet, DataFrame
fields.py     fields of a message by path
extract.py    messages into columns
"""

import os
from pathlib import Path

from ...errors import DataError
from .base import Log, Samples, Topic
from .dataflash import DataFlashLog
from .mcap import McapLog
from .rosbag import RosbagLog
from .table import CsvLog, FrameLog, ParquetLog
from .tlog import TlogLog
from .ulog import UlogLog

__all__ = ["KINDS", "FrameLog", "Log", "Samples", "Topic", "open_log"]

#: Kind of a log -> its reader.
KINDS: dict[str, type[Log]] = {
    "mcap": McapLog,
    "rosbag": RosbagLog,
    "ulog": UlogLog,
    "dataflash": DataFlashLog,
    "tlog": TlogLog,
    "csv": CsvLog,
    "parquet": ParquetLog,
}
_ENDINGS = {
    ".mcap": "mcap",
    ".db3": "rosbag",
    ".bag": "rosbag",
    ".ulg": "ulog",
    ".ulog": "ulog",
    ".bin": "dataflash",
    ".tlog": "tlog",
    ".csv": "csv",
    ".parquet": "parquet",
    ".pq": "parquet",
}


def open_log(path: str | os.PathLike, kind: str | None = None) -> Log:
    """The reader of a log. kind: of KINDS; by default what the file's name ends in, and a folder is a bag.

    Raises:
        DataError: there is no such file, it is empty, or its kind is not known.
    """
    path = Path(path)
    if kind is None:
        kind = "rosbag" if path.is_dir() else _ENDINGS.get(path.suffix.lower())
    if kind is None:
        if not path.exists():
            raise DataError(f"log {path}: no such file or folder")
        raise DataError(
            f"log {path}: what it is cannot be told from its name; expected a folder of a ROS 2 bag or "
            f"{', '.join(_ENDINGS)}"
        )
    return KINDS[kind](path)
