"""A load cell between gantry and robot: its readings of the forces on the robot.

    reading = F + theta x F + zero + drift + vibration + noise
    F = force of the water + (weight - buoyancy) - m a

in the base frame, whose axes the cell's own miss by the small rotation theta. The robot's own inertia
m a is felt while the carriage changes speed. All magnitudes are judgement, of the order of what a
six-axis cell of some hundred newtons and a rail carriage show; each run draws its own.
"""

from dataclasses import dataclass

import numpy as np

from hydro_tools.robot import hull
from hydro_tools.robot.composition import fused

from .drag import DENSITY
from .motion import Motion

GRAVITY = 9.81  # m/s^2
MASS = sum(link.mass for link in fused().values())  # kg
#: Vertical force of gravity and buoyancy [N], negative as B1 sinks.
WET_WEIGHT = -GRAVITY * (MASS - DENSITY * hull.DISPLACED_LITRES * 1e-3)
#: Readings a second.
RATE = 200.0
#: Amplifier's zero: half-range [N].
ZERO = 6.0
#: Misalignment theta, standard deviation of each component [rad] (0.2 degrees).
MISALIGNMENT = 0.0035
#: Drift: a steady rate, standard deviation [N/s], and a random walk [N/sqrt(s)].
DRIFT_RATE, DRIFT_WALK = 0.01, 0.03
#: White noise, standard deviation [N].
NOISE = 0.3
#: The carriage's vibration: frequency range [Hz], amplitude at 0.5 m/s [N], wander of its phase [rad/sqrt(s)].
VIBRATION_BAND, VIBRATION, VIBRATION_WANDER = (6.0, 9.0), 0.5, 1.0


@dataclass(frozen=True)
class Faults:
    """Errors of the cell in one run: theta [3] rad, zero [3] N, rate [3] N/s, frequency [Hz]."""

    theta: np.ndarray
    zero: np.ndarray
    rate: np.ndarray
    frequency: float


def faults(rng: np.random.Generator) -> Faults:
    """Drawn for one run."""
    return Faults(
        rng.normal(0, MISALIGNMENT, 3),
        rng.uniform(-ZERO, ZERO, 3),
        rng.normal(0, DRIFT_RATE, 3),
        float(rng.uniform(*VIBRATION_BAND)),
    )


def read(motion: Motion, water: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Readings [N,3] N at RATE of the water's force [T,3] N along the motion."""
    found = faults(rng)
    inertia = -MASS * motion.acceleration[:, None] * motion.directions
    force = water + inertia + np.array([0.0, 0.0, WET_WEIGHT])
    count = round(len(motion.speed) * motion.step * RATE)
    time = np.arange(count) / RATE

    def fine(values: np.ndarray) -> np.ndarray:
        return np.stack([np.interp(time, motion.time, column) for column in values.T], axis=1)

    force = fine(force)
    speed = fine(motion.speed[:, None])
    step = np.sqrt(1.0 / RATE)
    drift = found.rate * time[:, None] + np.cumsum(rng.normal(0, DRIFT_WALK * step, (count, 3)), axis=0)
    wander = np.cumsum(rng.normal(0, VIBRATION_WANDER * step, (count, 3)), axis=0)
    vibration = VIBRATION * speed / 0.5 * np.sin(2 * np.pi * found.frequency * time[:, None] + wander)
    noise = rng.normal(0, NOISE, (count, 3))
    return force + np.cross(found.theta, force) + found.zero + drift + vibration + noise
