"""Pressure sensor: pressure and depth."""

from dataclasses import dataclass

import mujoco
import numpy as np

from .arguments import at_least
from .mount import Mount
from .noise import Noise

#: Standard atmosphere [Pa].
ATMOSPHERE = 101_325.0


@dataclass(frozen=True)
class PressureReading:
    """A reading.

    Attributes:
        time: [s]. pressure: absolute [Pa].
        depth: [m], by the water's density and gravity, the excess over the air's pressure; waves count as depth.
    """

    time: float
    pressure: float
    depth: float


class Pressure:
    """An absolute pressure sensor.

    p = p_air + rho g (waterline - z) + p_wave: still water's pressure and that of linear waves, which decays with
    depth, so that a wave is felt the less the deeper the sensor is; p_air above the surface. The flow past the housing
    adds nothing.

    Source: R. G. Dean and R. A. Dalrymple, Water Wave Mechanics for Engineers and Scientists, World Scientific 1991,
    chapter 4.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        name: str,
        *,
        atmosphere: float = ATMOSPHERE,
        noise: float = 30.0,
        bias: float = 100.0,
        resolution: float = 0.0,
        seed: int = 0,
    ):
        """Mount the instrument.

        Args:
            model: compiled. name: of a site, or of a body; with water about it.
            atmosphere: pressure of the air [Pa].
            noise: standard deviation from reading to reading [Pa].
            bias: standard deviation of an error that is constant for a seed [Pa].
            resolution: step of the readings [Pa]; 0: none.
            seed: of all errors.

        Raises:
            DataError: there is no such place, no water about it, or a number is out of bounds.
        """
        self.mount, self._noise = Mount(model, name), Noise(seed, f"pressure {name}")
        self._atmosphere = at_least("atmosphere", atmosphere, 0, " Pa")
        #: Standard deviations from reading to reading and of the bias [Pa].
        self.deviations = at_least("noise", noise, 0, " Pa"), at_least("bias", bias, 0, " Pa")
        self._bias = self.deviations[1] * float(self._noise.constant())
        self._resolution = at_least("resolution", resolution, 0, " Pa")
        #: Standard deviation of the rounding to a step of the readings [Pa].
        self.rounding = self._resolution / np.sqrt(12)

    def read(self, data: mujoco.MjData) -> PressureReading:
        """The reading at the state of `data`."""
        self.mount.check(data)
        water = self.mount.water
        excess = float(water.pressure(self.mount.position(data), data.time))
        error = self._bias + self.deviations[0] * float(self._noise.generator(data.time).standard_normal())
        pressure = self._atmosphere + excess + error
        if self._resolution:
            pressure = self._resolution * round(pressure / self._resolution)
        weight = water.density * water.gravity
        return PressureReading(data.time, pressure, (pressure - self._atmosphere) / weight if weight else np.nan)
