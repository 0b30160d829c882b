"""A Slocum glider at sea: each dive below 5 m as a trial, pitch prescribed.

Source: `smerckel/gliderflight` (MIT); see the README beside the data. Above 5 m waves and the surface act, of which the
nominal knows nothing. Pressure becomes height by the same density as in the nominal model. The speed through the water,
which is known in some rows, is left out: it is another instrument's, for a check.
"""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from . import MeasuredError

FILE = "glider_flight.csv"
CASE = "glider"
DENSITY = 1004.5  # kg/m^3, that of the nominal
GRAVITY = 9.81  # m/s^2
# Pressure [bar] that a dive exceeds: 5 m of water.
SUBMERGED_BAR = 0.5


@dataclass(frozen=True)
class Dive:
    """One dive: columns of equal length [rows].

    name: the file's stem.
    time: seconds since the first row.
    pitch: nose up [rad].
    drive: volume of the buoyancy drive [cm^3].
    height: of the pressure sensor above the surface [m].
    """

    name: str
    time: np.ndarray
    pitch: np.ndarray
    drive: np.ndarray
    height: np.ndarray

    def summary(self) -> str:
        """One line for people."""
        return f"{len(self.time)} rows, {self.time[-1]:.0f} s, down to {-self.height.min():.1f} m"


def read(folder: Path) -> np.ndarray:
    """Rows [n, 4]: time [s], pressure [bar], pitch [rad], drive [cm^3]."""
    path = folder / FILE
    if not path.is_file():
        raise MeasuredError(f"{path} is not there: give the folder that holds it by --data")
    names = ("time_s", "pressure_bar", "pitch_rad", "buoyancy_drive_cm3")
    with path.open(newline="") as file:
        return np.array([[float(row[name]) for name in names] for row in csv.DictReader(file)])


def trials(folder: Path) -> list[Dive]:
    """The dives, in order."""
    rows = read(folder)
    below = np.concatenate(([False], rows[:, 1] > SUBMERGED_BAR, [False]))
    starts = np.flatnonzero(below[1:] & ~below[:-1])
    ends = np.flatnonzero(below[:-1] & ~below[1:])
    dives = []
    for number, (start, end) in enumerate(zip(starts, ends), 1):
        time, pressure, pitch, drive = rows[start:end].T
        height = -pressure * 1e5 / (DENSITY * GRAVITY)
        dives.append(Dive(f"dive-{number:02}", time - time[0], pitch, drive, height))
    if not dives:
        raise MeasuredError(f"{folder / FILE}: the pressure never exceeds {SUBMERGED_BAR} bar: there is no dive in it")
    return dives


def write(dive: Dive, folder: Path, timestep: float) -> Path:
    """Write `folder/<name>.csv`; `timestep` [s] is that of the nominal model.

    A row labelled t holds the sensors and the prescribed joints of t - timestep, and the command of t.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{dive.name}.csv"
    labels = dive.time + timestep
    drive = np.interp(labels, dive.time, dive.drive)
    with path.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("time", "drive", "pitch", "height"))
        for row in zip(labels, drive, dive.pitch, dive.height):
            writer.writerow([f"{value:.6f}" for value in row])
    return path
