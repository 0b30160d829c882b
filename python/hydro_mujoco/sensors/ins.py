"""Inertial navigation: position, velocity and attitude from gyros and accelerometers, aided by other instruments."""

from dataclasses import dataclass

import mujoco
import numpy as np

from ..errors import DataError
from .aids import by_dvl, by_gps, by_pressure
from .arguments import at_least, numbers
from .dvl import Dvl
from .error_state import ATTITUDE, MOTION, POSITION, VELOCITY, Estimate, Instruments, correct, predict
from .gps import Gps
from .imu import Imu, Motion, disturbed, increments, matrix, quaternion, turned
from .mount import Mount
from .noise import Noise
from .pressure import Pressure


@dataclass(frozen=True)
class InsReading:
    """An estimate.

    Attributes:
        time: [s]. position, velocity: of the instrument in the world [m], [m/s], shape (3,).
        attitude: quaternion w x y z that turns the instrument's axes to the world's.
        rate: angular velocity along the instrument's axes, mean over the step [rad/s], shape (3,); acceleration: of the
            accelerometers, less gravity, likewise, along the axes half-way through the step [m/s^2]; both 0 at the
            first reading.
        covariance: of the errors of position [m], velocity [m/s] and attitude (about world axes [rad]), shape (9, 9).
    """

    time: float
    position: np.ndarray
    velocity: np.ndarray
    attitude: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray
    covariance: np.ndarray

    @property
    def deviation(self) -> np.ndarray:
        """Standard deviations along world axes: rows of position [m], velocity [m/s], attitude [rad], shape (3, 3)."""
        return np.sqrt(np.diag(self.covariance)).reshape(3, 3)


@dataclass(frozen=True)
class InsState:
    """What an `Ins` remembers: last true motion, estimate, rate and acceleration, when it next reads its aids [s]."""

    motion: Motion
    estimate: Estimate
    rate: np.ndarray
    acceleration: np.ndarray
    due: float


class Ins:
    """A strapdown inertial navigation system with an error-state Kalman filter.

    It integrates the increments of angle and velocity of an `Imu` from an alignment with errors, at the first reading.
    Aids are optional: bottom track of a DVL, depth by pressure, GPS, and `fix`es by any other means; without them it
    drifts. The filter knows the deviations of all errors and estimates, beside motion, the biases, the DVL's scale, the
    pressure's bias and the slow error of GPS. The earth is flat and does not turn: no Schuler oscillation, no earth
    rate, no finding of north. Scale factors and misalignments of the inertial unit are 0.

    Errors are functions of seed, name and time, but the estimate is remembered: read it once a step, and keep
    `state()` with a copied state of the simulation to `restore` it. Where time goes back it aligns itself anew.

    Source: P. D. Groves, Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems, 2nd ed., Artech
    House 2013, chapters 5, 14 and 15; J. Sola, arXiv:1711.02508, 2017.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        name: str,
        *,
        imu: Imu | None = None,
        dvl: Dvl | None = None,
        pressure: Pressure | None = None,
        gps: Gps | None = None,
        period: float = 0.2,
        depth_noise: float = 0.0,
        position: float = 0.1,
        velocity: float = 0.02,
        tilt: float = 0.05,
        heading: float = 0.3,
        seed: int = 0,
    ):
        """Mount the instrument.

        Args:
            model: compiled. name: of a site, or of a body; with water about it.
            imu: errors of gyros and accelerometers; those of a tactical unit by default.
            dvl, pressure, gps: aids, on the same rigid body.
            period: from reading to reading of the aids [s].
            depth_noise: standard deviation of depth that the filter adds to the pressure sensor's, for waves [m].
            position, velocity: standard deviations of the alignment along each axis [m], [m/s].
            tilt, heading: about world x and y, and about z [degrees].
            seed: of all errors.

        Raises:
            DataError: there is no such place, no water about it, an aid is elsewhere, or a number is out of bounds.
        """
        if imu is not None and not isinstance(imu, Imu):
            raise DataError(f"imu is {imu!r}; expected an Imu")
        self._mount, self._noise, self._imu = Mount(model, name), Noise(seed, f"ins {name}"), imu or Imu()
        self._dvl, self._pressure, self._gps = dvl, pressure, gps
        for aid, kind in ((dvl, Dvl), (pressure, Pressure), (gps, Gps)):
            if aid is not None and not isinstance(aid, kind):
                raise DataError(f"an aid is {aid!r}; expected a {kind.__name__}")
            self._check_aid(model, aid)
        self._period = at_least("period", period, 0, " s")
        self._depth_noise = at_least("depth_noise", depth_noise, 0, " m")
        at_first = [at_least("position", position, 0, " m")] * 3 + [at_least("velocity", velocity, 0, " m/s")] * 3
        tilted = np.radians(at_least("tilt", tilt, 0, " degrees"))
        self._alignment = np.array([*at_first, tilted, tilted, np.radians(at_least("heading", heading, 0, " degrees"))])
        random = self._noise.constant(6 + MOTION)
        self._bias, self._misaligned = self._imu.constant * random[:6], self._alignment * random[6:]
        others = [(self._imu.constant, np.inf), (self._imu.instability, self._imu.memory)]
        if dvl:
            others.append((np.array([dvl.scale_error]), np.inf))
        if pressure:
            # At a depth that stays, the rounding does too.
            others.append((np.array([np.hypot(pressure.deviations[1], pressure.rounding)]), np.inf))
        if gps:
            others.append((gps.slow, gps.time_constant))
        self._instruments = Instruments(
            np.concatenate([deviation for deviation, _ in others]),
            np.concatenate([np.full(deviation.size, memory) for deviation, memory in others]),
            self._imu.walk,
        )
        self._state: InsState | None = None

    def reset(self) -> None:
        """Forget the estimate; the next reading aligns anew."""
        self._state = None

    def state(self) -> InsState | None:
        """What is remembered; None before the first reading. It never changes, so it may be kept as it is."""
        return self._state

    def restore(self, state: InsState | None) -> None:
        """Go on from what `state()` gave, with the state of the simulation of then."""
        self._state = state

    def read(self, data: mujoco.MjData) -> InsReading:
        """The estimate at the state of `data`."""
        self._mount.check(data)
        axes = self._mount.axes(data)
        motion = Motion(data.time, self._mount.position(data), axes @ self._mount.velocity(data), quaternion(axes))
        state = self._state
        if state is None or motion.time < state.motion.time:
            state = self._aligned(motion)
        elif motion.time > state.motion.time:
            state = self._moved(data, state, motion)
        self._state, estimate = state, state.estimate
        return InsReading(
            data.time,
            estimate.position.copy(),
            estimate.velocity.copy(),
            estimate.attitude.copy(),
            state.rate.copy(),
            state.acceleration.copy(),
            estimate.covariance[:MOTION, :MOTION].copy(),
        )

    def fix(self, position: tuple[float, float, float] | np.ndarray, deviation: float) -> None:
        """Correct the estimate by a position in the world [m], as of the last reading; by USBL or ranges of modems.

        Args:
            position: of the instrument, shape (3,). deviation: standard deviation along each axis [m].

        Raises:
            DataError: nothing has been read, or a number is out of bounds.
        """
        if self._state is None:
            raise DataError("a fix came before the first reading; expected `read` once a step")
        measured = np.array(numbers("position", position, 3))
        if not np.isfinite(measured).all():
            raise DataError(f"position is {measured.tolist()} m; expected finite numbers")
        variance = at_least("deviation", deviation, 1e-9, " m") ** 2
        estimate = self._state.estimate
        rows = np.eye(3, len(estimate.covariance))
        fixed = correct(estimate, measured - estimate.position, rows, variance * np.eye(3))
        self._state = InsState(self._state.motion, fixed, self._state.rate, self._state.acceleration, self._state.due)

    def _check_aid(self, model: mujoco.MjModel, aid: Dvl | Pressure | Gps | None) -> None:
        if aid is None:
            return
        if aid.mount.model is not model:
            raise DataError(f"the aid at `{aid.mount.name}` is of another model")
        if model.body_weldid[aid.mount.body] != model.body_weldid[self._mount.body]:
            raise DataError(f"the aid at `{aid.mount.name}` moves against `{self._mount.name}`; expected the same body")

    def _aligned(self, motion: Motion) -> InsState:
        """The first estimate: the true motion with the errors of alignment."""
        error = self._misaligned
        along = matrix(motion.attitude).T @ error[ATTITUDE]
        estimate = Estimate(
            motion.time,
            motion.position + error[POSITION],
            motion.velocity + error[VELOCITY],
            turned(motion.attitude, along),
            np.zeros(self._instruments.deviation.size),
            np.diag(np.concatenate([self._alignment, self._instruments.deviation]) ** 2),
        )
        return InsState(motion, estimate, np.zeros(3), np.zeros(3), motion.time)

    def _moved(self, data: mujoco.MjData, state: InsState, motion: Motion) -> InsState:
        """The state after a step, and after the aids where they are due."""
        gravity = self._mount.model.opt.gravity
        measured = disturbed(increments(state.motion, motion, gravity), self._imu, self._bias, self._noise, motion.time)
        estimate = predict(state.estimate, measured, gravity, self._instruments)
        bias = estimate.instruments[:6] + estimate.instruments[6:12]
        rate = measured.angle / measured.duration - bias[3:]
        acceleration = measured.velocity / measured.duration - bias[:3]
        # The velocity is along the axes half-way through the turn.
        acceleration += matrix(turned(estimate.attitude, -0.5 * measured.duration * rate)).T @ gravity
        due = state.due
        if motion.time >= due - 1e-9:
            due = motion.time + self._period
            estimate = self._aided(data, estimate, rate)
        return InsState(motion, estimate, rate, acceleration, due)

    def _aided(self, data: mujoco.MjData, estimate: Estimate, rate: np.ndarray) -> Estimate:
        """The estimate after readings of the aids."""
        place, axes = self._mount.position(data), self._mount.axes(data)
        first = MOTION + 12
        if self._dvl:
            mount = self._dvl.mount
            lever, turn = axes.T @ (mount.position(data) - place), mount.axes(data).T @ axes
            estimate = by_dvl(estimate, data, self._dvl, lever, turn, rate, first)
            first += 1
        if self._pressure:
            lever = axes.T @ (self._pressure.mount.position(data) - place)
            estimate = by_pressure(estimate, data, self._pressure, lever, self._depth_noise, first)
            first += 1
        if self._gps:
            lever = axes.T @ (self._gps.mount.position(data) - place)
            estimate = by_gps(estimate, data, self._gps, lever, first)
        return estimate
