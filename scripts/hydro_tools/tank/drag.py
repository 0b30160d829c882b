"""Morison forces on strips: drag in a strip's own flow, and added mass.

With u the velocity of a strip relative to the water, u_n its part across the strip, u_t along it, and
K_i = coefficient times area for flow along the strip's axis i (e1, e2 across, e3 along):

    drag_i = -1/2 rho K_i |u_n| u_i   (i = 1, 2: the cross-flow principle)
    drag_3 = -1/2 rho (K_3 + C_f S) |u_t| u_t
    added  = -rho V_i a_i

J. R. Morison et al., The force exerted by surface waves on piles, J. Petroleum Technology 2 (1950);
O. M. Faltinsen, Sea Loads (1990), chapters 3 and 6. A foot is a ball: all of u counts in every axis.
"""

from dataclasses import dataclass, field

import numpy as np

from . import coefficients
from .geometry import Body

#: Fresh water at 20 C [kg/m^3], [m^2/s]; density rounded as in the project's scenes.
DENSITY, VISCOSITY = 1000.0, 1.0e-6


@dataclass(frozen=True)
class Strips:
    """The strips of a posture with their coefficients; areas [S,3] m^2, volumes [S,3] m^3, wetted [S] m^2."""

    body: Body
    density: float = DENSITY
    areas: np.ndarray = field(init=False)
    volumes: np.ndarray = field(init=False)
    wetted: np.ndarray = field(init=False)
    lengths: np.ndarray = field(init=False)

    def __post_init__(self):
        breadth = self.body.breadth
        set_ = object.__setattr__
        set_(self, "areas", coefficients.drag_areas(self.body))
        set_(self, "volumes", coefficients.added_volumes(self.body))
        set_(self, "wetted", np.where(self.body.ball, 0.0, 2 * breadth.sum(axis=1) * self.body.length))
        # Friction grows along the whole link, not along a strip.
        set_(self, "lengths", np.array([self.body.links[i].length for i in self.body.link]))

    def drag(self, velocity: np.ndarray) -> np.ndarray:
        """Steady drag [..., S, 3] N of strips that move at `velocity` [..., S, 3] m/s through the water; base frame."""
        axes = self.body.axes
        local = np.einsum("sij,...sj->...si", axes, velocity)
        area, pace = self.resistance(local)
        return np.einsum("sij,...si->...sj", axes, -0.5 * self.density * area * pace * local)

    def resistance(self, local: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Coefficient times area [m^2] and the speed that counts [m/s], at velocities along e1 e2 e3 [..., S, 3]."""
        breadth, ball = self.body.breadth, self.body.ball
        across = np.sqrt(local[..., 0] ** 2 + local[..., 1] ** 2)
        along = np.abs(local[..., 2])
        speed = np.sqrt(across**2 + along**2)
        # Flow along e1 separates from the extent along e2, and the other way round.
        edges = coefficients.edge(across[..., None] * breadth[:, ::-1] / VISCOSITY)
        friction = coefficients.friction(along * self.lengths / VISCOSITY) * self.wetted
        area = np.concatenate((self.areas[:, :2] * edges, (self.areas[:, 2] + friction)[..., None]), axis=-1)
        pace = np.stack((across, across, along), axis=-1)
        ball_area = (self.areas[:, 0] * coefficients.sphere(speed * breadth[:, 0] / VISCOSITY))[..., None]
        return np.where(ball[:, None], ball_area, area), np.where(ball[:, None], speed[..., None], pace)

    def added_mass(self) -> np.ndarray:
        """[3,3] kg of all strips together, base frame."""
        return self.density * np.einsum("sij,si,sik->jk", self.body.axes, self.volumes, self.body.axes)
