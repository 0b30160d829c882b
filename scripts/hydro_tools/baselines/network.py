"""A residual network: generalised force and load-cell readings that the nominal lacks, from state and controls.

scikit-learn's multilayer perceptron on rows: inputs velocities of every joint (a free joint's in the base frame), the
direction of up in the base, depth, hinge angles, controls; output the residual of inverse dynamics and of the load
cells, smoothed over `smooth_s`, a channel divided by its spread. No name comes out of it.
"""

import warnings

import mujoco
import numpy as np
from scipy.ndimage import gaussian_filter1d
from sklearn.neural_network import MLPRegressor

from .weak import Equations


class Network:
    """Trained by `fit`, a `Forcing` afterwards."""

    def __init__(self, equations: Equations, hidden: tuple[int, ...], alpha: float, smooth_s: float):
        self.equations, self.smooth_s = equations, smooth_s
        self.regressor = MLPRegressor(
            hidden_layer_sizes=hidden,
            alpha=alpha,
            learning_rate_init=2e-3,
            max_iter=200,
            early_stopping=True,
            validation_fraction=0.15,
            n_iter_no_change=12,
            random_state=0,
        )

    def features(self, qpos: np.ndarray, qvel: np.ndarray, control: np.ndarray) -> np.ndarray:
        """[n, inputs]."""
        model, parts = self.equations.model, [control]
        for joint in range(model.njnt):
            q, v = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
            if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE:
                turn = _matrices(qpos[:, q + 3 : q + 7])
                parts += [
                    np.einsum("nji,nj->ni", turn, qvel[:, v : v + 3]),
                    qvel[:, v + 3 : v + 6],
                    turn[:, 2, :],
                    qpos[:, q + 2 : q + 3],
                ]
            else:
                parts += [qpos[:, q : q + 1], qvel[:, v : v + 1]]
        return np.concatenate(parts, 1)

    def fit(self, motions: list, residuals: list[np.ndarray]) -> "Network":
        """Train on motions and their row-wise residuals [n, nv + cells]."""
        x = np.concatenate([self.features(m.qpos, m.qvel, m.control) for m in motions])
        y = np.concatenate([gaussian_filter1d(r, self.smooth_s / m.period, axis=0) for m, r in zip(motions, residuals)])
        self.mean, self.spread = x.mean(0), np.maximum(x.std(0), 1e-6)
        self.size = np.maximum(y.std(0), 1e-9)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self.regressor.fit((x - self.mean) / self.spread, y / self.size)
        return self

    def start(self, model, motion, row):
        """Nothing is remembered."""

    def apply(self, model, data, period):
        force = self._residual(data)[: model.nv]
        free = self.equations.free
        if free is not None:
            turn = data.xmat[self.equations.model.jnt_bodyid[self.equations.model.dof_jntid[free]]].reshape(3, 3)
            force[free : free + 3] = turn @ force[free : free + 3]
        data.qfrc_applied[:] = force

    def sensed(self, model, data):
        out, found = np.zeros(model.nsensordata), self._residual(data)[model.nv :]
        for i, cell in enumerate(self.equations.cells):
            out[model.sensor_adr[cell] : model.sensor_adr[cell] + 3] = found[3 * i : 3 * i + 3]
        return out

    def _residual(self, data) -> np.ndarray:
        x = (self.features(data.qpos[None], data.qvel[None], data.ctrl[None]) - self.mean) / self.spread
        return np.atleast_1d(_forward(self.regressor, x[0])) * self.size


def _forward(regressor: MLPRegressor, x: np.ndarray) -> np.ndarray:
    """One row through the net; the library's own call costs fifty times as much."""
    for i, (w, b) in enumerate(zip(regressor.coefs_, regressor.intercepts_)):
        x = x @ w + b
        if i < len(regressor.coefs_) - 1:
            x = np.maximum(x, 0)
    return x


def _matrices(quaternion: np.ndarray) -> np.ndarray:
    """Rotation matrices [n, 3, 3] of unit quaternions [n, 4]."""
    w, x, y, z = quaternion.T
    return np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], -1),
            np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], -1),
            np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], -1),
        ],
        1,
    )
