"""Inertia of the fluid: added mass and the Munk moment."""

import numpy as np

from ..frames import cross
from .base import AXES, Effect, one_by_one

#: Off-diagonal parts of the added mass, as fractions of the geometric mean of the diagonal.
COUPLING = {(0, 2): 0.06, (1, 5): 0.08, (2, 4): -0.07, (1, 3): 0.05}


class AddedMass(Effect):
    """-(M_A nu_dot + C_A(nu) nu), M_A symmetric with 5 to 8 % off the diagonal; implicit."""

    kind = "added_mass"
    implicit = True

    def __init__(self, target: str, body: int, diagonal: np.ndarray, *, coriolis: float = 1.0):
        units = ("kg", "kg m^2")
        super().__init__(
            target, {axis: (float(v), units[i // 3]) for i, (axis, v) in enumerate(zip(AXES, diagonal)) if v != 0.0}
        )
        self.body, self.coriolis = body, coriolis
        self.matrix = np.diag(diagonal).astype(float)
        for (i, j), part in COUPLING.items():
            self.matrix[i, j] = self.matrix[j, i] = part * np.sqrt(diagonal[i] * diagonal[j])

    def parts(self):
        return [AddedMass(self.target, self.body, part) for part in one_by_one(np.diag(self.matrix))]

    def force(self, plant):
        motion = plant.hull(self.body)
        inertia = np.broadcast_to(self.scale[:, :, None] * self.matrix, (plant.members, 6, 6))
        nu, omega = motion.nu, motion.omega
        momentum = np.matmul(inertia, np.concatenate([nu, omega], 1)[..., None])[..., 0]
        bias = np.concatenate(
            [cross(omega, momentum[:, :3]), cross(nu, momentum[:, :3]) + cross(omega, momentum[:, 3:])], 1
        )
        plant.add_hull_inertia(self.body, inertia, self.coriolis * bias)


class MunkMoment(Effect):
    """(m_A nu) x nu for a mass difference between the axes, softened at high angles of attack."""

    kind = "munk_moment"

    def __init__(self, target: str, body: int, masses: np.ndarray):
        super().__init__(
            target, {axis: (float(v), "kg") for axis, v in zip(AXES, masses) if v != 0.0}, comparable=False
        )
        self.body, self.masses = body, np.asarray(masses, float)[:3]

    def parts(self):
        return [MunkMoment(self.target, self.body, part) for part in one_by_one(self.masses)]

    def force(self, plant):
        motion = plant.hull(self.body)
        nu = motion.nu
        speed2 = (nu * nu).sum(1, keepdims=True) + 1e-9
        soft = 1 - 0.08 * (nu[:, 1:2] ** 2 + nu[:, 2:3] ** 2) / speed2
        torque = cross(self.masses * nu, nu) * soft
        plant.add_wrench(self.body, np.zeros((plant.members, 3)), self.scale * torque)
