"""Flights of a Crazyflie quadrotor: three as it is, two with a weight near motor 3; two hops a flight, a trial each.

Source: `AerialRoboticsUUST/CrazyPAD` (MIT, doi 10.3390/data9060079); see the README beside the data. The model has no
floor, so a trial is what lies between take-off and landing.
"""

import csv
from pathlib import Path

import numpy as np

from . import MeasuredError
from .trial import Trial

FILE = "crazyflie_flights.csv"
SCENE = "crazyflie"
# Beginning of the flights' names by case.
FLIGHTS = {"crazyflie_normal": "normal", "crazyflie_weight": "weight"}
MOTORS = ("m1", "m2", "m3", "m4")
# Height [m] from which it flies: below, the floor and the cushion of air on it push too (a rotor's radius is 0.023 m).
AIRBORNE_M = 0.1
# Hops shorter than this [s] are none.
SHORTEST_S = 1.0


def read(folder: Path) -> dict[str, np.ndarray]:
    """Rows [n, 8] by flight: time [s], height [m], climb [m/s], roll [deg], four motor commands (0 to 65535)."""
    path = folder / FILE
    if not path.is_file():
        raise MeasuredError(f"{path} is not there: give the folder that holds it by --data")
    flights: dict[str, list[tuple[float, ...]]] = {}
    with path.open(newline="") as file:
        for row in csv.DictReader(file):
            values = tuple(float(row[name]) for name in ("time_s", "z_m", "vz_m_s", "roll_deg", *MOTORS))
            flights.setdefault(row["flight"], []).append(values)
    return {name: np.array(rows) for name, rows in flights.items()}


def hops(rows: np.ndarray) -> list[slice]:
    """Rows between take-off and landing: above `AIRBORNE_M` with all motors on."""
    flies = (rows[:, 1] > AIRBORNE_M) & (rows[:, 4:] > 0).all(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flies.astype(int), [0]])))
    found = [slice(first, end) for first, end in zip(edges[::2], edges[1::2])]
    return [of for of in found if rows[of.stop - 1, 0] - rows[of.start, 0] >= SHORTEST_S]


def trials(folder: Path, case: str) -> list[Trial]:
    """The hops of the flights of one kind."""
    made = []
    for flight, rows in sorted(read(folder).items()):
        if not flight.startswith(FLIGHTS[case]):
            continue
        for number, of in enumerate(hops(rows), 1):
            time, height, climb, roll = rows[of, :4].T
            sensors = {"height": height, "climb": climb, "roll": np.radians(roll)}
            controls = dict(zip(MOTORS, rows[of, 4:].T))
            made.append(Trial(f"{flight}-hop-{number}", time - time[0], sensors, controls=controls))
    if not made:
        raise MeasuredError(f"{folder / FILE} has no flight whose name begins with {FLIGHTS[case]}")
    return made
