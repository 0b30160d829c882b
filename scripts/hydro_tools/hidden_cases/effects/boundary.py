"""Coefficients that change near the surface (world z = 0) and near a wall (the plane geom of the scene)."""

import numpy as np

from .base import Effect


class _Near(Effect):
    """Drag that grows towards a boundary: D (coefficient) exp(-(d/length)^1.15) |nu| nu, and a suction."""

    def __init__(self, target: str, body: int, *, coefficient: float, length: float, drag: np.ndarray, suction: float):
        super().__init__(target, {"coefficient": (coefficient, "1"), "length": (length, "m")}, comparable=False)
        self.body, self.coefficient, self.length = body, coefficient, length
        self.drag, self.suction = np.asarray(drag, float), suction

    def fixed(self):
        return {"length"}

    def _distance(self, plant) -> np.ndarray:
        raise NotImplementedError

    def force(self, plant):
        motion = plant.body(self.body)
        near = np.exp(-((np.maximum(self._distance(plant), 0.0) / self.length) ** 1.15))
        factor = self.scale * (self.coefficient * near)[:, None]
        force = -factor * self.drag * np.abs(motion.nu) * motion.nu
        plant.add_wrench(self.body, force)
        if self.suction:
            pull = np.zeros_like(force)
            pull[:, 2] = factor[:, 0] * self.suction * (motion.nu[:, 0] ** 2 + motion.nu[:, 1] ** 2)
            plant.add_world_force(self.body, pull)


class FreeSurface(_Near):
    """Wave-making drag near the surface."""

    kind = "free_surface"

    def _distance(self, plant):
        return -plant.xpos[:, self.body, 2]


class WallProximity(_Near):
    """Drag of the gap above the bed, and a pull towards it."""

    kind = "wall_proximity"

    def __init__(self, target: str, body: int, *, bed: float, **sizes):
        super().__init__(target, body, **sizes)
        self.bed = bed

    def _distance(self, plant):
        return plant.xpos[:, self.body, 2] - self.bed
