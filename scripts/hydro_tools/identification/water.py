"""The force of MuJoCo's ellipsoid fluid on B1 in a steady tow, by MuJoCo itself.

B1 stands upright in its free-swimming scene, legs held, and moves at constant velocity: the force of the water on
the robot is the free joint's part of `qfrc_fluid`. The towing scene would say the same; it needs the plugin's library.
"""

import mujoco
import numpy as np

from hydro_tools.datasets import DataError, scene

from .coefficients import KINDS, PARTS
from .measurements import Measurements

#: The scene whose coefficients are varied, relative to the repository.
NOMINAL = "mjcf/b1_truth_default.xml"
#: Columns of `geom_fluid` that hold `fluidcoef`.
COEFFICIENTS = slice(1, 6)


class Water:
    """The tows of `tows` in MuJoCo; `force` may be asked for any coefficients."""

    def __init__(self, tows: Measurements, path: str = NOMINAL):
        self.model = scene.load(path).model
        self._density = self.model.opt.density
        geoms = [self.model.geom(i).name or "" for i in range(self.model.ngeom)]
        self._geoms = [[i for i, name in enumerate(geoms) if name.endswith(f"{part}_hull")] for part in PARTS]
        bare = [
            part for part, found in zip(PARTS, self._geoms) if not found or not self.model.geom_fluid[found, 0].all()
        ]
        if bare:
            raise DataError(f"model {path}: no geom `*_hull` with an ellipsoid's fluid for {', '.join(bare)}")
        self._velocity = tows.velocity
        # Positions do not depend on the water: one state a posture, ready for the stage of velocities.
        postures, self._which = np.unique(tows.posture, axis=0, return_inverse=True)
        self._states = [self._stand(thigh, calf) for thigh, calf in postures]

    def _stand(self, thigh: float, calf: float) -> mujoco.MjData:
        data = mujoco.MjData(self.model)
        data.qpos[:] = 0.0
        data.qpos[3] = 1.0
        data.qpos[7:] = np.tile((0.0, thigh, calf), 4)
        mujoco.mj_fwdPosition(self.model, data)
        return data

    def force(self, coefficients: np.ndarray, density_scale: float = 1.0) -> np.ndarray:
        """Force x, y of the water on the robot [N,2] N, base frame, for coefficients [25]."""
        for geoms, values in zip(self._geoms, np.reshape(coefficients, (len(PARTS), len(KINDS)))):
            self.model.geom_fluid[geoms, COEFFICIENTS] = values
        self.model.opt.density = self._density * density_scale
        out = np.empty((len(self._velocity), 2))
        for row, (which, velocity) in enumerate(zip(self._which, self._velocity)):
            data = self._states[which]
            data.qvel[:2] = velocity
            mujoco.mj_fwdVelocity(self.model, data)
            out[row] = data.qfrc_fluid[:2]
        return out

    def columns(self) -> np.ndarray:
        """Force of each coefficient at one, all others zero, [N,2,25] N: MuJoCo's force is their weighted sum."""
        units = np.eye(len(PARTS) * len(KINDS))
        rest = self.rest()
        return np.stack([self.force(unit) - rest for unit in units], axis=-1)

    def rest(self) -> np.ndarray:
        """Force of the viscosity alone, all coefficients zero, [N,2] N."""
        return self.force(np.zeros(len(PARTS) * len(KINDS)))
