"""Films a recorded rollout, driven by the learned wrench: `python scripts/film.py --rollouts DIR --out FILE.mp4`.

Needs the plugin library (`cargo build --release`), a folder of rollouts (`record_rollouts.py`) and
offscreen OpenGL: EGL by default (Debian: libegl1), or MUJOCO_GL=osmesa. The orange arrow is the fluid
force on the base (length in proportion to the force without its mean, buoyancy, which would hide all
else); the ghost shows where the robot truly was.
"""

import argparse
import os
import sys
from pathlib import Path

os.environ.setdefault("MUJOCO_GL", "egl")

import mujoco
import numpy as np

ROOT = Path(__file__).resolve().parent.parent
ARROW_METRES_PER_NEWTON = 0.012
ORANGE = np.array([0.95, 0.45, 0.05, 1.0], dtype=np.float32)
GHOST = np.array([0.75, 0.9, 1.0, 0.22], dtype=np.float32)


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rollouts", type=Path, required=True, help="folder of hydro-rollouts/1")
    parser.add_argument("--run", type=int, default=0, help="which rollout of the folder")
    parser.add_argument("--out", type=Path, required=True, help="video to write, .mp4")
    parser.add_argument("--frame", type=Path, help="also write the middle frame as PNG")
    parser.add_argument("--scene", type=Path, default=ROOT / "mjcf" / "b1_swim.xml")
    parser.add_argument("--checkpoint", default=str(ROOT / "models" / "b1-task2"))
    parser.add_argument("--plugin", type=Path, default=ROOT / "target" / "release" / "libhydro_plugin.so")
    parser.add_argument("--seconds", type=float, default=8.0, help="longest film")
    parser.add_argument("--fps", type=int, default=25)
    parser.add_argument("--size", type=int, nargs=2, default=(800, 450), metavar=("WIDTH", "HEIGHT"))
    return parser.parse_args()


def main() -> int:
    args = arguments()
    from simulate import load_run, swim_model  # the twin's own loaders

    if args.out.suffix != ".mp4":
        raise SystemExit(f"film: --out {args.out}: expected a name ending in .mp4")
    run = load_run(args.rollouts, args.run)
    model = swim_model(args.scene, args.plugin, args.checkpoint, run.density)
    frames, middle = render(model, run, args)
    write(frames, args.out, args.fps)
    if args.frame:
        import imageio.v3 as imageio

        imageio.imwrite(args.frame, middle)
    print(f"film: {args.out}, {args.out.stat().st_size / 1e6:.1f} MB")
    return 0


def render(model: mujoco.MjModel, run, args) -> tuple[list[np.ndarray], np.ndarray]:
    """Drives `model` through `run`; one RGB image a frame, and the middle one."""
    width, height = args.size
    model.vis.global_.offwidth = max(model.vis.global_.offwidth, width)
    model.vis.global_.offheight = max(model.vis.global_.offheight, height)
    try:
        renderer = mujoco.Renderer(model, height, width)
    except Exception as error:  # the GL back ends raise their own types
        raise SystemExit(
            f"film: no offscreen OpenGL ({error}); install libegl1, or libosmesa6 and set MUJOCO_GL=osmesa"
        ) from error
    data, truth = mujoco.MjData(model), mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = run.qpos[0], run.qvel[0]
    trunk = model.body("trunk").id
    steps = max(1, round(run.sample_period / model.opt.timestep))
    every = max(1, round(1 / (args.fps * run.sample_period)))
    samples = min(len(run.ctrl), round(args.seconds / run.sample_period))
    wrenches = []
    camera = mujoco.MjvCamera()
    camera.distance, camera.azimuth, camera.elevation = 2.6, 125.0, -18.0
    option = mujoco.MjvOption()
    option.geomgroup[3:] = 0
    images = []
    for k in range(samples):
        data.ctrl[:], data.xfrc_applied[trunk] = run.ctrl[k], run.push[k]
        for _ in range(steps):
            mujoco.mj_step(model, data)
        wrenches.append(data.sensor("water_wrench").data.copy())
        if k % every:
            continue
        camera.lookat = 0.9 * camera.lookat + 0.1 * data.xpos[trunk] if images else data.xpos[trunk].copy()
        renderer.update_scene(data, camera, option)
        arrow(renderer.scene, model, data, trunk, wrenches[-1], run.density)
        truth.qpos[:] = run.qpos[k + 1]
        mujoco.mj_kinematics(model, truth)
        ghost(renderer.scene, model, truth, option)
        images.append(renderer.render().copy())
    renderer.close()
    return images, images[len(images) // 2]


def arrow(scene, model, data, trunk: int, wrench: np.ndarray, density: float) -> None:
    """Adds the fluid force without buoyancy, in the world, from the trunk's centre."""
    rotation = data.xmat[trunk].reshape(3, 3)
    weight = model.body_subtreemass[trunk] * np.linalg.norm(model.opt.gravity)
    # Nearly neutral: what the water carries is close to the weight, and is taken off for the eye.
    force = rotation @ wrench[:3] - np.array([0.0, 0.0, weight])
    start = data.xipos[trunk]
    end = start + ARROW_METRES_PER_NEWTON * force
    if scene.ngeom >= scene.maxgeom or np.linalg.norm(end - start) < 1e-3:
        return
    geom = scene.geoms[scene.ngeom]
    mujoco.mjv_initGeom(geom, mujoco.mjtGeom.mjGEOM_ARROW, np.zeros(3), np.zeros(3), np.eye(3).ravel(), ORANGE)
    mujoco.mjv_connector(geom, mujoco.mjtGeom.mjGEOM_ARROW, 0.025, start, end)
    scene.ngeom += 1


def ghost(scene, model, truth, option) -> None:
    """Adds the true robot as a pale shape."""
    for i in range(model.ngeom):
        if not option.geomgroup[model.geom_group[i]] or scene.ngeom >= scene.maxgeom:
            continue
        if model.geom_bodyid[i] == 0 or model.geom_type[i] == mujoco.mjtGeom.mjGEOM_PLANE:
            continue
        geom = scene.geoms[scene.ngeom]
        mujoco.mjv_initGeom(
            geom, model.geom_type[i], model.geom_size[i], truth.geom_xpos[i], truth.geom_xmat[i], GHOST
        )
        scene.ngeom += 1


def write(frames: list[np.ndarray], path: Path, fps: int) -> None:
    """Encodes H.264; the file appears only when it is whole."""
    import imageio.v2 as imageio

    beside = path.with_name(f".{path.stem}.part.mp4")
    path.parent.mkdir(parents=True, exist_ok=True)
    with imageio.get_writer(beside, fps=fps, codec="libx264", quality=6, macro_block_size=2) as writer:
        for frame in frames:
            writer.append_data(frame)
    beside.replace(path)


if __name__ == "__main__":
    sys.exit(main())
