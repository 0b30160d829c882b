"""Steps a second in MuJoCo Warp with hydro's water, against the plugin under mujoco.rollout.

    python scripts/bench_warp.py [--scene rov] [--worlds 1 64 1024] [--steps 50] [--rounds 5] [--threads 2]
    python scripts/bench_warp.py --checkpoint b1-strip

Every row is timed in turn, rounds times; printed are medians with quartiles, and the median ratio to the plugin. On a
GPU a step is a CUDA graph; on a CPU MuJoCo Warp runs one world after the other on one core.
"""

import argparse
import os
import time
from collections.abc import Callable

import mujoco
import mujoco_warp as mjw
import numpy as np
import warp as wp
from mujoco import rollout
from tqdm.auto import tqdm

import hydro_mujoco
from hydro_mujoco import warp as water
from hydro_mujoco.plugin import load_plugin

SCENES = ("rov", "fish")
#: The scene of released checkpoints.
SWIMMER = "b1_swim"


def models(scene: str, checkpoint: str | None) -> tuple[mujoco.MjModel, mujoco.MjModel]:
    """The scene's model with the plugin, and the one without it; checkpoint: name of the one that B1 swims in."""
    load_plugin()
    spec = mujoco.MjSpec.from_file(hydro_mujoco.scene(SWIMMER if checkpoint else scene))
    if checkpoint:
        folder = hydro_mujoco.checkpoint(checkpoint)
        spec.plugins[0].config = dict(spec.plugins[0].config) | {"checkpoint": folder}
    return spec.compile(), water.without_plugin(spec).compile()


def on_device(
    model: mujoco.MjModel | None, plain: mujoco.MjModel, worlds: int, steps: int, device: wp.Device
) -> Callable[[], float]:
    """Steps a second of all worlds together in MuJoCo Warp; model: whose water it has, if any."""
    with wp.ScopedDevice(device):
        m, d = mjw.put_model(plain), mjw.make_data(plain, nworld=worlds)
        if model is not None:
            water.attach(m, model, nworld=worlds)
        mjw.step(m, d)
        graph = None
        if device.is_cuda:
            with wp.ScopedCapture() as capture:
                mjw.step(m, d)
            graph = capture.graph

    def run() -> float:
        with wp.ScopedDevice(device):
            mjw.reset_data(m, d)
            wp.synchronize()
            start = time.perf_counter()
            for _ in range(steps):
                if graph is None:
                    mjw.step(m, d)
                else:
                    wp.capture_launch(graph)
            wp.synchronize()
            return worlds * steps / (time.perf_counter() - start)

    return run


def on_threads(model: mujoco.MjModel, worlds: int, steps: int, threads: int) -> Callable[[], float]:
    """Steps a second of all worlds together under mujoco.rollout."""
    data = [mujoco.MjData(model) for _ in range(threads)]
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    first = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data[0], first, kind)
    starts = np.tile(first, (worlds, 1))
    pool = rollout.Rollout(nthread=threads)

    def run() -> float:
        start = time.perf_counter()
        pool.rollout(model, data, starts, nstep=steps)
        return worlds * steps / (time.perf_counter() - start)

    return run


def table(args: argparse.Namespace, worlds: int) -> list[str]:
    """Rows for a number of worlds, in Markdown."""
    model, plain = models(args.scene, args.checkpoint)
    device = wp.get_device(args.device)
    runs = {
        f"plugin, rollout, {args.threads} threads": on_threads(model, worlds, args.steps, args.threads),
        f"without water, rollout, {args.threads} threads": on_threads(plain, worlds, args.steps, args.threads),
        f"hydro_mujoco.warp, {device}": on_device(model, plain, worlds, args.steps, device),
        f"without water, MuJoCo Warp, {device}": on_device(None, plain, worlds, args.steps, device),
    }
    rates: dict[str, list[float]] = {label: [] for label in runs}
    for run in runs.values():
        run()
    for _ in tqdm(range(args.rounds), desc=f"{worlds} worlds", leave=False, disable=None):
        for label, run in runs.items():
            rates[label].append(run())
    plugin = np.array(next(iter(rates.values())))
    rows = [
        f"| {args.checkpoint or args.scene}, {worlds} worlds | steps a second | times the plugin |",
        "|---|---|---|",
    ]
    for label, found in rates.items():
        least, median, most = np.quantile(found, [0.25, 0.5, 0.75])
        ratio = np.median(np.array(found) / plugin)
        rows.append(f"| {label} | {median:,.0f} ({least:,.0f} to {most:,.0f}) | {ratio:.3g} |")
    return rows


def main() -> int:
    """Print the tables; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scene", choices=SCENES, default="rov", help="scene of the package")
    parser.add_argument("--checkpoint", help="name of a released checkpoint; the scene is then B1, swimming")
    parser.add_argument("--worlds", type=int, nargs="+", default=[1, 64, 1024], help="worlds at once")
    parser.add_argument("--steps", type=int, default=50, help="steps of a round")
    parser.add_argument("--rounds", type=int, default=5, help="times each row is timed, in turn")
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1, help="threads of mujoco.rollout")
    parser.add_argument("--device", help="of Warp; its own choice by default: a GPU where there is one")
    args = parser.parse_args()
    wp.config.quiet = True
    for worlds in args.worlds:
        print("\n".join([*table(args, worlds), ""]), flush=True)
    return 0
