"""One run of the tank: a leg configuration at one speed, towed along x, y and xy in sequence."""

from dataclasses import dataclass

import numpy as np

from hydro_mujoco.recording.randomness import generator

from . import cell, conditions, force, motion

#: Time step of the strips [s]; a multiple of the cell's period.
STEP = 0.02
#: Random stream of the tank; those of Task 2 are below 200.
STREAM = 200


@dataclass(frozen=True)
class Run:
    """The record of one run; forces in the base frame.

    reading: [N,3] N at `rate` [Hz]; condition: [3], one for each tow;
    marks: [3,4] s, the instants when each tow leaves rest, reaches its speed, brakes and stands;
    rest: seconds for which the robot surely rests before it leaves;
    truth: [T,3] N at `truth_rate` [Hz], the water's force, which no tank knows.
    """

    reading: np.ndarray
    rate: float
    condition: np.ndarray
    marks: np.ndarray
    rest: float
    truth: np.ndarray
    truth_rate: float


def tow(seed: int, repeat: int, number: int) -> Run:
    """Run `number` (0 to 63), for the `repeat`-th time; it depends on these and on the seed alone."""
    towed = conditions.of_run(number)
    path, marks = motion.tows(towed, STEP)
    water = force.along(path, generator(seed, STREAM, repeat, number, 0)).total
    reading = cell.read(path, water, generator(seed, STREAM, repeat, number, 1))
    return Run(
        reading,
        cell.RATE,
        np.array([c.index for c in towed], np.int32),
        np.array([[m.leave, m.reach, m.brake, m.stop] for m in marks]),
        motion.REST,
        water,
        1 / STEP,
    )
