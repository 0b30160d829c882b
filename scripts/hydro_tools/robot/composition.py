"""Fuse links that move as one into a single rigid body (parallel axis theorem)."""

import numpy as np

from .table import TRUNK, Inertial, fixed_links, moving_links


def _matrix(inertia: tuple[float, ...]) -> np.ndarray:
    xx, yy, zz, xy, xz, yz = inertia
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def rotation(rpy: tuple[float, float, float]) -> np.ndarray:
    """parent_from_child of the URDF's fixed-axis roll, pitch, yaw [rad]."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    roll = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    pitch = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    yaw = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return yaw @ pitch @ roll


def _fuse(parts: list[tuple[Inertial, tuple, tuple]]) -> Inertial:
    """One body out of (inertial, xyz, rpy) parts, all posed in the same frame."""
    masses = np.array([part.mass for part, _, _ in parts])
    centres = np.array([np.asarray(xyz) + rotation(rpy) @ part.com for part, xyz, rpy in parts])
    mass = masses.sum()
    com = masses @ centres / mass
    inertia = np.zeros((3, 3))
    for (part, _, rpy), centre in zip(parts, centres):
        turn, arm = rotation(rpy), centre - com
        inertia += turn @ _matrix(part.inertia) @ turn.T
        inertia += part.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    moments = (inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2])
    return Inertial(float(mass), tuple(map(float, com)), tuple(map(float, moments)))


def fused() -> dict[str, Inertial]:
    """Mass properties of the 13 bodies that move on their own: rotors, feet and sensors included."""
    own = {"trunk": TRUNK} | {link.name: link.inertial for link in moving_links()}
    origin = (0.0, 0.0, 0.0)
    return {
        name: _fuse(
            [(inertial, origin, origin)]
            + [(link.inertial, link.xyz, link.rpy) for link in fixed_links() if link.parent == name]
        )
        for name, inertial in own.items()
    }
