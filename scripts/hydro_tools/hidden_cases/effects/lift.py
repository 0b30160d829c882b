"""Lift of a hull at an angle of attack, rounded where it stalls."""

import numpy as np

from .base import Effect


class Lift(Effect):
    """In each plane that holds the long axis: 1/2 rho A C sin(alpha) cos(alpha) V^2 across the flow, stalling.

    `slope` is dC/dalpha; the force is written on the transverse axis as in 1/2 rho A slope u w.
    """

    kind = "lift"

    def __init__(
        self, target: str, body: int, *, area: float, slope: float, planes: tuple[int, ...] = (1, 2), along: int = 0
    ):
        super().__init__(target, {"slope": (slope, "1")}, comparable=False)
        self.body, self.area, self.slope, self.planes, self.along = body, area, slope, planes, along

    def force(self, plant):
        motion = plant.hull(self.body)
        force = np.zeros((plant.members, 3))
        u = motion.nu[:, self.along]
        for axis in self.planes:
            w = motion.nu[:, axis]
            attack = np.arctan2(np.abs(w), np.abs(u) + 1e-6)
            stall = 1 / (1 + (attack / 0.9) ** 4)
            force[:, axis] = -0.5 * 1000.0 * self.area * self.slope * u * w * np.sign(u) * stall
            # The part of lift along the body pulls it forward.
            force[:, self.along] += 0.5 * 1000.0 * self.area * self.slope * w * w * 0.5 * stall * np.sign(u)
        plant.add_hull_wrench(self.body, self.scale * force)
