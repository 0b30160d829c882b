"""Moving water: currents and waves."""

import numpy as np

from ..frames import turned_back
from .base import Effect

GRAVITY = 9.81


class Current(Effect):
    """A current that wanders by 3 % over half a minute and weakens by 1 % a metre of depth."""

    kind = "current"
    moves_water = True

    def __init__(self, target: str, body: int, velocity: np.ndarray, phase: float):
        super().__init__(target, {axis: (float(v), "m/s") for axis, v in zip("xyz", velocity) if v != 0.0})
        self.body, self.velocity, self.phase = body, np.asarray(velocity, float), phase
        self.most = 0.9 / max(np.abs(velocity).max(), 1e-9)

    def parts(self):
        return [Current(self.target, self.body, 0.1 * axis, self.phase) for axis in np.eye(3)]

    def water_velocity(self, plant):
        slow = 1 + 0.03 * np.sin(2 * np.pi * plant.time / 31.0 + self.phase)
        depth = -plant.xpos[:, self.body, 2]
        return (self.scale[:, 0] * slow * (1 - 0.01 * (depth - 2.0)))[:, None] * self.velocity


class Waves(Effect):
    """A regular wave with 12 % of its second harmonic, decaying with depth; with its pressure force.

    `amplitude` is that of the horizontal water velocity at 1 m depth.
    """

    kind = "waves"
    moves_water = True

    def __init__(
        self,
        target: str,
        body: int,
        *,
        amplitude: float,
        frequency: float,
        phase: float,
        direction: float,
        displaced_mass: float,
    ):
        super().__init__(
            target,
            {
                "amplitude": (amplitude, "m/s"),
                "frequency": (frequency, "Hz"),
                "phase": (phase, "rad"),
                "direction": (direction, "rad"),
            },
            comparable=False,
        )
        self.body, self.displaced = body, displaced_mass
        self.omega = 2 * np.pi * frequency
        self.number = self.omega**2 / GRAVITY
        self.heading = np.array([np.cos(direction), np.sin(direction), 0.0])
        self.phase, self.amplitude = phase, amplitude
        self.most = 1.0 / amplitude

    def fixed(self):
        return {"frequency", "phase", "direction"}

    def _phase(self, plant):
        place = plant.hull(self.body).position
        decay = np.exp(-self.number * np.clip(-place[:, 2] - 1.0, -1.0, 30.0))
        return self.omega * plant.time - self.number * (place @ self.heading) + self.phase, decay

    def water_velocity(self, plant):
        angle, decay = self._phase(plant)
        size = self.scale[:, 0] * self.amplitude * decay
        along = size * (np.sin(angle) + 0.12 * decay * np.sin(2 * angle))
        velocity = along[:, None] * self.heading
        velocity[:, 2] = size * np.cos(angle)
        return velocity

    def force(self, plant):
        angle, decay = self._phase(plant)
        size = self.scale[:, 0] * self.amplitude * decay * self.omega * self.displaced
        force = (size * np.cos(angle))[:, None] * self.heading
        force[:, 2] = -size * np.sin(angle)
        plant.add_hull_wrench(self.body, turned_back(plant.body(self.body).rotation, force))
