"""Buoyancy of ellipsoids, deep or cut by a level surface; exact.

A plane cuts an ellipsoid of semi-axes a as it cuts the unit ball y = x / a: with n the upward unit vector in the
ellipsoid's frame and s = |a n| the ball's plane is at height t = (height of the surface above the centre) / s. What
lies below has the share (2 + 3 t - t^3) / 4 of the volume and its centre at -3/4 (1 - t^2)^2 / (2 + 3 t - t^3) times
a^2 n / s.
"""

from dataclasses import dataclass

import mujoco
import numpy as np


@dataclass(frozen=True)
class Hulls:
    """H ellipsoids on bodies; frames are those of the bodies.

    owner [H], index in the list of bodies; centre, semi_axes [H,3] m; turn [H,3,3], columns are the ellipsoid's axes.
    """

    owner: np.ndarray
    centre: np.ndarray
    semi_axes: np.ndarray
    turn: np.ndarray

    @property
    def volume(self) -> np.ndarray:
        """[H] m^3"""
        return 4.0 / 3.0 * np.pi * np.prod(self.semi_axes, axis=1)


def of_model(model: mujoco.MjModel, bodies: np.ndarray) -> Hulls:
    """The geoms of these bodies [L] that MuJoCo's ellipsoid fluid acts on."""
    place = {int(body): index for index, body in enumerate(bodies)}
    geoms = [g for g in range(model.ngeom) if model.geom_fluid[g, 0] > 0 and int(model.geom_bodyid[g]) in place]
    turns = np.zeros((len(geoms), 9))
    for turn, geom in zip(turns, geoms):
        mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
    return Hulls(
        np.array([place[int(model.geom_bodyid[g])] for g in geoms], int),
        model.geom_pos[geoms],
        model.geom_size[geoms],
        turns.reshape(-1, 3, 3),
    )


def wrench(hulls: Hulls, weight: np.ndarray, up: np.ndarray, height: np.ndarray | None, bodies: int) -> np.ndarray:
    """Torque and force [m, bodies, 6] about the bodies' origins, in their frames.

    weight [m]: density times gravity [N/m^3]; up [m,L,3]: the world's z in the bodies' frames; height [m,L]: of the
    surface above the bodies' origins [m], None where the robot is deep.
    """
    n = up[:, hulls.owner]
    volume, centre = np.broadcast_to(hulls.volume, n.shape[:2]), np.broadcast_to(hulls.centre, n.shape)
    if height is not None:
        share, shift = cut(hulls, n, height[:, hulls.owner] - np.sum(n * hulls.centre, axis=-1))
        volume, centre = volume * share, centre + shift
    force = (weight[:, None] * volume)[..., None] * n
    single = np.concatenate((np.cross(centre, force), force), axis=-1)
    out = np.zeros((len(weight), bodies, 6))
    for hull, body in enumerate(hulls.owner):
        out[:, body] += single[:, hull]
    return out


def cut(hulls: Hulls, up: np.ndarray, height: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Share of the volume below the surface [m,H] and its centre from the hull's [m,H,3] m, body frame.

    up [m,H,3]: the world's z in the body's frame; height [m,H]: of the surface above the hull's centre [m].
    """
    n = np.einsum("hij,mhi->mhj", hulls.turn, up)
    reach = np.sqrt(np.sum((hulls.semi_axes * n) ** 2, axis=-1))
    t = np.clip(height / reach, -1.0, 1.0)
    below = 2.0 + 3.0 * t - t**3
    depth = -0.75 * (1.0 - t**2) ** 2 / np.maximum(below, 1e-12)
    shift = (depth / reach)[..., None] * hulls.semi_axes**2 * n
    return below / 4.0, np.einsum("hij,mhj->mhi", hulls.turn, shift)
