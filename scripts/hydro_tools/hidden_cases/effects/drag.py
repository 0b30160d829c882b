"""Drag that the nominal lacks.

Details that no catalogue entry has: linear drag couples neighbouring axes a little (5 %), quadratic
drag grows with the power 1.9 of each component and 15 % of it with the speed's norm, the strips of the
cross flow taper towards the ends.
"""

import numpy as np

from .base import AXES, Effect, drag_units, one_by_one, six

#: Speed [m/s] and rate [rad/s] at which the power law equals the square law.
REFERENCE = np.array([0.4, 0.4, 0.4, 0.6, 0.6, 0.6])


class LinearDrag(Effect):
    """-D nu, D symmetric with 5 % coupling surge-sway, sway-yaw, heave-pitch."""

    kind = "linear_drag"

    def __init__(self, target: str, body: int, coefficients: np.ndarray):
        super().__init__(target, six(coefficients, drag_units(1)))
        self.body = body
        self.matrix = np.diag(coefficients).astype(float)
        for i, j in ((0, 1), (1, 5), (2, 4)):
            self.matrix[i, j] = self.matrix[j, i] = 0.05 * np.sqrt(coefficients[i] * coefficients[j])

    def parts(self):
        return [LinearDrag(self.target, self.body, part) for part in one_by_one(np.diag(self.matrix))]

    def force(self, plant):
        motion = plant.hull(self.body)
        nu = np.concatenate([motion.nu, motion.omega], 1)
        wrench = -self.scale * (nu @ self.matrix)
        self.note(AXES, -nu, wrench)
        plant.add_hull_wrench(self.body, wrench[:, :3], wrench[:, 3:])


class QuadraticDrag(Effect):
    """-D |nu|^0.9 nu, a part of it with the norm of the speed."""

    kind = "quadratic_drag"

    def __init__(self, target: str, body: int, coefficients: np.ndarray):
        super().__init__(target, six(coefficients, drag_units(2)))
        self.body = body
        self.coefficients = np.asarray(coefficients, float) * REFERENCE**0.1

    def parts(self):
        return [QuadraticDrag(self.target, self.body, part) for part in one_by_one(self.coefficients / REFERENCE**0.1)]

    def force(self, plant):
        motion = plant.hull(self.body)
        nu = np.concatenate([motion.nu, motion.omega], 1)
        own = np.abs(nu)
        norm = np.repeat(np.stack([np.linalg.norm(motion.nu, axis=1), np.linalg.norm(motion.omega, axis=1)], 1), 3, 1)
        grown = (0.85 * own + 0.15 * norm) ** 0.9
        wrench = -self.scale * self.coefficients * grown * nu
        self.note(AXES, -own * nu, wrench)
        plant.add_hull_wrench(self.body, wrench[:, :3], wrench[:, 3:])


class CrossFlowDrag(Effect):
    """Strips across the body's long axis, each with drag of its own lateral and vertical speed."""

    kind = "cross_flow_drag"

    def __init__(
        self,
        target: str,
        body: int,
        *,
        along: int,
        length: float,
        diameter: float,
        coefficient: float,
        centre: float = 0.0,
    ):
        super().__init__(target, {"coefficient": (coefficient, "1")}, comparable=False)
        self.body, self.along = body, along
        station = (np.arange(13) - 6) / 6 * length / 2
        self.station = station + centre
        taper = np.sqrt(np.maximum(1 - (2 * station / (1.08 * length)) ** 2, 0.05))
        self.strength = 0.5 * 1000.0 * coefficient * diameter * taper * length / 13

    def force(self, plant):
        motion = plant.body(self.body)
        force = np.zeros((plant.members, 3))
        torque = np.zeros((plant.members, 3))
        a = self.along
        b, c = (a + 1) % 3, (a + 2) % 3
        # Velocity of a strip at r e_a: nu + omega x r e_a.
        vb = motion.nu[:, b, None] + motion.omega[:, c, None] * self.station
        vc = motion.nu[:, c, None] - motion.omega[:, b, None] * self.station
        speed = np.sqrt(vb * vb + vc * vc)
        fb, fc = -self.strength * speed * vb, -self.strength * speed * vc
        force[:, b], force[:, c] = fb.sum(1), fc.sum(1)
        torque[:, b], torque[:, c] = -(fc * self.station).sum(1), (fb * self.station).sum(1)
        plant.add_wrench(self.body, self.scale * force, self.scale * torque)


__all__ = ["AXES", "CrossFlowDrag", "LinearDrag", "QuadraticDrag"]
