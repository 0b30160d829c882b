"""A way on a circle, and the error of a navigation system."""

import mujoco
import numpy as np

from hydro_mujoco.sensors.imu import matrix
from seabed import move


def circle(model, data, time, *, radius=20.0, rate=0.08):
    """Put the vehicle on a circle, nose ahead, bobbing and rolling; returns true position and velocity in the world."""
    angle, heading = rate * time, rate * time + np.pi / 2
    place = np.array([radius * np.cos(angle), radius * np.sin(angle), -5 + np.sin(0.1 * time)])
    velocity = np.array([-radius * rate * np.sin(angle), radius * rate * np.cos(angle), 0.1 * np.cos(0.1 * time)])
    move(model, data, place=place, velocity=velocity, time=time, rate=(0, 0, rate))
    data.joint("free").qpos[3:] = np.cos(heading / 2), 0, 0, np.sin(heading / 2)
    mujoco.mj_forward(model, data)
    return place, velocity


def error(reading, position, velocity, attitude):
    """True less estimated: position [m], velocity [m/s], rotation vector about world axes [rad], shape (9,)."""
    turn = attitude.reshape(3, 3) @ matrix(reading.attitude).T
    rotation = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    return np.concatenate([position - reading.position, velocity - reading.velocity, rotation])
