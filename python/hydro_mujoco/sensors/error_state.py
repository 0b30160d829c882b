"""Error-state Kalman filter of inertial navigation: strapdown equations, covariance, corrections."""

from dataclasses import dataclass

import mujoco
import numpy as np

from .imu import Increments, matrix, turned

#: Rows of the errors of position [m], velocity [m/s] and attitude (rotation vector along world axes [rad]).
POSITION, VELOCITY, ATTITUDE = slice(0, 3), slice(3, 6), slice(6, 9)
#: Least variance of a measurement, in its units squared: a perfect aid of a perfect unit leaves no other spread.
LEAST_NOISE = 1e-12
#: Errors of motion, before those of instruments.
MOTION = 9


@dataclass(frozen=True)
class Estimate:
    """What the filter knows.

    Attributes:
        time: [s]. position, velocity: in the world [m], [m/s], shape (3,). attitude: quaternion w x y z.
        instruments: estimated errors of instruments, shape (m,).
        covariance: of the errors (true less estimated) of position, velocity, attitude and instruments, shape (9 + m,
            9 + m).
    """

    time: float
    position: np.ndarray
    velocity: np.ndarray
    attitude: np.ndarray
    instruments: np.ndarray
    covariance: np.ndarray


@dataclass(frozen=True)
class Instruments:
    """Errors of instruments that the filter estimates: zero on average, with a deviation and the memory exp(-lag / T).

    The first twelve are biases of accelerometers [m/s^2] and gyros [rad/s]: six constant ones, six with memory.

    Attributes:
        deviation: shape (m,). memory: T [s], infinity where an error is constant, shape (m,).
        walk: of velocity [m/s/sqrt(s)] and angle [rad/sqrt(s)], shape (6,).
    """

    deviation: np.ndarray
    memory: np.ndarray
    walk: np.ndarray


def predict(estimate: Estimate, measured: Increments, gravity: np.ndarray, instruments: Instruments) -> Estimate:
    """The estimate after increments: strapdown navigation over a flat earth at rest, and the growth of its covariance.

    v+ = v + R dv + g dt, p+ = p + (v + v+) dt / 2, R+ = R Exp(dtheta), with the estimated biases taken off.

    Source: D. H. Titterton and J. L. Weston, Strapdown Inertial Navigation Technology, 2nd ed., IET 2004, chapters 3
    and 11; J. Sola, Quaternion kinematics for the error-state Kalman filter, arXiv:1711.02508, 2017, chapter 7.
    """
    step = measured.duration
    bias = estimate.instruments[:6] + estimate.instruments[6:12]
    angle = measured.angle - bias[3:] * step
    axes = matrix(turned(estimate.attitude, 0.5 * angle))
    gained = axes @ (measured.velocity - bias[:3] * step)
    velocity = estimate.velocity + gained + gravity * step
    position = estimate.position + 0.5 * step * (estimate.velocity + velocity)

    size = MOTION + instruments.deviation.size
    transition = np.eye(size)
    transition[POSITION, VELOCITY] = step * np.eye(3)
    transition[VELOCITY, ATTITUDE] = -skew(gained)
    for first in (MOTION, MOTION + 6):
        transition[VELOCITY, first : first + 3] = -step * axes
        transition[ATTITUDE, first + 3 : first + 6] = -step * axes
        transition[VELOCITY, first + 3 : first + 6] = 0.5 * step * skew(gained) @ axes
    transition[POSITION, ATTITUDE.start :] = 0.5 * step * transition[VELOCITY, ATTITUDE.start :]
    kept = np.exp(-step / instruments.memory)
    transition[range(MOTION, size), range(MOTION, size)] = kept

    # White noise on velocity (and half a step of it on position) and on angle; what renews the instruments' errors.
    noise = np.zeros((size, size))
    speed, turn = step * instruments.walk[0] ** 2, step * instruments.walk[3] ** 2
    noise[VELOCITY, VELOCITY], noise[ATTITUDE, ATTITUDE] = speed * np.eye(3), turn * np.eye(3)
    noise[POSITION, VELOCITY] = noise[VELOCITY, POSITION] = 0.5 * step * speed * np.eye(3)
    noise[POSITION, POSITION] = (0.5 * step) ** 2 * speed * np.eye(3)
    noise[range(MOTION, size), range(MOTION, size)] = instruments.deviation**2 * (1 - kept**2)
    return Estimate(
        estimate.time + step,
        position,
        velocity,
        turned(estimate.attitude, angle),
        kept * estimate.instruments,
        transition @ estimate.covariance @ transition.T + noise,
    )


def correct(estimate: Estimate, residual: np.ndarray, rows: np.ndarray, noise: np.ndarray) -> Estimate:
    """The estimate after a measurement (Joseph's form).

    Args:
        estimate: before.
        residual: measured less expected, shape (k,).
        rows: derivatives of the measurement by the errors, shape (k, 9 + m).
        noise: covariance of the measurement's white noise, shape (k, k); `LEAST_NOISE` at least on its diagonal.
    """
    covariance = estimate.covariance
    noise = noise + np.diag(np.maximum(LEAST_NOISE - np.diag(noise), 0))
    spread = rows @ covariance @ rows.T + noise
    gain = np.linalg.solve(spread, rows @ covariance).T
    error = gain @ residual
    rest = np.eye(len(covariance)) - gain @ rows
    # Rotations along world axes stand on the left of the attitude.
    attitude = np.zeros(4)
    mujoco.mju_mulQuat(attitude, turned(np.array([1.0, 0, 0, 0]), error[ATTITUDE]), estimate.attitude)
    return Estimate(
        estimate.time,
        estimate.position + error[POSITION],
        estimate.velocity + error[VELOCITY],
        attitude,
        estimate.instruments + error[MOTION:],
        rest @ covariance @ rest.T + gain @ noise @ gain.T,
    )


def skew(vector: np.ndarray) -> np.ndarray:
    """Matrix of the cross product with a vector from the left, shape (3, 3)."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
