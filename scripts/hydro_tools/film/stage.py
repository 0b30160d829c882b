"""Force arrows and drifting specks, added to each frame."""

import mujoco
import numpy as np

from hydro_mujoco.recording.features import base_wrench
from hydro_tools.datasets import replay, scene

#: Lengths of the arrows: m/N, m/N, m/(N m); their shaft's radius [m].
WHOLE, DYNAMIC, TORQUE, SHAFT = 1e-3, 8e-3, 2e-2, 0.012
#: Length of the force without buoyancy where it is shown alone [m/N].
ALONE = 1 / 60
#: Specks that drift by: how many, in a cube of this edge [m]; radius [m].
SPECKS, CUBE, SPECK = 350, 5.0, 0.0035


def water_wrench(model, data, density: float) -> tuple:
    """The water's force, the same without buoyancy, and torque on the base; world frame [N, N, N m]."""
    turn = data.body(scene.BASE).xmat.reshape(3, 3)
    sensor = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SENSOR, replay.WRENCH_SENSOR)
    if sensor >= 0:
        wrench = data.sensordata[model.sensor_adr[sensor] :][:6]
    else:
        wrench = base_wrench(data.qpos[3:7], data.qfrc_fluid[:6] + data.qfrc_gravcomp[:6])
    hulls = [i for i in range(model.ngeom) if model.geom(i).name.endswith("_hull")]
    volume = sum(4 / 3 * np.pi * np.prod(model.geom_size[i]) for i in hulls)
    force = turn @ wrench[:3]
    return force, force + density * volume * model.opt.gravity, turn @ wrench[3:]


class Stage:
    """Arrows and specks, added to the renderer's scene each frame."""

    def __init__(self, arrows: str, seed: int = 1):
        self.arrows = arrows
        rng = np.random.default_rng(seed)
        self.specks = rng.uniform(-CUBE / 2, CUBE / 2, (SPECKS, 3))
        self.sizes = SPECK * rng.uniform(0.4, 1.6, SPECKS)
        self.shown = None

    def dress(self, drawn, data, arrows: tuple) -> None:
        """Add this frame's decoration to the mjvScene `drawn`."""
        centre = data.body(scene.BASE).xpos
        # The specks hang still in the water; those left behind appear again ahead.
        places = centre + (self.specks - centre + CUBE / 2) % CUBE - CUBE / 2
        for place, size in zip(places, self.sizes):
            self._geom(drawn, mujoco.mjtGeom.mjGEOM_SPHERE, np.full(3, size), place, (0.85, 0.95, 1.0, 0.35))
        # Arrows are smoothed over a few frames, so that they can be read.
        now = np.array(arrows)
        self.shown = now if self.shown is None else 0.6 * self.shown + 0.4 * now
        looks = ((WHOLE, (0.75, 0.93, 1.0, 0.9)), (DYNAMIC, (1.0, 0.42, 0.08, 1.0)), (TORQUE, (0.72, 0.35, 1.0, 0.9)))
        top = centre + data.body(scene.BASE).xmat.reshape(3, 3) @ (0.0, 0.0, 0.10)
        shown = zip(self.shown, looks) if self.arrows == "all" else [(self.shown[1], (ALONE, looks[1][1]))]
        for vector, (scale, rgba) in shown:
            if np.linalg.norm(scale * vector) > 0.03:
                self._arrow(drawn, top, top + scale * vector, rgba)

    @staticmethod
    def _geom(drawn, kind, size, place, rgba):
        if drawn.ngeom >= drawn.maxgeom:
            return None
        geom = drawn.geoms[drawn.ngeom]
        mujoco.mjv_initGeom(geom, kind, size, place, np.eye(3).ravel(), np.array(rgba, np.float32))
        drawn.ngeom += 1
        return geom

    def _arrow(self, drawn, start, end, rgba) -> None:
        geom = self._geom(drawn, mujoco.mjtGeom.mjGEOM_ARROW, np.zeros(3), np.zeros(3), rgba)
        if geom is not None:
            mujoco.mjv_connector(geom, mujoco.mjtGeom.mjGEOM_ARROW, SHAFT, start, end)
            geom.emission = 0.5
