"""A tanker model towed at 18 drift angles, as one table of steady states.

Source: `captive.csv` of `martinlarsalbert/System-identification-of-Vessel-Manoeuvring-Models`; see the README beside
the data.

The source's frame is the field's for manoeuvring: x forward, y to starboard, z down, forces of the water on the hull

    X, Y = X', Y' * 1/2 rho L^2 U^2      N = N' * 1/2 rho L^3 U^2      rho = 1000 kg/m^3, L = 7 m
    u = U cos(beta), v = -U sin(beta)    velocity of the hull: at a positive drift angle it goes to port

(Y opposes v, so this sign of beta is the data's own.) MuJoCo's frame has y to port and z up: y, z, and turns about
them change sign. A load cell (MuJoCo's `force` and `torque`) gives what the carriage exerts on the hull, against the
water at constant speed:

    force[0] = -X    force[1] = -(-Y) = Y    torque[2] = -(-N) = N

The carriage goes ahead with U, and the hull is turned by psi, positive to port. In the hull's frame the velocity to
port is -U sin(psi), to starboard U sin(psi) = v: psi = -beta.
"""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from . import MeasuredError

FILE = "captive_kvlcc2.csv"
CASE = "captive_kvlcc2"
DENSITY = 1000.0  # kg/m^3
LENGTH = 7.0  # m


@dataclass(frozen=True)
class Table:
    """Steady states: `columns` of equal length [rows] by the name that `hydro gap` reads."""

    name: str
    columns: dict[str, np.ndarray]

    def summary(self) -> str:
        """One line for people."""
        return f"{len(next(iter(self.columns.values())))} steady states"


def read(folder: Path) -> np.ndarray:
    """Rows [n, 5]: drift angle [rad], speed [m/s], X', Y', N'."""
    path = folder / FILE
    if not path.is_file():
        raise MeasuredError(f"{path} is not there: give the folder that holds it by --data")
    with path.open(newline="") as file:
        rows = [
            [float(row[name]) for name in ("beta_deg", "speed_m_s", "X'", "Y'", "N'")] for row in csv.DictReader(file)
        ]
    table = np.array(rows)
    table[:, 0] = np.radians(table[:, 0])
    return table


def steady(rows: np.ndarray) -> Table:
    """The table of rows as [`read`] gives them, in MuJoCo's frame and signs."""
    beta, speed, x, y, n = rows.T
    pressure = 0.5 * DENSITY * LENGTH**2 * speed**2
    columns = {
        "tow_vel": speed,
        "yaw": -beta,
        "force[0]": -x * pressure,
        "force[1]": y * pressure,
        "torque[2]": n * pressure * LENGTH,
    }
    return Table("steady", columns)


def trials(folder: Path) -> list[Table]:
    """The one table."""
    return [steady(read(folder))]


def write(table: Table, folder: Path) -> Path:
    """Write `folder/<name>.csv`."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{table.name}.csv"
    with path.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(table.columns)
        writer.writerows([repr(float(value)) for value in row] for row in zip(*table.columns.values()))
    return path
