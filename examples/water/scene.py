"""What the examples share: the plugin, a model with a drawn sea, and a picture of a run.

Needs `hydro_mujoco`; pictures need pillow (`pip install hydro-mujoco[examples]`) and EGL.
"""

import os
import pathlib
import sys

os.environ.setdefault("MUJOCO_GL", "egl")
import mujoco
import numpy as np
from hydro_mujoco import plugin, sea

HERE = pathlib.Path(__file__).resolve().parent
# `import mujoco` has loaded an installed wheel's; a checkout's is loaded here.
plugin.load_plugin(plugin.built_library("HYDRO_LIBRARY"))


def load(name: str, **look):
    """The model of an MJCF beside this file with a drawn sea, and its data; look: arguments of `sea.add_surface`."""
    spec = mujoco.MjSpec.from_file(str(HERE / name))
    model = sea.add_surface(spec, **look).compile()
    return model, mujoco.MjData(model)


def picture(model, data, out, distance=9.0, azimuth=120.0, elevation=-14.0):
    """Write a frame of the first body and the sea about it to `out`; returns the pixels, None without pillow."""
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
    surface = sea.Surface(model, model.body(1).name)
    with mujoco.Renderer(model, 540, 960) as renderer:
        surface.update(data)
        renderer.update_scene(data, camera, option)
        pixels = renderer.render()
    if out:
        Image.fromarray(pixels).save(out)
    return pixels


def target(name: str) -> pathlib.Path:
    """Where a picture goes: the first argument of the command line, or the working directory."""
    return pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".") / name


__all__ = ["load", "mujoco", "np", "picture", "sea", "target"]
