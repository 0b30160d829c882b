"""Measurements that correct an inertial navigation system: DVL, pressure, GPS."""

import mujoco
import numpy as np

from .dvl import Dvl
from .error_state import ATTITUDE, MOTION, POSITION, VELOCITY, Estimate, correct, skew
from .gps import Gps
from .imu import matrix
from .pressure import Pressure


def by_dvl(
    estimate: Estimate, data: mujoco.MjData, dvl: Dvl, lever: np.ndarray, turn: np.ndarray, rate: np.ndarray, scale: int
) -> Estimate:
    """The estimate after bottom track, z = (1 + s) T (R' v + w x l); unchanged where there is none.

    Args:
        estimate: before. data, dvl: to be read.
        lever: l, from the inertial unit to the DVL along the unit's axes [m].
        turn: T, from the unit's axes to the DVL's.
        rate: w, of the unit along its axes [rad/s].
        scale: row of the DVL's error of scale s.
    """
    reading = dvl.read(data)
    if not np.isfinite(reading.bottom).all():
        return estimate
    axes = matrix(estimate.attitude)
    along = turn @ (axes.T @ estimate.velocity + np.cross(rate, lever))
    known = 1 + estimate.instruments[scale - MOTION]
    rows = np.zeros((3, len(estimate.covariance)))
    rows[:, VELOCITY] = known * turn @ axes.T
    rows[:, ATTITUDE] = known * turn @ axes.T @ skew(estimate.velocity)
    for gyro in (MOTION + 3, MOTION + 9):
        rows[:, gyro : gyro + 3] = known * turn @ skew(lever)
    rows[:, scale] = along
    beams = dvl.beams[np.isfinite(reading.ranges)]
    noise = dvl.velocity_noise**2 * np.linalg.inv(beams.T @ beams)
    return correct(estimate, reading.bottom - known * along, rows, noise)


def by_pressure(
    estimate: Estimate, data: mujoco.MjData, pressure: Pressure, lever: np.ndarray, extra: float, bias: int
) -> Estimate:
    """The estimate after depth, z = waterline - (p + R l)_z + b / (rho g); unchanged without weight of the water.

    A reading that air may have given, within three standard deviations of the air's pressure, tells no height.

    Args:
        estimate: before. data, pressure: to be read.
        lever: l, from the inertial unit to the sensor along the unit's axes [m].
        extra: standard deviation of depth beside the sensor's [m].
        bias: row of the sensor's bias b [Pa].
    """
    water = pressure.mount.water
    weight = water.density * water.gravity
    if not weight:
        return estimate
    depth = pressure.read(data).depth
    white = np.hypot(pressure.deviations[0], pressure.rounding)
    if depth * weight < 3 * np.hypot(white, pressure.deviations[1]):
        return estimate
    reach = matrix(estimate.attitude) @ lever
    rows = np.zeros((1, len(estimate.covariance)))
    rows[0, POSITION] = [0, 0, -1]
    rows[0, ATTITUDE] = skew(reach)[2]
    rows[0, bias] = 1 / weight
    expected = (water.waterline or 0.0) - estimate.position[2] - reach[2]
    expected += estimate.instruments[bias - MOTION] / weight
    noise = (white / weight) ** 2 + extra**2
    return correct(estimate, np.array([depth - expected]), rows, np.array([[noise]]))


def by_gps(estimate: Estimate, data: mujoco.MjData, gps: Gps, lever: np.ndarray, slow: int) -> Estimate:
    """The estimate after a fix, z = p + R l + s; unchanged where there is none.

    Args:
        estimate: before. data, gps: to be read.
        lever: l, from the inertial unit to the antenna along the unit's axes [m].
        slow: first row of the slow error s [m].
    """
    reading = gps.read(data)
    if not reading.is_fixed:
        return estimate
    reach = matrix(estimate.attitude) @ lever
    rows = np.zeros((3, len(estimate.covariance)))
    rows[:, POSITION] = rows[:, slow : slow + 3] = np.eye(3)
    rows[:, ATTITUDE] = -skew(reach)
    expected = estimate.position + reach + estimate.instruments[slow - MOTION : slow - MOTION + 3]
    return correct(estimate, reading.position - expected, rows, np.diag(gps.white**2))
