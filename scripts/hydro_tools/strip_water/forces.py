"""What the water does to the robot at one state: drag with its wakes, buoyancy, added mass."""

from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np

from . import added_mass, buoyancy, wake
from .kinematics import Kinematics
from .strips import Strips


@dataclass(frozen=True)
class Forces:
    """Generalised forces of m simulations: drag and lift (buoyancy) [m,nv]; added mass as M_a [m,nv,nv] and the rest of
    its force at qacc = 0, `drift` [m,nv]. velocity, pace [m,S,3]: of the strips, for their wakes.
    """

    drag: np.ndarray
    lift: np.ndarray
    mass: np.ndarray
    drift: np.ndarray
    velocity: np.ndarray
    pace: np.ndarray

    def added(self, qacc: np.ndarray) -> np.ndarray:
        """Force of the added mass [m,nv] at an acceleration [m,nv]."""
        return self.drift - (self.mass @ qacc[..., None])[..., 0]


@dataclass(frozen=True)
class Water:
    """The water of a robot: its strips and hulls. waterline: world z of the surface [m], None if deep."""

    strips: Strips
    hulls: buoyancy.Hulls
    gravity: float
    waterline: float | None = None

    @cached_property
    def _deep(self) -> np.ndarray:
        return added_mass.matrices(self.strips)

    def wet(self, at: Kinematics) -> np.ndarray | None:
        """Share [m,S,1] of each strip that is below the surface, None if all are."""
        if self.waterline is None:
            return None
        owner, body = self.strips.owner, self.strips.sections.body
        height = at.height[:, owner] + np.sum(at.up[:, owner] * body.centre, axis=-1)
        return np.clip((self.waterline - height) / self.strips.width + 0.5, 0.0, 1.0)[..., None]

    def forces(self, at: Kinematics, wakes: np.ndarray, density: np.ndarray) -> Forces:
        """At a state, with wakes [m,S,3] m/s and density [m] kg/m^3."""
        strips = self.strips
        share = self.wet(at)
        velocity = np.einsum("sij,msj->msi", strips.rows, at.velocity[:, strips.owner])
        relative = velocity - wakes
        area, pace = strips.sections.resistance(relative)
        pull = -0.5 * wake.GAIN * density[:, None, None] * area * pace * relative
        if share is not None:
            pull = share * pull
        dragging = strips.on_bodies(np.einsum("sij,msi->msj", strips.rows, pull))

        over = None if self.waterline is None else self.waterline - at.height
        lifting = buoyancy.wrench(self.hulls, density * self.gravity, at.up, over, len(strips.names))

        matrix = self._deep if share is None else added_mass.matrices(strips, share[..., 0])
        mass = density[:, None, None] * added_mass.joint_space(matrix, at.jacobian)
        drifting = density[:, None, None] * added_mass.wrench(matrix, at.velocity, at.drift)
        on_joints = _joint_force(at.jacobian)
        return Forces(on_joints(dragging), on_joints(lifting), mass, on_joints(drifting), velocity, pace)


def _joint_force(jacobian: np.ndarray):
    m, bodies, _, dofs = jacobian.shape
    onto = jacobian.reshape(m, 6 * bodies, dofs).transpose(0, 2, 1)
    return lambda wrench: (onto @ wrench.reshape(m, 6 * bodies, 1))[..., 0]


def water(model: mujoco.MjModel, strips: Strips, waterline: float | None = None) -> Water:
    """The water of a model's robot; gravity points down."""
    hulls = buoyancy.of_model(model, strips.ids(model))
    return Water(strips, hulls, float(-model.opt.gravity[2]), waterline)
