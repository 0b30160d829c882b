"""Tables: csv and parquet files and DataFrames, a column a field, all of one topic."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import DataError
from ...extras import extra
from ..words import cut
from .base import NUMBER, TEXT, TIME, Columns, Log, Samples, Topic
from .stream import Stream, refuse_empty

#: Name of the one topic.
TOPIC = "table"
#: Cells of a table read at a time, and rows at least.
CELLS, LEAST_ROWS = 1 << 18, 1000
#: Bytes of a csv file's row at most, where the file does not end with one.
LONGEST_ROW = 1 << 20


class TableLog(Log):
    """A table whose time is a column. `read` gives the row's number as time; the mapping names the column."""

    kind = "table"
    is_table = True

    def topics(self) -> dict[str, Topic]:
        kinds: dict[str, str] = {}
        count = 0
        for frame in self._pieces(None):
            count += len(frame)
            kinds = kinds or {str(name): _kind(frame[name]) for name in frame.columns}
        return {TOPIC: Topic(TOPIC, self.kind, count, kinds)}

    def columns(self) -> list[str]:
        """Names of the columns."""
        first = next(self._pieces(None), None)
        return [] if first is None else [str(name) for name in first.columns]

    def read(self, wanted: Mapping[str, Sequence[str]]) -> dict[str, Samples]:
        if TOPIC not in wanted:
            return {}
        fields, row = wanted[TOPIC], 0
        columns = Columns(fields)
        for frame in self._pieces(list(dict.fromkeys(fields))):
            values = [self._numbers(frame[name], name, row) for name in fields]
            columns.extend(row + np.arange(len(frame)), np.column_stack(values))
            row += len(frame)
        samples = columns.samples()
        return {TOPIC: samples} if len(samples.times) else {}

    def _pieces(self, columns: list[str] | None) -> Iterator[Any]:
        """DataFrames of some rows each."""
        raise NotImplementedError

    def _numbers(self, column: Any, name: str, row: int) -> np.ndarray:
        import pandas

        kind = _kind(column)
        if kind == TIME:
            return self._dates(column)
        if kind == NUMBER:
            return column.to_numpy(float, na_value=np.nan)
        numbers = pandas.to_numeric(column, errors="coerce")
        if numbers.notna().any():
            bad = numbers.isna() & column.notna() & (column.astype(str).str.strip().str.lower() != "nan")
            if bad.any():
                at = int(np.flatnonzero(bad.to_numpy())[0])
                raise DataError(
                    f"{self.path}, row {row + at + 1} of data, column `{name}`: `{cut(column.iloc[at])}` is no number; "
                    "an empty cell stands for a sample that is missing"
                )
            return numbers.to_numpy(float)
        dates = pandas.to_datetime(column, format="ISO8601", errors="coerce", utc=True)
        if dates.notna().any() and dates.notna().sum() == column.notna().sum():
            return self._dates(dates)
        return np.array([self.number(str(value), name, TOPIC) if value == value else np.nan for value in column])

    def _dates(self, column: Any) -> np.ndarray:
        """Seconds since the first date that was met; of a duration, its seconds."""
        if column.dtype.kind == "m":
            return column.dt.total_seconds().to_numpy(float)
        stamps = column.astype("datetime64[ns, UTC]" if getattr(column.dtype, "tz", None) else "datetime64[ns]")
        first = int(stamps.dropna().iloc[0].value) if stamps.notna().any() else 0
        self.start = first if self.start is None else self.start
        whole = stamps.astype("int64").to_numpy()
        return np.where(stamps.isna(), np.nan, (whole - self.start) * 1e-9)

    def _check(self, columns: Sequence[str] | None, there: Sequence[str]) -> None:
        for name in columns or ():
            if name not in there:
                raise self.no_field(TOPIC, name, there)


class CsvLog(TableLog):
    """A csv file, read some rows at a time."""

    kind = "csv file"

    def __init__(self, path: Path):
        refuse_empty(path)
        super().__init__(path)
        extra("pandas", "tables", self.kind)

    def _pieces(self, columns: list[str] | None) -> Iterator[Any]:
        import pandas

        try:
            with Stream(self.path, self._end()) as stream:
                head = pandas.read_csv(stream, nrows=0, skipinitialspace=True)
            there = [str(name).strip() for name in head.columns]
            self._check(columns, there)
            chosen = [number for number, name in enumerate(there) if columns is None or name in columns]
            with Stream(self.path, self._end()) as stream:
                reader = pandas.read_csv(stream, chunksize=_rows(there), usecols=chosen, skipinitialspace=True)
                for frame in reader:
                    frame.columns = [str(name).strip() for name in frame.columns]
                    yield frame if columns is None else frame[columns]
        except (pandas.errors.ParserError, pandas.errors.EmptyDataError, UnicodeDecodeError) as error:
            raise self.damaged(error) from error

    def _end(self) -> int:
        """The bytes that are read: up to the last end of a line, for a row without one may be cut within a number."""
        size = self.path.stat().st_size
        with open(self.path, "rb") as file:
            file.seek(max(size - LONGEST_ROW, 0))
            tail = file.read()
        rest = len(tail) - (tail.rfind(b"\n") + 1)
        if not rest or rest == len(tail):
            return size
        fault = (
            f"the file does not end with the end of a line: its last {rest} bytes may be a row that is cut off and "
            f"were left out; it was read up to byte {size - rest} of {size}"
        )
        if fault not in self.faults:
            self.faults.append(fault)
        return size - rest


class ParquetLog(TableLog):
    """A parquet file, read some rows at a time."""

    kind = "parquet file"

    def __init__(self, path: Path):
        refuse_empty(path)
        super().__init__(path)
        extra("pandas", "tables", self.kind)
        extra("pyarrow.parquet", "tables", self.kind)

    def topics(self) -> dict[str, Topic]:
        from pyarrow import parquet

        first = next(self._pieces(None), None)
        kinds = {} if first is None else {str(name): _kind(first[name]) for name in first.columns}
        return {TOPIC: Topic(TOPIC, self.kind, parquet.read_metadata(self.path).num_rows, kinds)}

    def columns(self) -> list[str]:
        from pyarrow import parquet

        return list(parquet.read_schema(self.path).names)

    def _pieces(self, columns: list[str] | None) -> Iterator[Any]:
        import pyarrow
        from pyarrow import parquet

        try:
            with parquet.ParquetFile(self.path, pre_buffer=False) as file:
                there = file.schema_arrow.names
                self._check(columns, there)
                # Threads would decode several groups of rows ahead.
                for batch in file.iter_batches(batch_size=_rows(there), columns=columns, use_threads=False):
                    # Names and numbers are the file's; what pandas noted beside them is not needed, and may be damaged.
                    frame = batch.replace_schema_metadata(None).to_pandas()
                    yield frame if columns is None else frame[columns]
        except (pyarrow.ArrowException, OSError, UnicodeDecodeError) as error:
            raise self.damaged(error) from error


class FrameLog(TableLog):
    """A DataFrame; an index of times is the column of its name, or `time`."""

    kind = "DataFrame"

    def __init__(self, frame: Any, name: str = "DataFrame"):
        super().__init__(Path(name))
        pandas = extra("pandas", "tables", self.kind)
        if hasattr(frame, "to_pandas"):
            frame = frame.to_pandas()
        if not isinstance(frame, pandas.DataFrame):
            raise DataError(f"{type(frame).__name__} given; expected a DataFrame of pandas or polars")
        if not len(frame):
            raise DataError("the DataFrame has no row")
        name_of_index = str(frame.index.name or "time")
        is_time = frame.index.name is not None or frame.index.dtype.kind in "Mmf"
        if is_time and name_of_index not in frame.columns:
            frame = frame.reset_index(names=name_of_index)
        self._frame = frame.rename(columns=str)

    def _pieces(self, columns: list[str] | None) -> Iterator[Any]:
        self._check(columns, list(self._frame.columns))
        yield self._frame if columns is None else self._frame[columns]


def _rows(columns: Sequence[Any]) -> int:
    """Rows of a piece of so many columns."""
    return max(CELLS // max(len(columns), 1), LEAST_ROWS)


def _kind(column: Any) -> str:
    if column.dtype.kind in "Mm" or "datetime64" in str(column.dtype):
        return TIME
    return NUMBER if column.dtype.kind in "biuf" or str(column.dtype).startswith(("Int", "Float", "UInt")) else TEXT
