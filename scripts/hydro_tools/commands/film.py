r"""Film the swimming robot offscreen, with the water's force drawn as arrows.

    python scripts/film.py --out out/swim.mp4                               # the plugin's water
    python scripts/film.py --out out/truth.mp4 --scene mjcf/b1_truth.xml
    python scripts/film.py --out out/run.mp4 --rollouts out/rollouts --index 3
    python scripts/film.py --out out/gait.mp4 --gait out/gaits/learned-0/gait.json       # in the truth
    python scripts/film.py --out docs/swim.webp --checkpoint models/b1-relaxation --seconds 6 --skip 1 --loop 0.5 \
        --arrows motion --distance 1.85 --size 600x400                       # the front page's

Pale arrow: the whole force of the water on the base, 1 m for 1000 N. Orange: the same
without buoyancy, 1 m for 125 N. Violet: the torque, 1 m for 50 N m. With
--arrows motion the orange one alone, 1 m for 60 N. Needs EGL (Debian: libegl1) or
OSMesa (libosmesa6), and imageio with imageio-ffmpeg (pip install -e . -e scripts[film]).
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

    from hydro_mujoco import plugin
    from hydro_tools.datasets import DataError, replay, rollouts, scene
    from hydro_tools.film.choreography import choreography
    from hydro_tools.film.frames import frames
    from hydro_tools.film.webp import WebpWriter
    from hydro_tools.gaits import gait_file, waters
    from hydro_tools.gaits import replay as gait_replay
    from hydro_tools.repository import ROOT
except (ImportError, AttributeError) as error:
    IMPORT_FAULT: Exception | None = error
else:
    IMPORT_FAULT = None


def parse() -> argparse.Namespace:
    """The command line, checked."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="film: .mp4, .webm, .gif or .webp")
    parser.add_argument("--scene", help="default: mjcf/b1_swim.xml")
    parser.add_argument("--plugin", type=Path, help="plugin library (default: target/release/...)")
    parser.add_argument("--checkpoint", type=Path, help="checkpoint folder, instead of the scene's")
    parser.add_argument("--rollouts", type=Path, help="film a recorded rollout instead of the built-in gaits")
    parser.add_argument("--gait", type=Path, help="film a gait of learn_gait.py in the truth, mjcf/b1_truth.xml")
    parser.add_argument("--index", type=int, default=0, help="which one (default: %(default)s)")
    parser.add_argument("--seconds", type=float, default=8.0, help="default: %(default)s")
    parser.add_argument(
        "--skip", type=float, default=0.0, metavar="S", help="of these not shown (default: %(default)s)"
    )
    parser.add_argument(
        "--arrows",
        choices=("all", "motion"),
        default="all",
        help="all, or only the force without buoyancy (default: %(default)s)",
    )
    parser.add_argument("--distance", type=float, default=2.1, metavar="M", help="of the camera (default: %(default)s)")
    parser.add_argument(
        "--density", type=float, default=1000.0, help="kg/m^3, of the built-in run (default: %(default)s)"
    )
    parser.add_argument("--fps", type=int, default=25, choices=(10, 20, 25, 50), help="default: %(default)s")
    parser.add_argument(
        "--loop",
        type=float,
        default=0.0,
        metavar="S",
        help="of a .webp: its last seconds blend into its first ones (default: %(default)s)",
    )
    parser.add_argument("--quality", type=int, default=60, help="of a .webp, 0 to 100 (default: %(default)s)")
    parser.add_argument("--size", default="640x480", help="default: %(default)s")
    parser.add_argument("--still", type=Path, help="also write the middle frame as this PNG")
    args = parser.parse_args()
    try:
        args.width, args.height = (int(part) for part in args.size.split("x"))
    except ValueError:
        parser.error(f"--size {args.size}: expected WIDTHxHEIGHT, such as 640x480")
    if args.gait and (args.scene or args.rollouts or args.checkpoint):
        parser.error("--gait is filmed in the truth: not together with --scene, --rollouts or --checkpoint")
    args.scene = args.scene or ("mjcf/b1_truth.xml" if args.gait else "mjcf/b1_swim.xml")
    if args.out.suffix not in (".mp4", ".webm", ".gif", ".webp"):
        parser.error(f"--out {args.out}: expected .mp4, .webm, .gif or .webp")
    if args.loop < 0 or not 0 <= args.quality <= 100:
        parser.error("--loop must not be below zero, --quality from 0 to 100")
    if not args.seconds > 0 or not args.density >= 0 or not args.distance > 0:
        parser.error("--seconds and --distance must be above zero, --density not below it")
    if not 0 <= args.skip < args.seconds:
        parser.error(f"--skip {args.skip}: expected 0 or more, and less than --seconds")
    return args


def writer(path: Path, args: argparse.Namespace):
    """The writer of a film, by the ending of its name."""
    if path.suffix == ".webp":
        return WebpWriter(path, fps=args.fps, quality=args.quality, fade=round(args.loop * args.fps))
    options = {} if path.suffix == ".gif" else {"macro_block_size": 1, "quality": 8}
    return imageio.get_writer(path, fps=args.fps, **options)


def film(args: argparse.Namespace) -> int:
    """Render and encode; returns the number of frames."""
    if args.gait:
        truth = waters.water("truth")
        run = gait_replay.as_run(gait_file.read(args.gait, truth.model()), truth, args.seconds)
    elif args.rollouts is None:
        run = choreography(args.seconds, args.density)
    else:
        _, runs = rollouts.read(args.rollouts)
        if not 0 <= args.index < len(runs):
            raise DataError(f"--index {args.index}: {args.rollouts} holds runs 0 to {len(runs) - 1}")
        run = runs[args.index]
        rows = round(args.seconds / scene.SAMPLE_PERIOD)
        run["ctrl"], run["push"] = run["ctrl"][:rows], run["push"][:rows]
    if plugin.WRENCH in scene.find(args.scene).read_text(encoding="utf-8"):
        plugin.load_plugin(args.plugin or ROOT / "target/release" / plugin.library_name())
    model = replay.compile_scene(args.scene, density=float(run["density"]), checkpoint=args.checkpoint)
    args.out.parent.mkdir(parents=True, exist_ok=True)
    beside = args.out.with_name(f"tmp-{args.out.name}")
    expected = round((len(run["ctrl"]) * scene.SAMPLE_PERIOD - args.skip) * args.fps)
    count = 0
    try:
        with writer(beside, args) as out:
            for image in frames(model, run, args):
                out.append_data(image)
                if args.still and count == expected // 2:
                    imageio.imwrite(args.still, image)
                count += 1
        os.replace(beside, args.out)
    finally:
        beside.unlink(missing_ok=True)
    return count


def main() -> int:
    """Run the command line; returns the exit status."""
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
