"""A run rendered offscreen, frame by frame."""

import argparse
import os

import mujoco

from hydro_tools.datasets import replay, scene

from .stage import Stage, water_wrench

#: Part of its way that the camera goes after the robot in 1/25 s.
FOLLOW = 0.15


def frames(model, run: dict, args: argparse.Namespace):
    """Yield the frames (uint8 [height, width, 3]) of a run."""
    fps, width, height = args.fps, args.width, args.height
    try:
        renderer = mujoco.Renderer(model, height, width, max_geom=4000)
    except Exception as error:  # the backends raise errors of many kinds
        raise OSError(f"MUJOCO_GL={os.environ['MUJOCO_GL']}: {error}") from error
    camera = mujoco.MjvCamera()
    camera.distance, camera.elevation = args.distance, -14.0
    # The plugin draws arrows of its own, to another scale; the film's stand alone.
    option = mujoco.MjvOption()
    option.flags[mujoco.mjtVisFlag.mjVIS_PERTOBJ] = 0
    stage, every = Stage(args.arrows), round(1 / fps / scene.SAMPLE_PERIOD)
    camera.lookat[:] = run["qpos"][0, :3] - (0, 0, 0.2)
    with renderer:
        for k, data in enumerate(replay.replay(model, run, scene.SAMPLE_PERIOD)):
            if k % every:
                continue
            mujoco.mj_forward(model, data)
            camera.lookat[:] += (1 - (1 - FOLLOW) ** (25 / fps)) * (data.qpos[:3] - (0, 0, 0.12) - camera.lookat)
            camera.azimuth = 132.0 + 5.0 * k * scene.SAMPLE_PERIOD
            renderer.update_scene(data, camera, option)
            stage.dress(renderer.scene, data, water_wrench(model, data, float(run["density"])))
            if k * scene.SAMPLE_PERIOD >= args.skip:
                yield renderer.render()
