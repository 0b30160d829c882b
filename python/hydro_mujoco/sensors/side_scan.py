"""Side-scan sonar: a line of intensities by range to each side."""

from dataclasses import dataclass

import mujoco
import numpy as np

from ..errors import DataError
from .arguments import span
from .backscatter import Backscatter, check_rays


@dataclass(frozen=True)
class SideScanLine:
    """A ping: one line of the picture that the vehicle draws as it goes.

    Attributes:
        time: [s].
        port, starboard: intensity by range, towards y and -y, 1 where all comes straight back from one range; each of
            shape (bins,).
        ranges: middles of the bins, along the slant [m], shape (bins,).
    """

    time: float
    port: np.ndarray
    starboard: np.ndarray
    ranges: np.ndarray


class SideScan:
    """A side-scan sonar: a fan to each side, across the instrument's x.

    Rays are even by angle of depression; each adds Lambert's cos^2 of its angle of incidence to the bin of its range.
    So there is nothing before the first bottom return, and what stands on the bottom casts a shadow. Spreading and
    absorption are made good by the receiver's gain in time. A fan has no width along x; straight rays, no multiple
    echoes.

    Source: P. Blondel, The Handbook of Sidescan Sonar, Springer 2009; R. J. Urick, Principles of Underwater Sound, 3rd
    ed., McGraw-Hill 1983, chapter 8.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        name: str,
        *,
        depression: tuple[float, float] = (5.0, 85.0),
        rays: int = 512,
        bins: int = 512,
        reach: tuple[float, float] = (0.5, 50.0),
        speckle: bool = True,
        background: float = 0.0,
        seed: int = 0,
    ):
        """Mount the instrument.

        Args:
            model: compiled. name: of a site, or of a body; with water about it.
            depression: of the highest and the lowest ray below the instrument's x-y plane [degrees], 0 to 90.
            rays: to each side. bins: of range.
            reach: of the first and the last bin [m].
            speckle: whether intensities scatter.
            background: mean intensity of noise in every bin.
            seed: of all errors.

        Raises:
            DataError: there is no such place, no water about it, or a number is out of bounds.
        """
        highest, lowest = span("depression", depression, " degrees")
        if lowest > 90:
            raise DataError(f"depression is {highest:g} to {lowest:g} degrees; expected 90 at most")
        check_rays(sides=2, rays=rays)
        # At the middles of equal parts; port first.
        angle = np.radians(highest + (lowest - highest) * (np.arange(rays) + 0.5) / rays)
        side = np.repeat([1.0, -1.0], rays)
        angle = np.tile(angle, 2)
        self._sonar = Backscatter(
            model,
            name,
            "side scan",
            np.column_stack([0 * angle, side * np.cos(angle), -np.sin(angle)]),
            (side < 0).astype(int),
            bins=bins,
            reach=reach,
            speckle=speckle,
            background=background,
            seed=seed,
        )

    def read(self, data: mujoco.MjData) -> SideScanLine:
        """A ping at the state of `data`."""
        sides = self._sonar.read(data)
        return SideScanLine(data.time, sides[:, 0], sides[:, 1], self._sonar.ranges)
