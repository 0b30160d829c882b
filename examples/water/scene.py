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


def load(name: str, still: bool = False, **look):
    """The model of an MJCF beside this file with a drawn sea, and its data.

    still: without waves and current. look: arguments of `sea.add_surface`.
    """
    spec = mujoco.MjSpec.from_file(str(HERE / name))
    for water in spec.plugins if still else ():
        water.config = {key: value for key, value in water.config.items() if key not in ("waves", "current")}
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


def survey_picture(view, image, bearings, points, out):
    """Write a camera's view, a sonar's picture as a fan, and a map of points by height side by side to `out`.

    view: pixels of a camera. image: shape (bins, beams), bearings: of the beams [rad], from a range
    of 0. points: x, y, z in the world [m], shape (n, 3).
    """
    try:
        from PIL import Image
    except ImportError:
        print("no picture: pip install hydro-mujoco[examples]", file=sys.stderr)
        return
    height = view.shape[0]
    # Of each pixel: ahead and to the left of the apex at the bottom.
    ahead, left = np.meshgrid(np.arange(height)[::-1], np.arange(height)[::-1] - height / 2, indexing="ij")
    row = (np.hypot(ahead, left) / height * len(image)).astype(int)
    column = (
        np.interp(np.arctan2(left, ahead), bearings, np.arange(len(bearings)), left=-1, right=-1).round().astype(int)
    )
    inside = (row < len(image)) & (column >= 0)
    tone = np.sqrt(np.clip(image / np.percentile(image[image > 0], 97), 0, 1))
    fan = np.where(inside, tone[np.minimum(row, len(image) - 1), column], 0)[..., None] * [255, 190, 80]
    x, y, z = points.T
    scale = height / np.ptp(x)
    across = int(scale * np.ptp(y)) + 1
    chart = np.full((height, across), np.nan)
    order = np.argsort(z)  # the highest last
    chart[
        (height - 1 - (height - 1) * (x - x.min()) / np.ptp(x)).astype(int)[order],
        (scale * (y.max() - y)).astype(int)[order],
    ] = z[order]
    share = (chart - np.nanmin(z)) / np.ptp(z)
    colours = np.stack([255 * share, 90 + 120 * share, 200 - 150 * share], axis=-1)
    chart = np.where(np.isnan(share)[..., None], 20, colours)
    Image.fromarray(np.hstack([view, fan, chart]).astype(np.uint8)).save(out)


def target(name: str) -> pathlib.Path:
    """Where a picture goes: the first argument of the command line, or the working directory."""
    return pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".") / name


__all__ = ["load", "mujoco", "np", "picture", "sea", "target"]
