"""A run rendered offscreen, frame by frame."""

import os

import mujoco

from hydro_tools.datasets import replay, scene

from .stage import Stage, water_wrench


def frames(model, run: dict, *, fps: int, width: int, height: int):
    """Yield the frames (uint8 [height, width, 3]) of a run."""
    try:
        renderer = mujoco.Renderer(model, height, width, max_geom=4000)
    except Exception as error:  # the backends raise errors of many kinds
        raise OSError(f"MUJOCO_GL={os.environ['MUJOCO_GL']}: {error}") from error
    camera = mujoco.MjvCamera()
    camera.distance, camera.elevation = 2.1, -14.0
    # The plugin draws arrows of its own, to another scale; the film's stand alone.
    option = mujoco.MjvOption()
    option.flags[mujoco.mjtVisFlag.mjVIS_PERTOBJ] = 0
    stage, every = Stage(), round(1 / fps / scene.SAMPLE_PERIOD)
    camera.lookat[:] = run["qpos"][0, :3] - (0, 0, 0.2)
    with renderer:
        for k, data in enumerate(replay.replay(model, run, scene.SAMPLE_PERIOD)):
            if k % every:
                continue
            mujoco.mj_forward(model, data)
            camera.lookat[:] += 0.15 * (data.qpos[:3] - (0, 0, 0.12) - camera.lookat)
            camera.azimuth = 132.0 + 5.0 * k * scene.SAMPLE_PERIOD
            renderer.update_scene(data, camera, option)
            stage.dress(renderer.scene, data, water_wrench(model, data, float(run["density"])))
            yield renderer.render()
