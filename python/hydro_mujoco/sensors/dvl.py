"""Doppler velocity log: velocity over the bottom and through the water, by four beams."""

from dataclasses import dataclass

import mujoco
import numpy as np

from ..errors import DataError
from .arguments import at_least, real, span
from .echoes import Echoes, Rays
from .mount import Mount, velocity_at
from .noise import Noise

#: Azimuths of the beams from the instrument's x towards its y [degrees].
AZIMUTHS = (45.0, 135.0, 225.0, 315.0)
#: Beams that a velocity needs.
FEWEST = 3
#: Points of a beam at which the water's velocity is taken.
SAMPLES = 5


@dataclass(frozen=True)
class DvlReading:
    """A ping.

    Attributes:
        time: [s].
        bottom: velocity of the instrument over the bottom, along its axes [m/s], shape (3,); not a number where fewer
            than three beams have an echo.
        water: velocity of the instrument through the water of the layer, likewise.
        ranges: along each beam [m], shape (4,); not a number without an echo.
        altitude: mean of the ranges times the cosine of the beams' angle [m]: the distance from the bottom where the
            instrument is level over a plane.
    """

    time: float
    bottom: np.ndarray
    water: np.ndarray
    ranges: np.ndarray
    altitude: float


class Dvl:
    """A DVL with four beams in Janus configuration, which look along -z of the instrument.

    A beam along the unit vector b measures b . (v - v_bottom) where it meets the bottom, which may move, and the mean
    of b . (v - v_water) over a layer of water; three or four of them give the velocity by least squares. The layer
    counts where no side lobe meets the bottom first: up to the cosine of the beams' angle times the range. Straight
    rays; the beams have no width.

    Source: Teledyne RD Instruments, Acoustic Doppler Current Profiler, Principles of Operation: A Practical Primer,
    2011; N. A. Brokloff, Matrix algorithm for Doppler sonar navigation, OCEANS 1994.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        name: str,
        *,
        angle: float = 30.0,
        reach: tuple[float, float] = (0.1, 50.0),
        layer: tuple[float, float] = (1.0, 5.0),
        velocity_noise: float = 0.004,
        scale_error: float = 0.002,
        range_noise: float = 0.01,
        dropout: float = 0.0,
        seed: int = 0,
    ):
        """Mount the instrument.

        Args:
            model: compiled. name: of a site, or of a body; with water about it.
            angle: between the beams and -z [degrees], above 0 and below 90.
            reach: least and greatest range of an echo [m].
            layer: of water track, begin and end along each beam [m].
            velocity_noise: standard deviation of a beam's velocity, from ping to ping [m/s].
            scale_error: standard deviation of the error of scale, constant for a seed [1].
            range_noise: standard deviation of a range [m].
            dropout: probability that a beam is lost in a ping, 0 to 1.
            seed: of all errors.

        Raises:
            DataError: there is no such place, no water about it, or a number is out of bounds.
        """
        if not 0 < real(angle) < 90:
            raise DataError(f"angle is {angle} degrees; expected above 0 and below 90")
        if not 0 <= real(dropout) <= 1:
            raise DataError(f"dropout is {dropout}; expected 0 to 1")
        self.mount, self._noise = Mount(model, name), Noise(seed, f"dvl {name}")
        self._rays = Rays(self.mount)
        self._reach, self._layer = span("reach", reach, " m"), span("layer", layer, " m")
        #: Standard deviations of a beam's velocity [m/s] and of the scale [1].
        self.velocity_noise = at_least("velocity_noise", velocity_noise, 0, " m/s")
        self.scale_error = at_least("scale_error", scale_error, 0)
        self._range_noise = at_least("range_noise", range_noise, 0, " m")
        self._scale = 1 + self.scale_error * float(self._noise.constant())
        angle = real(angle)
        self._dropout, self._cosine = real(dropout), float(np.cos(np.radians(angle)))
        azimuths, sine = np.radians(AZIMUTHS), np.sin(np.radians(angle))
        #: Unit vectors of the beams along the instrument's axes, shape (4, 3).
        self.beams = np.column_stack(
            [sine * np.cos(azimuths), sine * np.sin(azimuths), np.full(len(azimuths), -self._cosine)]
        )

    def read(self, data: mujoco.MjData) -> DvlReading:
        """A ping at the state of `data`."""
        self.mount.check(data)
        directions = self.beams @ self.mount.axes(data).T
        echoes = self._rays.cast(data, directions, self._reach)
        random = self._noise.generator(data.time)
        errors = random.standard_normal((3, len(directions)))
        lost = random.random(len(directions)) < self._dropout
        found = self._over_bottom(data, directions, echoes), self._through_water(data, directions, echoes.distance)
        bottom, water = (
            self._velocity(np.where(lost, np.nan, self._scale * along + self.velocity_noise * error))
            for along, error in zip(found, errors)
        )
        ranges = np.where(lost, np.nan, echoes.distance + self._range_noise * errors[2])
        heard = ranges[np.isfinite(ranges)]
        altitude = self._cosine * float(heard.mean()) if heard.size else np.nan
        return DvlReading(data.time, bottom, water, ranges, altitude)

    def _over_bottom(self, data: mujoco.MjData, directions: np.ndarray, echoes: Echoes) -> np.ndarray:
        """Velocity over what each beam meets, along the beam [m/s]; not a number without an echo."""
        model, origin = self.mount.model, self.mount.position(data)
        own = self.beams @ self.mount.velocity(data)
        along = np.full(len(directions), np.nan)
        for beam in np.flatnonzero(echoes.geom >= 0):
            point = origin + echoes.distance[beam] * directions[beam]
            moved = velocity_at(model, data, int(model.geom_bodyid[echoes.geom[beam]]), point)
            along[beam] = own[beam] - directions[beam] @ moved
        return along

    def _through_water(self, data: mujoco.MjData, directions: np.ndarray, distance: np.ndarray) -> np.ndarray:
        """Mean velocity through the water of the layer, along each beam [m/s]; not a number where there is none."""
        (first, last), water, origin = self._layer, self.mount.water, self.mount.position(data)
        along = first + (last - first) * (np.arange(SAMPLES) + 0.5) / SAMPLES
        moved = water.velocity(origin + along[:, None] * directions[:, None], data).mean(axis=1)
        # A beam that starts and ends in the water is taken to be in it.
        wet = water.is_wet(origin + last * directions, data.time) & water.is_wet(origin, data.time)
        no_side_lobe = ~(self._cosine * distance < last)
        own = self.beams @ self.mount.velocity(data)
        return np.where(wet & no_side_lobe, own - np.einsum("ij,ij->i", directions, moved), np.nan)

    def _velocity(self, along: np.ndarray) -> np.ndarray:
        """Velocity along the instrument's axes from those along the beams, by least squares, shape (3,)."""
        heard = np.isfinite(along)
        if heard.sum() < FEWEST:
            return np.full(3, np.nan)
        return np.linalg.lstsq(self.beams[heard], along[heard], rcond=None)[0]
