#!/usr/bin/env python3
"""Film the swimming robot offscreen, with the water's force drawn as arrows.

    python scripts/film.py --out out/swim.mp4                               # the plugin's water
    python scripts/film.py --out out/truth.mp4 --scene mjcf/b1_truth.xml
    python scripts/film.py --out out/run.mp4 --rollouts out/rollouts --index 3

Pale arrow: the whole force of the water on the base, 1 m for 1000 N. Orange: what is left of it
without buoyancy, 1 m for 125 N. Violet: the torque, 1 m for 50 N m. Needs EGL (Debian: libegl1) or
OSMesa (libosmesa6), and imageio with imageio-ffmpeg (scripts/requirements.txt).
"""

import argparse
import os
import sys
from pathlib import Path

#: Rendering backends, tried in this order unless MUJOCO_GL names one.
BACKENDS = ("egl", "osmesa")
FORCED = "MUJOCO_GL" in os.environ
os.environ.setdefault("MUJOCO_GL", BACKENDS[0])

try:
    import imageio.v2 as imageio
    import mujoco
    import numpy as np

    from hydro_tools.datasets import DataError, features, gait, plan, replay, rollouts, scene
except (ImportError, AttributeError) as error:
    IMPORT_FAULT: Exception | None = error
else:
    IMPORT_FAULT = None

#: Lengths of the arrows: m/N, m/N, m/(N m); their shaft's radius [m].
WHOLE, DYNAMIC, TORQUE, SHAFT = 1e-3, 8e-3, 2e-2, 0.012
#: Specks that drift by: how many, in a cube of this edge [m]; radius [m].
SPECKS, CUBE, SPECK = 350, 5.0, 0.0035


def choreography(seconds: float, density: float) -> dict:
    """A run that looks like swimming: a trot that becomes a paddle, from the standing posture."""
    t = np.arange(round(seconds / scene.SAMPLE_PERIOD)) * scene.SAMPLE_PERIOD

    def swing(pattern: str, frequency: float, amplitude: tuple, centre: tuple) -> np.ndarray:
        # The calf trails the thigh by a quarter of a cycle: it folds on the way forward.
        phase = 2 * np.pi * np.array(gait.PATTERNS[pattern])[:, None] + np.array([0.0, 0.0, -np.pi / 2])
        return gait.Gait(np.tile(centre, 4), np.tile(amplitude, 4), frequency, phase.ravel(), 0.15).targets(t)

    ctrl = gait.hold(np.tile(gait.CENTRE, 4)).targets(t)
    gait.crossfade(ctrl, swing("trot", 0.9, (0.05, 0.55, 0.5), (0.0, 0.75, -1.5)), 0, 80)
    half = len(t) // 2
    gait.crossfade(ctrl, swing("paddle", 0.7, (0.2, 0.6, 0.6), (0.1, 0.6, -1.35))[half:], half, 60)
    joint_range = scene.load().joint_range
    qpos = np.concatenate(([0, 0, 0, 1, 0, 0, 0], np.tile(gait.CENTRE, 4)))
    return {"qpos": qpos[None], "qvel": np.zeros((1, 18)), "ctrl": gait.within(ctrl, joint_range),
            "push": np.zeros((len(t), 6)), "density": density}


def water_wrench(model, data, density: float) -> tuple:
    """The water's force, the same without buoyancy, and torque on the base; world frame [N, N, N m]."""
    turn = data.body(scene.BASE).xmat.reshape(3, 3)
    sensor = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SENSOR, replay.WRENCH_SENSOR)
    if sensor >= 0:
        wrench = data.sensordata[model.sensor_adr[sensor] :][:6]
    else:
        wrench = features.base_wrench(data.qpos[3:7], data.qfrc_fluid[:6] + data.qfrc_gravcomp[:6])
    hulls = [i for i in range(model.ngeom) if model.geom(i).name.endswith("_hull")]
    volume = sum(4 / 3 * np.pi * np.prod(model.geom_size[i]) for i in hulls)
    force = turn @ wrench[:3]
    return force, force + density * volume * model.opt.gravity, turn @ wrench[3:]


class Stage:
    """What is drawn beside the robot: arrows and specks, added to the renderer's scene each frame."""

    def __init__(self, seed: int = 1):
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
        for vector, (scale, rgba) in zip(self.shown, looks):
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


def parse() -> argparse.Namespace:
    """The command line, checked."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="film: .mp4, .webm or .gif")
    parser.add_argument("--scene", default="mjcf/b1_swim.xml", help="default: %(default)s")
    parser.add_argument("--plugin", type=Path, help="plugin library (default: target/release/...)")
    parser.add_argument("--checkpoint", type=Path, help="checkpoint folder, instead of the scene's")
    parser.add_argument("--rollouts", type=Path, help="film a recorded rollout instead of the built-in gaits")
    parser.add_argument("--index", type=int, default=0, help="which one (default: %(default)s)")
    parser.add_argument("--seconds", type=float, default=8.0, help="default: %(default)s")
    parser.add_argument("--density", type=float, default=1000.0, help="kg/m^3, of the built-in run (default: %(default)s)")
    parser.add_argument("--fps", type=int, default=25, choices=(10, 20, 25, 50), help="default: %(default)s")
    parser.add_argument("--size", default="640x480", help="default: %(default)s")
    parser.add_argument("--still", type=Path, help="also write the middle frame as this PNG")
    args = parser.parse_args()
    try:
        args.width, args.height = (int(part) for part in args.size.split("x"))
    except ValueError:
        parser.error(f"--size {args.size}: expected WIDTHxHEIGHT, such as 640x480")
    if args.out.suffix not in (".mp4", ".webm", ".gif"):
        parser.error(f"--out {args.out}: expected .mp4, .webm or .gif")
    if not args.seconds > 0 or not args.density >= 0:
        parser.error("--seconds must be above zero, --density not below it")
    return args


def film(args: argparse.Namespace) -> int:
    """Render and encode; returns the number of frames."""
    if args.rollouts is None:
        run = choreography(args.seconds, args.density)
    else:
        _, runs = rollouts.read(args.rollouts)
        if not 0 <= args.index < len(runs):
            raise DataError(f"--index {args.index}: {args.rollouts} holds runs 0 to {len(runs) - 1}")
        run = runs[args.index]
        rows = round(args.seconds / scene.SAMPLE_PERIOD)
        run["ctrl"], run["push"] = run["ctrl"][:rows], run["push"][:rows]
    if replay.PLUGIN in scene.find(args.scene).read_text(encoding="utf-8"):
        replay.load_plugin(args.plugin or scene.ROOT / "target/release" / replay.library_name())
    model = replay.compile_scene(args.scene, density=float(run["density"]), checkpoint=args.checkpoint)
    args.out.parent.mkdir(parents=True, exist_ok=True)
    beside = args.out.with_name(f"tmp-{args.out.name}")
    options = {} if args.out.suffix == ".gif" else {"macro_block_size": 1, "quality": 8}
    expected = len(run["ctrl"]) // round(1 / args.fps / scene.SAMPLE_PERIOD)
    count = 0
    try:
        with imageio.get_writer(beside, fps=args.fps, **options) as writer:
            for image in frames(model, run, fps=args.fps, width=args.width, height=args.height):
                writer.append_data(image)
                if args.still and count == expected // 2:
                    imageio.imwrite(args.still, image)
                count += 1
        os.replace(beside, args.out)
    finally:
        beside.unlink(missing_ok=True)
    return count


def main() -> int:
    args = parse()
    fault: Exception | None = IMPORT_FAULT
    if fault is None:
        try:
            count = film(args)
            print(f"{args.out}: {count} frames, {args.width}x{args.height}, {args.fps} a second")
            return 0
        except (DataError, ValueError) as error:
            print(f"film.py: {error}", file=sys.stderr)
            return 1
        except OSError as error:
            fault = error
    rendering = "MUJOCO_GL" in str(fault) or "GL" in type(fault).__name__ or isinstance(fault, AttributeError)
    if rendering and not FORCED:
        print(f"film.py: no rendering by EGL ({fault}); trying OSMesa", file=sys.stderr)
        os.execve(sys.executable, [sys.executable, *sys.argv], os.environ | {"MUJOCO_GL": BACKENDS[1]})
    hint = ": install Debian's libegl1 and libgl1-mesa-dri, or libosmesa6" if rendering else ""
    print(f"film.py: {fault}{hint}", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
