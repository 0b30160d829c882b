"""Multibeam echo sounder: ranges of a fan of beams."""

from dataclasses import dataclass

import mujoco
import numpy as np

from ..errors import DataError
from .arguments import at_least, real, span
from .backscatter import check_angle, check_rays, fan, lambert
from .echoes import Rays
from .mount import Mount
from .noise import Noise


@dataclass(frozen=True)
class MultibeamReading:
    """A ping of n beams.

    Attributes:
        time: [s].
        ranges: along each beam [m], shape (n,); not a number without an echo.
        intensity: of each echo, 1 where it comes straight back, 0 without one, shape (n,).
        points: where the echoes come from, along the instrument's axes [m], shape (n, 3).
    """

    time: float
    ranges: np.ndarray
    intensity: np.ndarray
    points: np.ndarray


class Multibeam:
    """A multibeam echo sounder: a fan of beams across the instrument's x, about -z.

    Intensity is Lambert's, cos^2 of the angle of incidence, with spreading and absorption made good by the receiver's
    gain in time. Straight rays, beams without width, no multiple echoes.

    Source: R. J. Urick, Principles of Underwater Sound, 3rd ed., McGraw-Hill 1983, chapter 8 (Lambert's law);
    X. Lurton, An Introduction to Underwater Acoustics, 2nd ed., Springer 2010.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        name: str,
        *,
        beams: int = 128,
        swath: float = 120.0,
        reach: tuple[float, float] = (0.5, 100.0),
        range_noise: float = 0.01,
        range_scale_noise: float = 0.001,
        weakest: float = 0.0,
        seed: int = 0,
    ):
        """Mount the instrument.

        Args:
            model: compiled. name: of a site, or of a body; with water about it.
            beams: how many, evenly by angle, the first towards -y.
            swath: angle from the first to the last [degrees], above 0 and below 360.
            reach: least and greatest range of an echo [m].
            range_noise, range_scale_noise: standard deviation of a range, sqrt(range_noise^2 + (range_scale_noise
                range)^2) [m].
            weakest: intensity below which there is no echo, 0 to 1.
            seed: of all errors.

        Raises:
            DataError: there is no such place, no water about it, or a number is out of bounds.
        """
        check_rays(beams=beams)
        swath = check_angle("swath", swath, 360)
        if not 0 <= real(weakest) <= 1:
            raise DataError(f"weakest is {weakest}; expected 0 to 1")
        self._mount, self._noise = Mount(model, name), Noise(seed, f"multibeam {name}")
        self._rays, self._reach, self._weakest = Rays(self._mount), span("reach", reach, " m"), real(weakest)
        self._deviation = at_least("range_noise", range_noise, 0, " m")
        self._share = at_least("range_scale_noise", range_scale_noise, 0)
        #: Angles of the beams from -z towards y [rad], shape (n,).
        self.angles = fan(beams, swath)
        self._beams = np.column_stack([np.zeros(beams), np.sin(self.angles), -np.cos(self.angles)])

    def read(self, data: mujoco.MjData) -> MultibeamReading:
        """A ping at the state of `data`."""
        self._mount.check(data)
        directions = self._beams @ self._mount.axes(data).T
        echoes = self._rays.cast(data, directions, self._reach)
        intensity = lambert(echoes, directions)
        deviation = np.hypot(self._deviation, self._share * echoes.distance)
        ranges = echoes.distance + deviation * self._noise.generator(data.time).standard_normal(len(directions))
        heard = np.isfinite(ranges) & (intensity >= self._weakest)
        ranges, intensity = np.where(heard, ranges, np.nan), np.where(heard, intensity, 0.0)
        return MultibeamReading(data.time, ranges, intensity, ranges[:, None] * self._beams)
