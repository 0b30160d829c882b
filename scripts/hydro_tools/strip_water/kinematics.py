"""Velocities and Jacobians of the bodies of many simulations at once, in the bodies' own frames.

MuJoCo keeps motions as angular and linear velocity at the centre of mass of the whole tree, along the world's axes;
here they are moved to the origin and the axes of each body.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np


@dataclass(frozen=True)
class Kinematics:
    """Of m simulations; motions are angular, then linear [rad/s, m/s].

    up [m,L,3]: the world's z; height [m,L]: of the origins [m]; jacobian [m,L,6,nv]; velocity [m,L,6];
    drift [m,L,6]: rate of the velocity at qacc = 0.
    """

    up: np.ndarray
    height: np.ndarray
    jacobian: np.ndarray
    velocity: np.ndarray
    drift: np.ndarray


class Reader:
    """Reads the kinematics of simulations whose position and velocity stages have run."""

    def __init__(self, model: mujoco.MjModel, datas: Sequence[mujoco.MjData], bodies: np.ndarray):
        self.bodies = bodies
        root = int(model.body_rootid[bodies[0]])
        self.moves = moves(model, bodies)[:, None, :]
        # Views of MuJoCo's memory, which stays where it is.
        self.views = {
            name: [getattr(data, name) for data in datas] for name in ("xmat", "xpos", "cdof", "cdof_dot", "qvel")
        }
        self.centre = [data.subtree_com[root] for data in datas]

    def read(self, ids: Sequence[int]) -> Kinematics:
        """Of the simulations `ids`."""
        xmat, xpos, cdof, cdof_dot, qvel = (
            np.stack([views[i] for i in ids])
            for views in (self.views[name] for name in ("xmat", "xpos", "cdof", "cdof_dot", "qvel"))
        )
        position = xpos[:, self.bodies]
        # world_from_body; its transpose takes a world vector into the body's frame.
        into = xmat[:, self.bodies].reshape(len(ids), -1, 3, 3).transpose(0, 1, 3, 2)
        arm = position - np.stack([self.centre[i] for i in ids])[:, None]
        jacobian = self._moved(into, arm, cdof.transpose(0, 2, 1)) * self.moves
        drifting = self._moved(into, arm, cdof_dot.transpose(0, 2, 1)) * self.moves
        rate = qvel[:, None, :, None]
        return Kinematics(
            np.ascontiguousarray(into[..., 2]),
            position[..., 2],
            jacobian,
            (jacobian @ rate)[..., 0],
            (drifting @ rate)[..., 0],
        )

    @staticmethod
    def _moved(into: np.ndarray, arm: np.ndarray, motion: np.ndarray) -> np.ndarray:
        """[m,L,6,nv] of motions [m,6,nv]."""
        turn, move = motion[:, None, :3], motion[:, None, 3:]
        x, y, z = (arm[..., i, None] for i in range(3))
        a, b, c = (turn[:, :, i] for i in range(3))
        swept = np.stack((b * z - c * y, c * x - a * z, a * y - b * x), axis=2)
        return np.concatenate((into @ turn, into @ (move + swept)), axis=2)


def moves(model: mujoco.MjModel, bodies: np.ndarray) -> np.ndarray:
    """1 where a degree of freedom moves a body, else 0 [L, nv]."""
    out = np.zeros((len(bodies), model.nv))
    for row, body in zip(out, bodies):
        while body > 0:
            first = model.body_dofadr[body]
            if first >= 0:
                row[first : first + model.body_dofnum[body]] = 1.0
            body = model.body_parentid[body]
    return out
