"""What sonars share: fans of beams, intensity of an echo, intensities by range."""

import mujoco
import numpy as np

from ..errors import DataError
from .arguments import at_least, real, span, whole
from .echoes import Echoes, Rays
from .mount import Mount
from .noise import Noise

#: Most rays of a ping.
MOST_RAYS = 200_000


def fan(number: int, width: float) -> np.ndarray:
    """Angles of a fan [rad], shape (number,), evenly from -width / 2 to width / 2 [degrees]; 0 of one."""
    return np.radians(width) * (np.linspace(-0.5, 0.5, number) if number > 1 else np.zeros(1))


def middles(number: int, width: float) -> np.ndarray:
    """Angles [rad] at the middles of equal parts of a width [degrees] about 0, shape (number,)."""
    return np.radians(width) * ((np.arange(number) + 0.5) / number - 0.5)


def grid(bearings: np.ndarray, elevations: np.ndarray) -> np.ndarray:
    """Unit vectors along an instrument's axes, shape (b e, 3), those of a bearing beside each other.

    Args:
        bearings: from x towards y [rad], shape (b,). elevations: above the x-y plane [rad], shape (e,).
    """
    bearing, elevation = (each.ravel() for each in np.meshgrid(bearings, elevations, indexing="ij"))
    flat = np.cos(elevation)
    return np.column_stack([flat * np.cos(bearing), flat * np.sin(bearing), np.sin(elevation)])


def check_rays(**numbers: int) -> None:
    """Refuse numbers whose product is that of the rays of a ping, by their names.

    Raises:
        DataError: one is no whole number above 0, or there are too many rays.
    """
    total = 1
    for name, number in numbers.items():
        total *= whole(name, number, 1)
    if total > MOST_RAYS:
        raise DataError(f"{total} rays a ping; expected at most {MOST_RAYS}")


def check_angle(name: str, angle: float, most: float) -> float:
    """The angle [degrees], a number above 0 and below `most`.

    Raises:
        DataError: it is not.
    """
    found = real(angle)
    if not 0 < found < most:
        raise DataError(f"{name} is {angle} degrees; expected above 0 and below {most:g}")
    return found


def lambert(echoes: Echoes, directions: np.ndarray) -> np.ndarray:
    """cos^2 of the angle of incidence, 0 without an echo, shape (n,).

    Source: R. J. Urick, Principles of Underwater Sound, 3rd ed., McGraw-Hill 1983, chapter 8 (Lambert's law).
    """
    cosine = np.einsum("ij,ij->i", echoes.normal, directions)
    return np.where(echoes.geom >= 0, cosine * cosine, 0.0)


class RangeBins:
    """Intensities of rays, gathered by beam and range.

    Speckle multiplies a sum by a number of the exponential distribution (fully developed: Rayleigh's amplitude): R.
    Cerqueira et al., A novel GPU-based sonar simulator for real-time applications, Computers & Graphics 68, 2017.
    """

    def __init__(self, reach: tuple[float, float], number: int, *, speckle: bool, background: float):
        """Make the bins.

        Args:
            reach: of the first and the last [m]. number: of them. speckle: whether intensities scatter.
            background: mean intensity of noise in every bin.
        """
        self._first, self._number = reach[0], whole("bins", number, 1)
        self._size = (reach[1] - reach[0]) / self._number
        self._speckle, self._background = speckle, background
        #: Middles of the bins [m], shape (number,).
        self.ranges = self._first + self._size * (np.arange(self._number) + 0.5)

    def gather(
        self, echoes: Echoes, intensity: np.ndarray, beam: np.ndarray, beams: int, random: np.random.Generator
    ) -> np.ndarray:
        """Sums of intensities, shape (number, beams).

        Args:
            echoes: of n rays. intensity: of each, shape (n,). beam: of each, shape (n,). beams: how many there are.
            random: of speckle and noise.
        """
        heard = np.isfinite(echoes.distance)
        row = np.minimum(((echoes.distance[heard] - self._first) / self._size).astype(int), self._number - 1)
        image = np.zeros((self._number, beams))
        np.add.at(image, (row, beam[heard]), intensity[heard])
        if self._speckle:
            image *= random.standard_exponential(image.shape)
        return image + self._background * random.standard_exponential(image.shape)


class Backscatter:
    """Pings of an instrument whose rays are gathered into columns: intensities by range and column."""

    def __init__(
        self,
        model: mujoco.MjModel,
        name: str,
        kind: str,
        directions: np.ndarray,
        column: np.ndarray,
        *,
        bins: int,
        reach: tuple[float, float],
        speckle: bool,
        background: float,
        seed: int,
    ):
        """Mount the instrument.

        Args:
            model: compiled. name: of a site, or of a body. kind: of the instrument, which has errors of its own.
            directions: of the rays along the instrument's axes, shape (n, 3).
            column: of each ray, shape (n,), from 0 on; each has as many rays.
            bins, reach, speckle, background, seed: as the instruments say.

        Raises:
            DataError: there is no such place, no water about it, or a number is out of bounds.
        """
        self.mount, self._noise = Mount(model, name), Noise(seed, f"{kind} {name}")
        self._rays, self._reach = Rays(self.mount), span("reach", reach, " m")
        noise = at_least("background", background, 0)
        self._bins = RangeBins(self._reach, bins, speckle=speckle, background=noise)
        self._directions, self._column, self._columns = directions, column, int(column.max()) + 1
        #: Middles of the bins [m], shape (bins,).
        self.ranges = self._bins.ranges

    def read(self, data: mujoco.MjData, turn: float = 0.0) -> np.ndarray:
        """Intensities at the state of `data`, shape (bins, columns); all rays turned about the instrument's z [rad]."""
        self.mount.check(data)
        cosine, sine = np.cos(turn), np.sin(turn)
        head = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
        directions = self._directions @ (self.mount.axes(data) @ head).T
        echoes = self._rays.cast(data, directions, self._reach)
        intensity = lambert(echoes, directions) / (len(directions) // self._columns)
        return self._bins.gather(echoes, intensity, self._column, self._columns, self._noise.generator(data.time))
