"""Inertial measurement unit: increments of angle and velocity, with their errors."""

from dataclasses import dataclass

import mujoco
import numpy as np

from .arguments import at_least
from .noise import Noise

#: Seconds of an hour.
HOUR = 3600.0


@dataclass(frozen=True)
class Imu:
    """Errors of gyros and accelerometers, each standard deviations of each axis, as data sheets give them.

    The defaults are of the order of a tactical fibre-optic unit (KVH 1750; P. D. Groves, Principles of GNSS, Inertial,
    and Multisensor Integrated Navigation Systems, 2nd ed., Artech House 2013, chapter 4).

    Attributes:
        gyro_bias: constant for a seed [degrees/h]. gyro_instability: of a bias with memory [degrees/h].
        gyro_walk: angle random walk [degrees/sqrt(h)].
        accelerometer_bias: constant for a seed [m/s^2]. accelerometer_instability: of a bias with memory [m/s^2].
        accelerometer_walk: velocity random walk [m/s/sqrt(h)].
        memory: T of the biases with memory, whose autocorrelation is exp(-lag / T) (Gauss-Markov) [s].

    Raises:
        DataError: one of them is negative or not finite.
    """

    gyro_bias: float = 1.0
    gyro_instability: float = 0.05
    gyro_walk: float = 0.012
    accelerometer_bias: float = 0.01
    accelerometer_instability: float = 5e-4
    accelerometer_walk: float = 0.07
    memory: float = 1000.0

    def __post_init__(self) -> None:
        """Check all of them."""
        for name, value in vars(self).items():
            at_least(name, value, 1e-3 if name == "memory" else 0)

    @property
    def constant(self) -> np.ndarray:
        """Deviations of the constant biases, accelerometers [m/s^2], gyros [rad/s], shape (6,)."""
        return np.repeat([self.accelerometer_bias, np.radians(self.gyro_bias) / HOUR], 3)

    @property
    def instability(self) -> np.ndarray:
        """Deviations of the biases with memory, likewise."""
        return np.repeat([self.accelerometer_instability, np.radians(self.gyro_instability) / HOUR], 3)

    @property
    def walk(self) -> np.ndarray:
        """Deviations of velocity [m/s/sqrt(s)] and angle [rad/sqrt(s)] by random walk, shape (6,)."""
        return np.repeat([self.accelerometer_walk, np.radians(self.gyro_walk)], 3) / np.sqrt(HOUR)


@dataclass(frozen=True)
class Motion:
    """True motion at a time [s]: place [m], velocity [m/s] and quaternion w x y z in the world."""

    time: float
    position: np.ndarray
    velocity: np.ndarray
    attitude: np.ndarray


@dataclass(frozen=True)
class Increments:
    """What a strapdown unit gives over a time [s], along its axes: angle [rad] and velocity of specific force [m/s].

    The velocity is along the axes half-way through the turn: coning and sculling are taken care of.
    """

    duration: float
    velocity: np.ndarray
    angle: np.ndarray


def increments(before: Motion, after: Motion, gravity: np.ndarray) -> Increments:
    """Those between two motions, free of errors; gravity in the world [m/s^2], shape (3,)."""
    duration, angle = after.time - before.time, np.zeros(3)
    mujoco.mju_subQuat(angle, after.attitude, before.attitude)
    gained = after.velocity - before.velocity - gravity * duration
    return Increments(duration, matrix(turned(before.attitude, 0.5 * angle)).T @ gained, angle)


def disturbed(true: Increments, imu: Imu, bias: np.ndarray, noise: Noise, time: float) -> Increments:
    """Increments with the errors of a unit, functions of the seed and of the time at their end [s].

    Args:
        true: free of errors. imu: their deviations. bias: the constant ones, accelerometers and gyros, shape (6,).
        noise: of the unit. time: at the end of the increments [s].
    """
    bias = bias + imu.instability * noise.slow(time, imu.memory, 6)
    white = imu.walk * np.sqrt(true.duration) * noise.generator(time).standard_normal(6)
    error = bias * true.duration + white
    return Increments(true.duration, true.velocity + error[:3], true.angle + error[3:])


def turned(attitude: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """A quaternion turned by a rotation vector along its own axes [rad]."""
    result = attitude.copy()
    mujoco.mju_quatIntegrate(result, np.ascontiguousarray(angle), 1.0)
    return result


def matrix(attitude: np.ndarray) -> np.ndarray:
    """Rotation matrix of a quaternion, shape (3, 3)."""
    result = np.zeros(9)
    mujoco.mju_quat2Mat(result, attitude)
    return result.reshape(3, 3)


def quaternion(axes: np.ndarray) -> np.ndarray:
    """Quaternion w x y z of a rotation matrix."""
    result = np.zeros(4)
    mujoco.mju_mat2Quat(result, np.ascontiguousarray(axes).ravel())
    return result
