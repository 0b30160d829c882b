"""Mechanically scanned imaging sonar: one beam, turned step by step."""

from dataclasses import dataclass

import mujoco
import numpy as np

from ..errors import DataError
from .arguments import at_least, numbers, span
from .backscatter import Backscatter, check_angle, check_rays, grid, middles
from .usbl import SOUND

#: Smallest step of a head [degrees].
FINEST = 0.01
#: A ping is over this much early [s]: times of a simulation are sums of steps.
EARLY = 1e-9


@dataclass(frozen=True)
class ScanBeam:
    """A beam.

    Attributes:
        time: of its ping [s].
        angle: of the head then, from the instrument's x towards its y [rad].
        intensity: by range, 1 where all comes straight back from one range, shape (bins,).
        ranges: middles of the bins [m], shape (bins,).
    """

    time: float
    angle: float
    intensity: np.ndarray
    ranges: np.ndarray


@dataclass(frozen=True)
class ScanSweep:
    """The latest beam at each angle of the head.

    Attributes:
        times: of the pings [s], shape (beams,); not a number where there was none yet.
        angles: of the head from the instrument's x towards its y [rad], ascending, shape (beams,).
        intensity: shape (beams, bins); 0 where there was no ping yet.
        ranges: middles of the bins [m], shape (bins,).
    """

    times: np.ndarray
    angles: np.ndarray
    intensity: np.ndarray
    ranges: np.ndarray


class ScanningSonar:
    """A mechanically scanned imaging sonar: one beam about the instrument's x, turned about its z.

    A ping takes 2 reach / speed of sound; then its beam is there, the head turns by a step and the next ping goes out.
    All round the head turns on and on; in a sector it goes to and fro. So a sweep takes seconds, and the vehicle moves
    meanwhile: its picture is distorted, as at sea, by what the times of the beams and the vehicle's path tell. Within a
    ping the vehicle stands still: a beam is of the pose at which its ping went out.

    A beam is a bundle of rays over its width and height, of even strength, no side lobes; each ray adds Lambert's cos^2
    of its angle of incidence to the bin of its range. Speckle makes intensities scatter. Spreading and absorption are
    made good by the receiver's gain in time. Straight rays, no multiple echoes.

    The sensor remembers the head's place, the ping under way and the latest sweep: after a restored state `reset` it.
    Where time goes back it resets itself.

    Source: D. Ribas, P. Ridao and J. Neira, Underwater SLAM for Structured Environments Using an Imaging Sonar,
    Springer 2010, chapter 3 (working, distortion by motion); R. J. Urick, Principles of Underwater Sound, 3rd ed.,
    McGraw-Hill 1983, chapter 8.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        name: str,
        *,
        sector: tuple[float, float] = (0.0, 360.0),
        step: float = 1.8,
        width: float = 3.0,
        height: float = 35.0,
        across: int = 5,
        rays: int = 64,
        bins: int = 256,
        reach: tuple[float, float] = (0.5, 20.0),
        sound_speed: float = SOUND,
        pause: float = 0.0,
        speckle: bool = True,
        background: float = 0.0,
        seed: int = 0,
    ):
        """Mount the instrument.

        Args:
            model: compiled. name: of a site, or of a body; with water about it.
            sector: angles of the head, from x towards y [degrees]; 360 of them are all round. It begins at the first.
            step: of the head [degrees]; made smaller, by as little as fills the sector.
            width: of the beam, by bearing [degrees]. height: of the beam [degrees]; each above 0 and below 180.
            across: sheets of rays over the width. rays: of a sheet, over the height. bins: of range.
            reach: of the first and the last bin [m].
            sound_speed: [m/s].
            pause: from the last echo to the next ping [s].
            speckle: whether intensities scatter.
            background: mean intensity of noise in every bin.
            seed: of all errors.

        Raises:
            DataError: there is no such place, no water about it, or a number is out of bounds.
        """
        check_rays(across=across, rays=rays)
        width = check_angle("width", width, 180)
        height = check_angle("height", height, 180)
        first, last = numbers("sector", sector, 2)
        if not (abs(first) <= 360 and first < last <= first + 360):
            raise DataError(f"sector is {first:g} to {last:g} degrees; expected least < most, 360 at most apart")
        steps = int(np.ceil((last - first) / at_least("step", step, FINEST, " degrees") - 1e-9))
        self._is_round = last == first + 360
        self._angles = np.radians(np.linspace(first, last, steps + 1)[: steps if self._is_round else None])
        self._sonar = Backscatter(
            model,
            name,
            "scanning sonar",
            grid(middles(across, width), middles(rays, height)),
            np.zeros(across * rays, int),
            bins=bins,
            reach=reach,
            speckle=speckle,
            background=background,
            seed=seed,
        )
        travel = 2 * span("reach", reach, " m")[1] / at_least("sound_speed", sound_speed, 1, " m/s")
        self._period = travel + at_least("pause", pause, 0, " s")
        self._travel = travel
        self.reset()

    def reset(self) -> None:
        """Turn the head to the first angle; forget the ping under way and the sweep."""
        self._last, self._pings = -np.inf, 0
        self._ping: ScanBeam | None = None
        self._times = np.full(len(self._angles), np.nan)
        self._intensity = np.zeros((len(self._angles), len(self._sonar.ranges)))

    def poll(self, data: mujoco.MjData) -> ScanBeam | None:
        """Send what is due; returns the beam whose last echo has come since the last call, if one has.

        To be called once a step or a few: pings go out at these calls alone, one at most at each.
        """
        self._sonar.mount.check(data)
        if data.time < self._last:
            self.reset()
        heard = None
        if self._ping is not None and data.time >= self._ping.time + self._travel - EARLY > self._last:
            heard, row = self._ping, self._row()
            self._times[row], self._intensity[row] = heard.time, heard.intensity
        self._last = data.time
        if self._ping is None or data.time >= self._ping.time + self._period - EARLY:
            self._pings += 1
            angle = float(self._angles[self._row()])
            intensity = self._sonar.read(data, angle)[:, 0]
            self._ping = ScanBeam(data.time, angle, intensity, self._sonar.ranges)
        return heard

    def sweep(self) -> ScanSweep:
        """The latest beam at each angle of the head: the picture as it is now."""
        return ScanSweep(self._times.copy(), self._angles, self._intensity.copy(), self._sonar.ranges)

    def _row(self) -> int:
        """Number of the head's angle at the latest ping."""
        number, ping = len(self._angles), self._pings - 1
        if self._is_round:
            return ping % number
        return number - 1 - abs(ping % (2 * number - 2) - (number - 1))
