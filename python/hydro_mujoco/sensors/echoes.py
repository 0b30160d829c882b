"""Rays that sound takes: straight, from an instrument to the first thing in the water."""

from dataclasses import dataclass

import mujoco
import numpy as np

from .mount import Mount

#: Step beyond a geom that a ray passes through [m].
BEYOND = 1e-6
#: Geoms that a ray passes through at most.
MOST = 64
#: Part at each end of a way that nothing stands in: what an instrument is fixed to does not hide it [m].
NEAR = 1e-3


@dataclass(frozen=True)
class Echoes:
    """What rays meet.

    Attributes:
        distance: [m], shape (n,); not a number where a ray meets nothing.
        normal: of what it meets, in the world, shape (n, 3). geom: its number, -1 for nothing, shape (n,).
    """

    distance: np.ndarray
    normal: np.ndarray
    geom: np.ndarray


class Rays:
    """Rays from an instrument.

    They pass through the instrument's own vehicle (all bodies of its tree) and through geoms that collide with nothing
    and are translucent, as those of markers and drawn surfaces. They end at the surface of the water, which gives no
    echo.
    """

    def __init__(self, mount: Mount):
        """Note what the rays pass through."""
        self._mount, model = mount, mount.model
        root = model.body_rootid[mount.body]
        own = (model.body_rootid[model.geom_bodyid] == root) & (root > 0)
        material = model.geom_matid
        alpha = model.geom_rgba[:, 3].copy()
        if model.nmat:
            alpha = np.where(material >= 0, np.minimum(alpha, model.mat_rgba[material, 3]), alpha)
        ghost = (model.geom_contype == 0) & (model.geom_conaffinity == 0) & (alpha < 1)
        self._passed = own | ghost
        self._exclude = mount.body if root > 0 else -1

    def pass_tree(self, body: int) -> None:
        """Let the rays pass through all bodies of the tree of another body, too."""
        model = self._mount.model
        root = model.body_rootid[body]
        self._passed |= (model.body_rootid[model.geom_bodyid] == root) & (root > 0)

    def cast(self, data: mujoco.MjData, directions: np.ndarray, reach: tuple[float, float]) -> Echoes:
        """What rays meet.

        Args:
            data: of the mount's model.
            directions: unit vectors in the world, shape (n, 3).
            reach: least and greatest distance of an echo [m].
        """
        return self._cast(data, self._mount.position(data), directions, reach)

    def is_open(self, data: mujoco.MjData, place: np.ndarray) -> bool:
        """Whether nothing stands between the instrument and a place in the world [m]; `NEAR` to both nothing does."""
        origin = self._mount.position(data)
        way = place - origin
        distance = float(np.linalg.norm(way))
        if distance <= 2 * NEAR:
            return True
        towards = way / distance
        echo = self._cast(data, origin + NEAR * towards, towards[None], (0.0, distance - 2 * NEAR))
        return bool(echo.geom[0] < 0)

    def _cast(
        self, data: mujoco.MjData, origin: np.ndarray, directions: np.ndarray, reach: tuple[float, float]
    ) -> Echoes:
        """What rays from an origin in the world [m] meet."""
        model, number = self._mount.model, len(directions)
        vectors = np.ascontiguousarray(directions, float)
        distance, geom, normal = np.full(number, -1.0), np.full(number, -1, np.int32), np.zeros(3 * number)
        if self._mount.water.is_wet(origin, data.time):
            end = reach[1]
            vector = vectors.ravel()
            mujoco.mj_multiRay(model, data, origin, vector, None, 1, self._exclude, geom, distance, normal, number, end)
        normals = normal.reshape(number, 3)
        for ray in np.flatnonzero((geom >= 0) & self._passed[geom]):
            distance[ray], geom[ray] = self._beyond(data, origin, vectors[ray], distance[ray], normals[ray])
        met = (geom >= 0) & (distance >= reach[0]) & (distance <= reach[1])
        met[met] = self._mount.water.is_wet(origin + distance[met, None] * vectors[met], data.time)
        return Echoes(np.where(met, distance, np.nan), normals, np.where(met, geom, -1))

    def _beyond(
        self, data: mujoco.MjData, origin: np.ndarray, vector: np.ndarray, distance: float, normal: np.ndarray
    ) -> tuple[float, int]:
        """Distance and geom of the first thing behind one that the ray passes through; writes its normal."""
        geom = np.zeros(1, np.int32)
        for _ in range(MOST):
            distance += BEYOND
            start = origin + distance * vector
            more = mujoco.mj_ray(self._mount.model, data, start, vector, None, 1, self._exclude, geom, normal)
            if more < 0:
                break
            distance += more
            if not self._passed[geom[0]]:
                return distance, int(geom[0])
        return -1.0, -1
