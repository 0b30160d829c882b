"""Prescribed motion of the robot: speed of the carriage, posture and direction.

A tow: rest, a raised-cosine ramp, steady speed, the same ramp down, rest. Switching conditions: speed,
direction and posture change at once, half-way between two samples. No carriage does that; the paper
joins measured conditions in the same way. The impulse of the added mass falls between the samples
and the legs are taken to be in their new place without having swung there; wakes and the drag's lag
take the time that they take.
"""

from dataclasses import dataclass

import numpy as np

from .conditions import Condition, Stance

#: Ramp to speed and back [s].
RAMP = 2.0
#: Rest that is recorded before and after each tow, and the wait before it, in which the water settles [s].
REST, SETTLE = 6.0, 20.0
#: Way that a tow goes before it counts as steady [m], and time that it then lasts [s].
START_UP, STEADY = 4.0, 14.0


@dataclass(frozen=True)
class Motion:
    """T rows, `step` seconds apart.

    stances: those that occur; stance [T], index into them; speed [T] m/s and acceleration [T] m/s^2 along the
    direction of the stance. underway: it has moved like the first row for ever; else it was at rest.
    """

    step: float
    stances: tuple[Stance, ...]
    stance: np.ndarray
    speed: np.ndarray
    acceleration: np.ndarray
    underway: bool

    @property
    def time(self) -> np.ndarray:
        """[T] s"""
        return np.arange(len(self.speed)) * self.step

    @property
    def directions(self) -> np.ndarray:
        """Unit vectors [T,3], base frame."""
        return np.array([stance.unit for stance in self.stances])[self.stance]


@dataclass(frozen=True)
class Marks:
    """When a tow leaves rest, reaches its speed, brakes and stands still [s]."""

    leave: float
    reach: float
    brake: float
    stop: float


def duration(speed: float) -> float:
    """Seconds between the ramps."""
    return float(np.ceil(START_UP / speed) + STEADY)


def tows(conditions: tuple[Condition, ...], step: float) -> tuple[Motion, tuple[Marks, ...]]:
    """The conditions towed one after the other, at rest in between."""
    marks, at = [], REST
    for condition in conditions:
        reach = at + RAMP
        brake = reach + duration(condition.speed)
        marks.append(Marks(at, reach, brake, brake + RAMP))
        at = brake + RAMP + SETTLE + REST
    time = np.arange(round(at / step)) * step
    speed, acceleration, stance = np.zeros_like(time), np.zeros_like(time), np.zeros(len(time), int)
    for number, (condition, mark) in enumerate(zip(conditions, marks)):
        # Turned round while the robot rests, before its next tow is zeroed.
        stance[time >= mark.leave - REST - step / 2] = number
        for start, sign in ((mark.leave, 1.0), (mark.brake, -1.0)):
            phase = np.clip((time - start) / RAMP, 0.0, 1.0)
            speed += sign * condition.speed * 0.5 * (1.0 - np.cos(np.pi * phase))
            acceleration += sign * condition.speed * 0.5 * np.pi / RAMP * np.sin(np.pi * phase)
    stances = tuple(condition.stance for condition in conditions)
    return Motion(step, stances, stance, np.maximum(speed, 0.0), acceleration, underway=False), tuple(marks)


def switching(conditions: tuple[Condition, ...], *, samples: int, period: float, substeps: int) -> Motion:
    """Conditions held for `samples` samples of `period` s, the first before too; row substeps * k is sample k."""
    # Half-way between two samples, so that no sample falls on a switch.
    rows = samples * substeps
    at = (np.arange(rows * len(conditions)) + substeps // 2) // rows
    number = np.minimum(at, len(conditions) - 1)
    speed = np.array([condition.speed for condition in conditions])[number]
    return Motion(
        period / substeps,
        tuple(condition.stance for condition in conditions),
        number,
        speed,
        np.zeros(len(speed)),
        underway=True,
    )
