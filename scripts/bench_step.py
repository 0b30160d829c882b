"""Microseconds a step of B1: bare, in MuJoCo's own fluid, and in the plugin's water.

  .venv/bin/python scripts/bench_step.py [--checkpoint models/b1-task2] [--library target/release/libhydro_plugin.so]

Needs `mujoco` and `numpy`, the library built by `cargo build --release`, and a checkpoint. All scenes are
stepped in turn, block by block, so that a busy machine slows them alike; medians of the blocks are printed,
and ratios to the bare step. A network evaluation is what the steps that reach a sample cost beyond the others.
"""

import argparse
import pathlib
import time

import mujoco
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent


def arguments():
  parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
  parser.add_argument('--checkpoint', default='models/b1-task2', help='folder of the checkpoint')
  parser.add_argument('--library', default=str(ROOT / 'target/release/libhydro_plugin.so'))
  parser.add_argument('--blocks', type=int, default=60, help='blocks a scene')
  parser.add_argument('--samples', type=int, default=40, help='sample periods a block')
  return parser.parse_args()


def scenes(checkpoint):
  swim = (ROOT / 'mjcf/b1_swim.xml').read_text()
  key = '<config key="checkpoint" value="models/b1-task2"/>'
  if key not in swim:
    raise SystemExit(f'mjcf/b1_swim.xml has no {key}')
  bare = mujoco.MjSpec.from_file(str(ROOT / 'mjcf/b1.xml')).compile()
  made = {'bare': bare, "MuJoCo's ellipsoid fluid": mujoco.MjModel.from_xml_path(str(ROOT / 'mjcf/b1_truth_default.xml'))}
  for engine in ('fused', 'candle'):
    config = f'<config key="checkpoint" value="{checkpoint}"/><config key="engine" value="{engine}"/>'
    made[f'hydro.wrench, {engine}'] = mujoco.MjModel.from_xml_string(swim.replace(key, config))
  for model in made.values():
    model.opt.timestep, model.opt.integrator = 0.002, mujoco.mjtIntegrator.mjINT_EULER
    model.opt.gravity[:] = 0  # bare B1 would fall; nothing touches in any scene
  return made


def main():
  options = arguments()
  mujoco.mj_loadPluginLibrary(str(pathlib.Path(options.library).resolve()))
  checkpoint = ROOT / options.checkpoint if not pathlib.Path(options.checkpoint).is_absolute() else options.checkpoint
  models = scenes(checkpoint)
  runs = {name: mujoco.MjData(model) for name, model in models.items()}
  whole = {name: [] for name in models}
  at_sample, between = ({name: [] for name in models} for _ in range(2))
  clock = time.perf_counter_ns
  for block in range(options.blocks + 2):
    for name, model in models.items():
      data = runs[name]
      mujoco.mj_resetData(model, data)
      data.qvel[:] = 0.2 * np.random.default_rng(block).standard_normal(model.nv)
      mujoco.mj_step(model, data, nstep=5)
      begin = clock()
      mujoco.mj_step(model, data, nstep=5 * options.samples)
      took = (clock() - begin) / (5 * options.samples)
      # One step in five reaches a sample and evaluates the network.
      quick, slow = [], []
      for step in range(5 * options.samples):
        begin = clock()
        mujoco.mj_step(model, data)
        (slow if step % 5 == 4 else quick).append(clock() - begin)
      if block >= 2:  # the first blocks warm up
        whole[name].append(took / 1000)
        at_sample[name].append(np.median(slow) / 1000)
        between[name].append(np.median(quick) / 1000)
  base = np.median(whole['bare'])
  print(f'MuJoCo {mujoco.__version__}, B1, 2 ms Euler; medians of {options.blocks} blocks of {5 * options.samples} steps')
  print(f'{"scene":30} {"us a step":>10} {"to bare":>8}   {"us an evaluation":>16}')
  for name in models:
    each = np.median(whole[name])
    evaluation = np.median(at_sample[name]) - np.median(between[name])
    shown = f'{evaluation:16.1f}' if 'hydro' in name else ' ' * 16
    print(f'{name:30} {each:10.2f} {each / base:8.2f}   {shown}')
  fluid = np.median(whole["MuJoCo's ellipsoid fluid"])
  for name in models:
    if 'hydro' in name:
      print(f"{name}: {np.median(whole[name]) / fluid:.2f} of MuJoCo's own fluid")


if __name__ == '__main__':
  main()
