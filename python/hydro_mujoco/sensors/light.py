"""Light that water absorbs and scatters."""

import numpy as np

from ..errors import DataError
from .arguments import numbers

#: Distance [m] that stands for no end: nothing comes through.
ENDLESS = 1e9


class WaterLight:
    """How water changes the light of a scene, for each of red, green and blue.

    I = J exp(-K d) exp(-c r) + B exp(-K d_camera) (1 - exp(-c r)), with J what is there in air, r its distance along
    the ray and d its depth, c the beam attenuation, K the attenuation of daylight, B the colour of the water itself at
    the surface. So far things lose red first and fade into B, and deep ones darken. No blur, no caustics.

    Source: Y. Y. Schechner and N. Karpel, Recovery of underwater visibility and structure by polarization analysis,
    IEEE J. Oceanic Engineering 30(3), 2005 (attenuation and veiling light); C. D. Mobley, Light and Water, Academic
    Press 1994 (daylight by depth).

    Attributes:
        attenuation: c of red, green, blue [1/m], shape (3,). daylight: K of each [1/m], shape (3,).
    """

    def __init__(
        self,
        attenuation: tuple[float, float, float] = (0.5, 0.15, 0.12),
        daylight: tuple[float, float, float] = (0.35, 0.08, 0.06),
        colour: tuple[float, float, float] = (0.05, 0.3, 0.4),
    ):
        """Describe a water; the defaults are of the order of clear coastal water, those of your place are better.

        Args:
            attenuation: c of red, green, blue [1/m]. daylight: K of each [1/m]; zeros where only lamps light the scene.
            colour: B of each, 0 to 1.

        Raises:
            DataError: a number is out of bounds.
        """
        self.attenuation = _channels("attenuation", attenuation)
        self.daylight = _channels("daylight", daylight)
        self._colour = _channels("colour", colour, 1.0)

    def through(self, seen: np.ndarray, distance: np.ndarray, depth: np.ndarray, own_depth: float) -> np.ndarray:
        """What arrives at an eye.

        Args:
            seen: as in air, 0 to 1, shape (..., 3). distance: to it [m], shape (...), may be infinite.
            depth: of it below the surface [m], shape (...). own_depth: of the eye [m].

        Returns:
            0 to 1, shape (..., 3).
        """
        through = np.exp(-self.attenuation * np.minimum(distance, ENDLESS)[..., None])
        lit = seen * np.exp(-self.daylight * depth[..., None])
        return lit * through + self._colour * np.exp(-self.daylight * own_depth) * (1 - through)


def _channels(name: str, values: tuple[float, float, float], most: float = np.inf) -> np.ndarray:
    """Three finite numbers from 0 to `most`, of red, green and blue.

    Raises:
        DataError: they are not.
    """
    found = np.array(numbers(name, values, 3))
    if not (np.isfinite(found) & (found >= 0) & (found <= most)).all():
        limit = f" to {most:g}" if np.isfinite(most) else " or more"
        raise DataError(f"{name} is {', '.join(f'{each:g}' for each in found)}; expected three numbers, 0{limit}")
    return found
