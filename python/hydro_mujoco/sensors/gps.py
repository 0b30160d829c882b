"""GPS receiver: latitude, longitude and height, above the surface only."""

from dataclasses import dataclass

import mujoco
import numpy as np

from ..errors import DataError
from ..extras import extra
from .arguments import at_least, numbers
from .mount import Mount
from .noise import Noise


@dataclass(frozen=True)
class GpsReading:
    """A fix, or none.

    Attributes:
        time: [s].
        is_fixed: whether the antenna is out of the water; all else is not a number where it is not.
        latitude, longitude: WGS84 [degrees]. height: above the ellipsoid [m].
        position: in the world, with the same errors [m], shape (3,).
    """

    time: float
    is_fixed: bool
    latitude: float
    longitude: float
    height: float
    position: np.ndarray


class Gps:
    """A GPS receiver whose antenna is at a site.

    The world is the tangent plane at an origin: x towards east, or turned from it, z up. It goes to WGS84 exactly, by
    way of earth-centred coordinates (pymap3d). The sea of the simulation is flat, so that far from the origin its
    surface climbs above the ellipsoid by d^2 / 2 R: 0.08 m at 1 km, 7.8 m at 10 km.

    Errors are normal, with the memory exp(-lag / T) of satellite and ionosphere errors, plus white noise.

    Source: J. Sanz Subirana et al., GNSS Data Processing, ESA TM-23/1, 2013, volume I, appendix B (coordinates); B. W.
    Parkinson and J. J. Spilker, Global Positioning System, AIAA 1996, volume I, chapter 11 (errors).
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        name: str,
        *,
        origin: tuple[float, float, float],
        east: float = 0.0,
        slow_noise: tuple[float, float] = (1.5, 3.0),
        time_constant: float = 300.0,
        noise: tuple[float, float] = (0.2, 0.4),
        margin: float = 0.05,
        seed: int = 0,
    ):
        """Mount the antenna.

        Args:
            model: compiled. name: of a site, or of a body; with water about it.
            origin: latitude [degrees], longitude [degrees] and height above the ellipsoid [m] of the world's origin.
            east: direction of east, counterclockwise from world x [degrees].
            slow_noise: standard deviations of the slow error, horizontal (each of two axes) and vertical [m].
            time_constant: of the slow error [s].
            noise: standard deviations of the white error, horizontal and vertical [m].
            margin: height above the surface that the antenna needs [m].
            seed: of all errors.

        Raises:
            DataError: there is no such place, no water about it, a number is out of bounds, or pymap3d is missing.
        """
        self._geodesy = extra("pymap3d", "gps", "Gps")
        latitude, longitude, height = numbers("origin", origin, 3)
        if not (abs(latitude) <= 90 and abs(longitude) <= 360 and np.isfinite(height)):
            raise DataError(
                f"origin is {latitude:g}, {longitude:g}, {height:g}; expected latitude -90 to 90 and longitude -360 to "
                "360 degrees, then a height in m"
            )
        if not np.isfinite(east):
            raise DataError(f"east is {east} degrees; expected a finite number")
        self.mount, self._noise = Mount(model, name), Noise(seed, f"gps {name}")
        self._origin, self._turn = (latitude, longitude, height), np.radians(east)
        #: Standard deviations along x, y and z [m] of the slow and of the white error, shape (3,).
        self.slow, self.white = _by_axis("slow_noise", slow_noise), _by_axis("noise", noise)
        #: Of the slow error [s].
        self.time_constant = at_least("time_constant", time_constant, 1e-3, " s")
        self._margin = at_least("margin", margin, 0, " m")

    def read(self, data: mujoco.MjData) -> GpsReading:
        """The fix at the state of `data`."""
        self.mount.check(data)
        x, y, z = true = self.mount.position(data)
        if not z - self._margin > self.mount.water.level(x, y, data.time):
            return GpsReading(data.time, False, np.nan, np.nan, np.nan, np.full(3, np.nan))
        slow = self.slow * self._noise.slow(data.time, self.time_constant, 3)
        position = true + slow + self.white * self._noise.generator(data.time).standard_normal(3)
        cosine, sine = np.cos(self._turn), np.sin(self._turn)
        to_east, to_north = position[0] * cosine + position[1] * sine, position[1] * cosine - position[0] * sine
        latitude, longitude, height = self._geodesy.enu2geodetic(to_east, to_north, position[2], *self._origin)
        return GpsReading(data.time, True, float(latitude), float(longitude), float(height), position)


def _by_axis(name: str, deviations: tuple[float, float]) -> np.ndarray:
    """Standard deviations along x, y and z [m], shape (3,), of a horizontal and a vertical one."""
    flat, up = (at_least(name, each, 0, " m") for each in numbers(name, deviations, 2))
    return np.array([flat, flat, up])
