"""What the examples share: the plugin, and a picture of a run with the water's surface in it.

Needs `hydro_mujoco`; pictures need pillow (`pip install hydro-mujoco[examples]`) and EGL.
"""

import os
import pathlib
import sys

os.environ.setdefault("MUJOCO_GL", "egl")
import mujoco
import numpy as np
from hydro_mujoco import plugin

HERE = pathlib.Path(__file__).resolve().parent
# `import mujoco` has loaded an installed wheel's; a checkout's is loaded here.
plugin.load_plugin(plugin.built_library("HYDRO_LIBRARY"))


def load(name: str):
    """The model of an MJCF beside this file, and its data."""
    model = mujoco.MjModel.from_xml_path(str(HERE / name))
    return model, mujoco.MjData(model)


def draw_sea(scene, height, centre, size=24.0, cells=32):
    """Draw the surface: `height(x, y)` in m, a square of `size` m about `centre`."""
    step = size / cells
    for i in range(cells):
        for j in range(cells):
            if scene.ngeom >= scene.maxgeom:
                return
            x, y = (
                centre[0] + (i - cells / 2 + 0.5) * step,
                centre[1] + (j - cells / 2 + 0.5) * step,
            )
            h = 0.5 * step
            dx, dy = (
                (height(x + h, y) - height(x - h, y)) / step,
                (height(x, y + h) - height(x, y - h)) / step,
            )
            along = np.array([1.0, 0.0, dx]) / np.hypot(1, dx)
            normal = np.array([-dx, -dy, 1.0]) / np.sqrt(1 + dx * dx + dy * dy)
            frame = np.column_stack([along, np.cross(normal, along), normal])
            mujoco.mjv_initGeom(
                scene.geoms[scene.ngeom],
                mujoco.mjtGeom.mjGEOM_PLANE,
                np.array([h * np.hypot(1, dx), h * np.hypot(1, dy), 0.0]),
                np.array([x, y, height(x, y)]),
                frame.ravel(),
                np.array([0.1, 0.4, 0.6, 0.5], np.float32),
            )
            scene.ngeom += 1


def picture(
    model,
    data,
    out,
    height=lambda x, y: 0.0,
    distance=9.0,
    azimuth=120.0,
    elevation=-14.0,
    size=24.0,
):
    """Write a frame of the first body and the surface about it to `out`; returns the pixels, None without pillow."""
    try:
        from PIL import Image
    except ImportError:
        print("no picture: pip install hydro-mujoco[examples]", file=sys.stderr)
        return None
    camera = mujoco.MjvCamera()
    camera.lookat[:] = data.xpos[1]
    camera.distance, camera.azimuth, camera.elevation = distance, azimuth, elevation
    option = mujoco.MjvOption()
    option.flags[mujoco.mjtVisFlag.mjVIS_PERTOBJ] = 0  # without the plugin's arrows
    with mujoco.Renderer(model, 540, 960, max_geom=4000) as renderer:
        renderer.update_scene(data, camera, option)
        draw_sea(renderer.scene, height, data.xpos[1], size)
        pixels = renderer.render()
    if out:
        Image.fromarray(pixels).save(out)
    return pixels


def target(name: str) -> pathlib.Path:
    """Where a picture goes: the first argument of the command line, or the working directory."""
    return pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".") / name
