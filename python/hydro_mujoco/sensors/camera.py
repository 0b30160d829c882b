"""Camera under water."""

from typing import Self

import mujoco
import numpy as np

from ..errors import DataError
from ..sea.water import water_about
from .arguments import whole
from .light import WaterLight

#: Share of the distance of the far clipping plane from which on nothing is seen.
FAR = 0.999


class UnderwaterCamera:
    """A camera of the model, with the water's colour between it and what it sees (`WaterLight`).

    A camera above the surface sees as in air. The whole picture of one below is water, the air beyond the surface too;
    nothing is bent at the surface. MuJoCo's translucent things have the distance of their own surface.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        camera: str,
        *,
        width: int = 640,
        height: int = 480,
        light: WaterLight | None = None,
    ):
        """Make a renderer; use the camera as a context manager, or `close` it.

        Args:
            model: compiled. camera: name of a perspective one by field of view; with water about its body.
            width, height: of the picture [pixels], at most those of the model's offscreen buffer.
            light: of the water; `WaterLight()` by default.

        Raises:
            DataError: there is no such camera or water, or a number is out of bounds.
        """
        number = _find(model, camera)
        most = model.vis.global_
        if whole("width", width, 1) > most.offwidth or whole("height", height, 1) > most.offheight:
            raise DataError(
                f"the picture is {width} x {height}; the model's offscreen buffer is "
                f"{most.offwidth} x {most.offheight}: <visual><global offwidth= offheight= />"
            )
        self._model, self._camera, self._light = model, number, light or WaterLight()
        self._water = water_about(model, int(model.cam_bodyid[number]))
        # Rays through the middles of the pixels, along the camera's axes: it looks along -z, y is up.
        half = np.tan(0.5 * np.radians(model.cam_fovy[number]))
        up = half * (1 - 2 * (np.arange(height) + 0.5) / height)
        right = half * width / height * (2 * (np.arange(width) + 0.5) / width - 1)
        self._rays = np.stack([*np.meshgrid(right, up), -np.ones((height, width))], axis=-1)
        self._renderer = mujoco.Renderer(model, height, width)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Free the renderer."""
        self._renderer.close()

    def read(self, data: mujoco.MjData, option: mujoco.MjvOption | None = None) -> np.ndarray:
        """The picture at the state of `data`, 8 bits, shape (height, width, 3).

        option: what of the scene is drawn; by default all but the plugin's arrows.
        """
        if option is None:
            option = mujoco.MjvOption()
            option.flags[mujoco.mjtVisFlag.mjVIS_PERTOBJ] = False
        renderer, place = self._renderer, data.cam_xpos[self._camera]
        renderer.update_scene(data, self._camera, option)
        seen = renderer.render()
        if not self._water.is_wet(place, data.time):
            return seen
        renderer.enable_depth_rendering()
        along = renderer.render().astype(float)
        renderer.disable_depth_rendering()
        along[along > FAR * self._model.vis.map.zfar * self._model.stat.extent] = np.inf
        upwards = self._rays @ data.cam_xmat[self._camera].reshape(3, 3)[2]
        still = self._water.waterline if self._water.waterline is not None else 0.0
        # Nothing is seen without an end: its depth does not matter.
        depth = np.maximum(still - place[2] - np.where(np.isfinite(along), along, 0) * upwards, 0)
        distance = along * np.linalg.norm(self._rays, axis=-1)
        picture = self._light.through(seen / 255, distance, depth, max(still - float(place[2]), 0.0))
        return (255 * np.clip(picture, 0, 1)).round().astype(np.uint8)


def _find(model: mujoco.MjModel, camera: str) -> int:
    """Number of a perspective camera by field of view.

    Raises:
        DataError: there is none of that name, or it is of another kind.
    """
    number = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_CAMERA, camera))
    if number < 0:
        names = ", ".join(f"`{model.camera(each).name}`" for each in range(model.ncam)) or "none"
        raise DataError(f"no camera is called `{camera}`; there are: {names}")
    is_flat = model.cam_projection[number] != mujoco.mjtProjection.mjPROJ_PERSPECTIVE
    if is_flat or model.cam_sensorsize[number].any():
        raise DataError(f"camera `{camera}` is orthographic or has a sensor size; expected one by `fovy` alone")
    return number
