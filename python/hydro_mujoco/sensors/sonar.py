"""Sonars: a multibeam echo sounder, and an imaging sonar."""

from dataclasses import dataclass

import mujoco
import numpy as np

from ..errors import DataError
from .echoes import Echoes, Rays
from .mount import Mount
from .noise import Noise, at_least, span

#: Most rays of a ping.
MOST_RAYS = 200_000


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
        _check_fan(beams, ("swath", swath), beams)
        if not 0 <= weakest <= 1:
            raise DataError(f"weakest is {weakest}; expected 0 to 1")
        self._mount, self._noise = Mount(model, name), Noise(seed, f"multibeam {name}")
        self._rays, self._reach, self._weakest = Rays(self._mount), span("reach", reach, " m"), weakest
        self._deviation = at_least("range_noise", range_noise, 0, " m")
        self._share = at_least("range_scale_noise", range_scale_noise, 0)
        #: Angles of the beams from -z towards y [rad], shape (n,).
        self.angles = _fan(beams, swath)
        self._beams = np.column_stack([np.zeros(beams), np.sin(self.angles), -np.cos(self.angles)])

    def read(self, data: mujoco.MjData) -> MultibeamReading:
        """A ping at the state of `data`."""
        self._mount.check(data)
        directions = self._beams @ self._mount.axes(data).T
        echoes = self._rays.cast(data, directions, self._reach)
        intensity = _lambert(echoes, directions)
        deviation = np.hypot(self._deviation, self._share * echoes.distance)
        ranges = echoes.distance + deviation * self._noise.generator(data.time).standard_normal(len(directions))
        heard = np.isfinite(ranges) & (intensity >= self._weakest)
        ranges, intensity = np.where(heard, ranges, np.nan), np.where(heard, intensity, 0.0)
        return MultibeamReading(data.time, ranges, intensity, ranges[:, None] * self._beams)


@dataclass(frozen=True)
class SonarImage:
    """A picture by range and bearing.

    Attributes:
        time: [s].
        intensity: shape (bins, beams): 1 where all of a beam comes straight back from one range.
        ranges: middles of the bins [m], shape (bins,).
        bearings: of the beams from the instrument's x towards its y [rad], shape (beams,).
    """

    time: float
    intensity: np.ndarray
    ranges: np.ndarray
    bearings: np.ndarray


class ImagingSonar:
    """A forward-looking imaging sonar: a fan of beams about the instrument's x, each wide up and down.

    A beam is a sheet of rays over its height; each ray adds Lambert's cos^2 of its angle of incidence to the bin of its
    range, so that the picture has no elevation, and what stands on the bottom casts a shadow. Speckle multiplies the
    intensity by a number of the exponential distribution (fully developed: Rayleigh's amplitude). Straight rays, no
    multiple echoes, no noise of the sea.

    Source: R. J. Urick, Principles of Underwater Sound, 3rd ed., McGraw-Hill 1983, chapter 8; R. Cerqueira et al., A
    novel GPU-based sonar simulator for real-time applications, Computers & Graphics 68, 2017 (speckle, shadows).
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        name: str,
        *,
        beams: int = 96,
        width: float = 90.0,
        height: float = 20.0,
        rays: int = 64,
        bins: int = 256,
        reach: tuple[float, float] = (0.5, 20.0),
        speckle: bool = True,
        background: float = 0.0,
        seed: int = 0,
    ):
        """Mount the instrument.

        Args:
            model: compiled. name: of a site, or of a body; with water about it.
            beams: how many, evenly by bearing, the first to the right.
            width: bearing from the first to the last [degrees], above 0 and below 360.
            height: of a beam [degrees], above 0 and below 180.
            rays: of a beam. bins: of range.
            reach: of the first and the last bin [m].
            speckle: whether intensities scatter.
            background: mean intensity of noise in every bin.
            seed: of all errors.

        Raises:
            DataError: there is no such place, no water about it, or a number is out of bounds.
        """
        _check_fan(beams, ("width", width), beams * max(rays, 1))
        if not 0 < height < 180:
            raise DataError(f"height is {height} degrees; expected above 0 and below 180")
        for what, number in (("rays", rays), ("bins", bins)):
            at_least(what, number, 1)
        self._mount, self._noise = Mount(model, name), Noise(seed, f"imaging sonar {name}")
        self._rays, self._reach, self._bins = Rays(self._mount), span("reach", reach, " m"), int(bins)
        self._speckle, self._background = speckle, at_least("background", background, 0)
        self._bearings = _fan(beams, width)
        # Rays at the middles of equal parts of the height.
        elevations = np.radians(height) * ((np.arange(rays) + 0.5) / rays - 0.5)
        bearing, elevation = (each.ravel() for each in np.meshgrid(self._bearings, elevations, indexing="ij"))
        flat = np.cos(elevation)
        self._beams = np.column_stack([flat * np.cos(bearing), flat * np.sin(bearing), np.sin(elevation)])
        self._beam = np.repeat(np.arange(beams), rays)
        self._per_beam = rays

    def read(self, data: mujoco.MjData) -> SonarImage:
        """A picture at the state of `data`."""
        self._mount.check(data)
        directions = self._beams @ self._mount.axes(data).T
        echoes = self._rays.cast(data, directions, self._reach)
        first, last = self._reach
        size = (last - first) / self._bins
        heard = np.isfinite(echoes.distance)
        bins = np.minimum(((echoes.distance[heard] - first) / size).astype(int), self._bins - 1)
        image = np.zeros((self._bins, len(self._bearings)))
        np.add.at(image, (bins, self._beam[heard]), _lambert(echoes, directions)[heard] / self._per_beam)
        random = self._noise.generator(data.time)
        if self._speckle:
            image *= random.standard_exponential(image.shape)
        image += self._background * random.standard_exponential(image.shape)
        return SonarImage(data.time, image, first + size * (np.arange(self._bins) + 0.5), self._bearings)


def _fan(number: int, width: float) -> np.ndarray:
    """Angles of a fan [rad], shape (number,), evenly from -width / 2 to width / 2 [degrees]; 0 of one."""
    return np.radians(width) * (np.linspace(-0.5, 0.5, number) if number > 1 else np.zeros(1))


def _check_fan(beams: int, width: tuple[str, float], rays: int) -> None:
    at_least("beams", beams, 1)
    name, angle = width
    if not 0 < angle < 360:
        raise DataError(f"{name} is {angle} degrees; expected above 0 and below 360")
    if rays > MOST_RAYS:
        raise DataError(f"{rays} rays a ping; expected at most {MOST_RAYS}")


def _lambert(echoes: Echoes, directions: np.ndarray) -> np.ndarray:
    """cos^2 of the angle of incidence, 0 without an echo, shape (n,)."""
    cosine = np.einsum("ij,ij->i", echoes.normal, directions)
    return np.where(echoes.geom >= 0, cosine * cosine, 0.0)
