"""The table of a towing campaign, `conditions.csv` (see `hydro_tools.tank.campaign`): one line a tow, checked."""

import csv
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hydro_mujoco.reading import read_text
from hydro_tools.datasets import DataError
from hydro_tools.tank import campaign, conditions

#: Columns that are read; the table may hold more.
NUMBERS = ("thigh", "calf", "velocity_x", "velocity_y", "force_x", "force_y", "error_x", "error_y")
NEEDED = ("condition", *NUMBERS)
#: Leg configurations without which nothing can be held out.
LEAST_CONFIGURATIONS = 3
#: How far a posture [rad] or velocity [m/s] may lie from that of its condition; the table has nine digits.
ROUNDING = 1e-6


@dataclass(frozen=True)
class Measurements:
    """N tows: number of the condition [N]; posture (thigh, calf) [N,2] rad; velocity [N,2] m/s; mean force of the
    water and its standard error [N,2] N; base frame.
    """

    condition: np.ndarray
    posture: np.ndarray
    velocity: np.ndarray
    force: np.ndarray
    error: np.ndarray

    def __len__(self) -> int:
        return len(self.condition)

    @property
    def configuration(self) -> np.ndarray:
        """Leg configuration of each tow [N]."""
        return np.array([conditions.Condition(int(i)).configuration for i in self.condition])

    @property
    def direction(self) -> np.ndarray:
        """Name of each tow's direction [N]."""
        return np.array([conditions.Condition(int(i)).stance.direction for i in self.condition])

    @property
    def speed(self) -> np.ndarray:
        """[N] m/s"""
        return np.array([conditions.Condition(int(i)).speed for i in self.condition])

    def take(self, rows: np.ndarray) -> "Measurements":
        """Some of the tows, by number or by mask."""
        return Measurements(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))


def find(towing: Path) -> Path:
    """The table of a folder that `gen_task1.py` wrote, or of its `raw`."""
    for path in (towing / "raw" / campaign.TABLE, towing / campaign.TABLE):
        if path.is_file():
            return path
    raise DataError(
        f"{towing} holds no raw/{campaign.TABLE}: make it with `python scripts/gen_task1.py --out {towing} --task 1.1`"
    )


def _row(path: Path, line: int, row: dict) -> tuple[int, list[float]]:
    if row.get(None) or None in row.values():
        raise DataError(f"{path} line {line}: it does not have as many fields as the header")
    values = []
    for name in NEEDED:
        try:
            value = float(row[name])
        except ValueError:
            value = float("nan")
        if not np.isfinite(value):
            raise DataError(f"{path} line {line}: {name} is `{row[name]}`, expected a finite number")
        values.append(value)
    number, values = values[0], values[1:]
    if number != int(number) or not 0 <= number < conditions.COUNT:
        raise DataError(
            f"{path} line {line}: condition {row['condition']} is unknown, expected a whole number 0 to "
            f"{conditions.COUNT - 1}"
        )
    expected = conditions.Condition(int(number)).features
    for name, value, wanted in zip(NUMBERS, values, expected):
        if abs(value - wanted) > ROUNDING:
            raise DataError(f"{path} line {line}: {name} is {value:g}, but condition {int(number)} has {wanted:.9g}")
    for name, value in zip(NUMBERS[6:], values[6:]):
        if value <= 0:
            raise DataError(f"{path} line {line}: {name} is {value:g} N, expected a positive standard error")
    return int(number), values


def read(path: Path) -> Measurements:
    """All tows of the table, in its order."""
    try:
        with io.StringIO(read_text(path), newline="") as file:
            reader = csv.DictReader(file)
            missing = [name for name in NEEDED if name not in (reader.fieldnames or ())]
            if missing:
                raise DataError(
                    f"{path} lacks the column{'s'[: len(missing) > 1]} {', '.join(missing)}; "
                    f"it has {', '.join(reader.fieldnames or ('none',))}"
                )
            rows = [_row(path, reader.line_num, row) for row in reader]
    except csv.Error as error:
        raise DataError(f"{path}: {error}") from error
    if not rows:
        raise DataError(f"{path} holds a header and no tows")
    values = np.array([values for _, values in rows])
    found = Measurements(np.array([number for number, _ in rows]), *(values[:, i : i + 2] for i in (0, 2, 4, 6)))
    configurations, directions = set(found.configuration.tolist()), set(found.direction.tolist())
    if len(configurations) < LEAST_CONFIGURATIONS or directions != set(conditions.DIRECTIONS):
        raise DataError(
            f"{path} has {len(configurations)} leg configurations towed along {', '.join(sorted(directions))}: "
            f"expected at least {LEAST_CONFIGURATIONS}, and tows along {', '.join(conditions.DIRECTIONS)}"
        )
    return found
