"""Imaging sonar: a picture by range and bearing."""

from dataclasses import dataclass

import mujoco
import numpy as np

from .backscatter import Backscatter, check_angle, check_rays, fan, grid, middles


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
    range, so that the picture has no elevation, and what stands on the bottom casts a shadow. Speckle makes intensities
    scatter. Spreading and absorption are made good by the receiver's gain in time. Straight rays, no multiple echoes.

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
        check_rays(beams=beams, rays=rays)
        width = check_angle("width", width, 360)
        height = check_angle("height", height, 180)
        self._bearings = fan(beams, width)
        self._sonar = Backscatter(
            model,
            name,
            "imaging sonar",
            grid(self._bearings, middles(rays, height)),
            np.repeat(np.arange(beams), rays),
            bins=bins,
            reach=reach,
            speckle=speckle,
            background=background,
            seed=seed,
        )

    def read(self, data: mujoco.MjData) -> SonarImage:
        """A picture at the state of `data`."""
        return SonarImage(data.time, self._sonar.read(data), self._sonar.ranges, self._bearings)
