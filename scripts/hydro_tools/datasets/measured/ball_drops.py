"""Balls dropped from 47 m: two drops each, as two trials a ball.

Source: `briandesilva/discovery-of-physics-from-data` (MIT); see the README beside the data. The speed in it is
the film's height differentiated and smoothed (its error follows the slope of the height's error with a
correlation of 0.9 to 1): no second measurement, so it is left out unless asked for.
"""

import csv
from pathlib import Path

import numpy as np

from . import MeasuredError
from .trial import Trial

FILE = "ball_drops.csv"
# The ball's name in the data by the name of its case.
BALLS = {
    "ball_volleyball": "Volleyball",
    "ball_bowling_ball": "BowlingBall",
    "ball_tennis_ball": "TennisBall",
    "ball_orange_whiffle": "OrangeWhiffle",
}
GRAVITY = 9.81  # m/s^2
# The film starts with the ball in the hand: what comes before [s] is left out.
IN_HAND_S = 0.19
# Length [s] of the piece that the first state is estimated from: drag is below a tenth of the weight in it.
START_S = 0.5


def read(folder: Path) -> dict[tuple[str, str], np.ndarray]:
    """Rows [n, 3] by (ball, drop): time [s], height [m], speed upwards [m/s]."""
    path = folder / FILE
    if not path.is_file():
        raise MeasuredError(f"{path} is not there: give the folder that holds it by --data")
    drops: dict[tuple[str, str], list[tuple[float, ...]]] = {}
    with path.open(newline="") as file:
        for row in csv.DictReader(file):
            values = tuple(float(row[name]) for name in ("time_s", "height_m", "velocity_mps"))
            drops.setdefault((row["ball"], row["drop"]), []).append(values)
    return {key: np.array(rows) for key, rows in drops.items()}


def initial_state(time: np.ndarray, height: np.ndarray) -> tuple[float, float]:
    """Height [m] and speed [m/s] at the first row: a straight line through h + g t^2 / 2 over half a second."""
    since = time - time[0]
    early = since <= START_S
    speed, start = np.polyfit(since[early], height[early] + 0.5 * GRAVITY * since[early] ** 2, 1)
    return float(start), float(speed)


def trials(folder: Path, case: str, with_speed: bool = False) -> list[Trial]:
    """The drops of one ball, in free fall."""
    ball = BALLS[case]
    made = []
    for (name, drop), rows in sorted(read(folder).items()):
        if name != ball:
            continue
        time, height, speed = rows[rows[:, 0] >= IN_HAND_S].T
        sensors = {"height": height}
        if with_speed:
            sensors["speed"] = speed
        made.append(Trial(f"drop-{drop}", time - time[0], sensors, *initial_state(time, height)))
    if not made:
        raise MeasuredError(f"{folder / FILE} has no drop of {ball}; expected {', '.join(BALLS.values())}")
    return made
