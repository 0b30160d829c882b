"""Where an instrument is, and how it moves."""

import mujoco
import numpy as np

from ..errors import DataError
from ..sea.water import Water, water_about


class Mount:
    """A site or a body of a model, with an instrument at its origin and along its axes: x forward, y left, z up.

    Attributes:
        name: of the site or body. body: number of the body that holds it. water: about that body.
    """

    def __init__(self, model: mujoco.MjModel, name: str, water: Water | None = None):
        """Find the site of that name, else the body.

        Args:
            model: compiled. name: of the site or body. water: about it; by default that of the body.

        Raises:
            DataError: there is neither, or no water is about it.
        """
        self.model, self.name = model, name
        self._kind, self._number = mujoco.mjtObj.mjOBJ_SITE, _find(model, mujoco.mjtObj.mjOBJ_SITE, name)
        if self._number >= 0:
            self.body = int(model.site_bodyid[self._number])
        else:
            self._kind, self._number = mujoco.mjtObj.mjOBJ_XBODY, _find(model, mujoco.mjtObj.mjOBJ_BODY, name)
            self.body = self._number
        if self._number < 0:
            sites = [model.site(each).name for each in range(model.nsite)]
            there = ", ".join(f"`{each}`" for each in sites if each) or "none"
            raise DataError(f"no site or body is called `{name}`; there are the sites: {there}")
        self.water = water or water_about(model, self.body)

    def position(self, data: mujoco.MjData) -> np.ndarray:
        """In the world [m], shape (3,)."""
        places = data.site_xpos if self._kind == mujoco.mjtObj.mjOBJ_SITE else data.xpos
        return places[self._number].copy()

    def axes(self, data: mujoco.MjData) -> np.ndarray:
        """Axes in the world, its columns, shape (3, 3)."""
        axes = data.site_xmat if self._kind == mujoco.mjtObj.mjOBJ_SITE else data.xmat
        return axes[self._number].reshape(3, 3).copy()

    def velocity(self, data: mujoco.MjData) -> np.ndarray:
        """Of the origin, along the instrument's axes [m/s], shape (3,)."""
        found = np.zeros(6)
        mujoco.mj_objectVelocity(self.model, data, self._kind, self._number, found, 1)
        return found[3:]

    def check(self, data: mujoco.MjData) -> None:
        """Refuse data of another model.

        Raises:
            DataError: they are.
        """
        if data.model is not self.model and data.model._address != self.model._address:
            raise DataError(f"the data are not of the model that the sensor at `{self.name}` was made for")


def velocity_at(model: mujoco.MjModel, data: mujoco.MjData, body: int, point: np.ndarray) -> np.ndarray:
    """Velocity of a point of a body, in the world [m/s], shape (3,)."""
    found = np.zeros(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, found, 0)
    return found[3:] + np.cross(found[:3], point - data.xpos[body])


def _find(model: mujoco.MjModel, kind: mujoco.mjtObj, name: str) -> int:
    return int(mujoco.mj_name2id(model, kind, name))
