"""The roll decay of a tanker model: one release, as one trial.

Source: test 21337 of `martinlarsalbert/Prediction-of-roll-motion-using-fully-nonlinear-potential-flow-and-
Ikedas-method` (MIT); see the README beside the data.
"""

from pathlib import Path

import numpy as np

from . import MeasuredError
from .trial import Trial

FILE = "roll_decay_kvlcc2_zero_speed.csv"
CASE = "roll_decay"
# Half the window [s] of the parabola through an extremum; a twelfth of a period on each side.
HALF_WINDOW_S = 0.2


def read(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Time [n] s and roll angle [n] rad."""
    path = folder / FILE
    if not path.is_file():
        raise MeasuredError(f"{path} is not there: give the folder that holds it by --data")
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    if table.ndim != 2 or table.shape[1] != 2:
        raise MeasuredError(f"{path}: expected the columns time_s,roll_rad")
    return table[:, 0], table[:, 1]


def free_from(time: np.ndarray, roll: np.ndarray) -> int:
    """The row from which the model surely rolls by itself.

    It lies still, is pressed over by hand to its largest heel and let go. The first extremum after that, on the
    other side, half a period later, is taken: no hand follows it there.
    """
    released = int(np.argmax(np.abs(roll)))
    after = roll[released:] * -np.sign(roll[released])
    # The first swing to the other side ends where the angle crosses zero again.
    crossed = np.flatnonzero(after > 0)
    if crossed.size == 0:
        raise MeasuredError("the roll angle never crosses zero after its largest value: there is no decay in it")
    back = np.flatnonzero(after[crossed[0] :] <= 0)
    end = crossed[0] + (back[0] if back.size else after.size - crossed[0])
    return released + int(crossed[0] + np.argmax(after[crossed[0] : end]))


def initial_state(time: np.ndarray, roll: np.ndarray, row: int) -> tuple[float, float]:
    """Angle [rad] and rate [rad/s] at a row: value and slope of the parabola through 0.2 s on both sides."""
    near = np.abs(time - time[row]) <= HALF_WINDOW_S
    _, rate, angle = np.polyfit(time[near] - time[row], roll[near], 2)
    return float(angle), float(rate)


def trials(folder: Path) -> list[Trial]:
    """The one trial: from the second extremum to the end of the record."""
    time, roll = read(folder)
    row = free_from(time, roll)
    angle, rate = initial_state(time, roll, row)
    return [Trial("release", time[row:] - time[row], {"roll_angle": roll[row:]}, angle, rate)]
