"""Kirchhoff's equations of the bodies' added mass.

With nu = [omega; v] of a body's origin in its own frame and A its added mass [6,6], the momentum of the water is
[L; P] = A nu, and the water acts on the body with

    torque = -(dL/dt + omega x L + v x P),   force = -(dP/dt + omega x P)

(H. Lamb, Hydrodynamics, 1932, chapter VI). The part with the acceleration is M_a qacc in joint space, with
M_a = sum J^T A J; the rest is what `wrench` gives. In water at rest no energy is made or lost. While a robot
crosses the surface A changes; the force of that change (slamming) is left out, as is that of a density that jumps.
"""

import numpy as np

from .strips import Strips, added_volumes


def matrices(strips: Strips, share: np.ndarray | None = None) -> np.ndarray:
    """A over the density [L,6,6], or [m,L,6,6] where of each strip a share [m,S] is wet; order angular, linear."""
    rows, volumes = strips.rows, added_volumes(strips)
    single = np.einsum("si,sij,sik->sjk", volumes, rows, rows)
    if share is None:
        return strips.on_bodies(single[None])[0]
    return strips.on_bodies(share[..., None, None] * single)


def by_body(strips: Strips) -> dict[str, np.ndarray]:
    """A over the density of each body by name [6,6]: kg, kg m, kg m^2 in water of 1 kg/m^3.

    About the body's origin in its frame; rows and columns surge, sway, heave, roll, pitch, yaw, as in `hydro.wrench`.
    """
    order = [3, 4, 5, 0, 1, 2]
    return {name: matrix[np.ix_(order, order)] for name, matrix in zip(strips.names, matrices(strips))}


def joint_space(matrix: np.ndarray, jacobian: np.ndarray) -> np.ndarray:
    """sum J^T A J [m,nv,nv] of A [(m,)L,6,6] and J [m,L,6,nv]."""
    m, bodies, _, dofs = jacobian.shape
    flat = (m, 6 * bodies, dofs)
    return jacobian.reshape(flat).transpose(0, 2, 1) @ (matrix @ jacobian).reshape(flat)


def wrench(matrix: np.ndarray, velocity: np.ndarray, drift: np.ndarray) -> np.ndarray:
    """Torque and force [m,L,6] on the bodies, in their frames, at qacc = 0.

    velocity [m,L,6]: nu; drift [m,L,6]: dnu/dt at qacc = 0.
    """
    momentum = _times(matrix, velocity)
    turn, move = velocity[..., :3], velocity[..., 3:]
    spin, push = momentum[..., :3], momentum[..., 3:]
    gyroscopic = np.concatenate((np.cross(turn, spin) + np.cross(move, push), np.cross(turn, push)), axis=-1)
    return -(_times(matrix, drift) + gyroscopic)


def _times(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    return (matrix @ vector[..., None])[..., 0]
