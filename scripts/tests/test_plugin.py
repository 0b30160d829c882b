"""The plugin library in the MuJoCo wheel.

Needs HYDRO_TEST_LIBRARY (libhydro_plugin.so) and HYDRO_TEST_CHECKPOINTS (a folder with the test checkpoints
lively, memoryless, constant, towing and b1); `cargo test --test plugin_python` sets both and runs this file.
"""

import copy
import os
import pathlib
import pickle
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import mujoco
import mujoco.rollout
import numpy as np
from mujoco import batch

if 'HYDRO_TEST_LIBRARY' not in os.environ:
  raise unittest.SkipTest('run by cargo test --test plugin_python, which makes the checkpoints')
LIBRARY = os.environ['HYDRO_TEST_LIBRARY']
CHECKPOINTS = pathlib.Path(os.environ['HYDRO_TEST_CHECKPOINTS'])
MJCF = pathlib.Path(__file__).resolve().parents[2] / 'mjcf'
DEBIAN = pathlib.Path('/usr/lib/x86_64-linux-gnu/libmujoco.so.2.2.2')

mujoco.mj_loadPluginLibrary(LIBRARY)

FISH = """
<mujoco>
  <option timestep="{timestep}" gravity="0 0 0" integrator="{integrator}" {option}/>
  <size memory="4M"/>
  <extension>
    <plugin plugin="hydro.wrench"><instance name="water">{config}</instance></plugin>
  </extension>
  <worldbody>
    <body name="hull">{joint}
      <plugin plugin="hydro.wrench" instance="water"/>
      <geom type="ellipsoid" size="0.3 0.1 0.12" mass="12"/>
      <body name="fin" pos="-0.3 0 0">
        <joint name="{fin}" axis="0 0 1" damping="0.1"/>
        <geom type="capsule" size="0.02" fromto="0 0 0 -0.2 0 0" mass="1"/>
        {more}
      </body>
    </body>
    {bodies}
  </worldbody>
  <actuator><motor name="fin" joint="{fin}"/></actuator>
  <sensor><plugin name="water" plugin="hydro.wrench" instance="water"/></sensor>
</mujoco>
"""


def fish_xml(attributes=None, **parts):
  attributes = {'checkpoint': str(CHECKPOINTS / 'lively'), **(attributes or {})}
  config = ''.join(f'<config key="{k}" value="{v}"/>' for k, v in attributes.items() if v is not None)
  defaults = dict(timestep=0.002, integrator='Euler', option='', joint='<freejoint/>', fin='fin', more='', bodies='')
  return FISH.format(config=config, **{**defaults, **parts})


def fish(attributes=None, **parts):
  return mujoco.MjModel.from_xml_string(fish_xml(attributes, **parts))


def start(model, seed=0):
  """A simulation in a random state of motion, with a control."""
  data = mujoco.MjData(model)
  random = np.random.default_rng(seed)
  data.qvel[:] = 0.3 * random.standard_normal(model.nv)
  quaternion = random.standard_normal(4)
  data.qpos[3:7] = quaternion / np.linalg.norm(quaternion)
  data.ctrl[:] = 0.2
  return data


def state_of(model, data):
  kind = mujoco.mjtState.mjSTATE_INTEGRATION
  state = np.empty(mujoco.mj_stateSize(model, kind))
  mujoco.mj_getState(model, data, state, kind)
  return state


def steps(model, data, count):
  """Steps, and returns everything that must repeat bit for bit."""
  rows = []
  for _ in range(count):
    mujoco.mj_step(model, data)
    rows.append(np.concatenate([data.qpos, data.qvel, data.sensordata, data.plugin_state]))
  return np.array(rows)


class Warnings:
  """Collects MuJoCo's warnings."""

  def __enter__(self):
    self.texts = []
    mujoco.set_mju_user_warning(self.texts.append)
    return self.texts

  def __exit__(self, *_):
    mujoco.set_mju_user_warning(None)


class Loading(unittest.TestCase):

  def test_four_lines(self):
    code = f"""
import mujoco
mujoco.mj_loadPluginLibrary({LIBRARY!r})
model = mujoco.MjModel.from_xml_string({fish_xml()!r}); data = mujoco.MjData(model)
mujoco.mj_step(model, data)
print(*data.sensor('water').data)
"""
    out = subprocess.run([sys.executable, '-c', code], check=True, capture_output=True, text=True).stdout
    wrench = np.array(out.split(), float)
    self.assertEqual(wrench.shape, (6,))
    self.assertGreater(np.abs(wrench).max(), 0.1)

  def test_plugin_folder_needs_an_mjcf_alone(self):
    package = pathlib.Path(mujoco.__file__).parent
    with tempfile.TemporaryDirectory() as folder:
      overlay = pathlib.Path(folder) / 'mujoco'
      overlay.mkdir()
      for entry in package.iterdir():
        if entry.name != 'plugin':
          (overlay / entry.name).symlink_to(entry)
      shutil.copytree(package / 'plugin', overlay / 'plugin')
      shutil.copy(LIBRARY, overlay / 'plugin' / 'libhydro_plugin.so')
      # Nothing but `import mujoco` and a model.
      code = (
          'import mujoco; m = mujoco.MjModel.from_xml_string('
          f'{fish_xml()!r}); d = mujoco.MjData(m); mujoco.mj_step(m, d); print(mujoco.__file__, *d.sensordata)'
      )
      out = subprocess.run(
          [sys.executable, '-c', code],
          check=True,
          capture_output=True,
          text=True,
          env={**os.environ, 'PYTHONPATH': folder},
      ).stdout.split()
      self.assertTrue(out[0].startswith(folder))
      self.assertGreater(np.abs(np.array(out[1:], float)).max(), 0.1)

  def test_a_second_copy_of_the_library_does_no_harm(self):
    with tempfile.TemporaryDirectory() as folder:
      other = pathlib.Path(folder) / 'libhydro_plugin.so'
      shutil.copy(LIBRARY, other)
      mujoco.mj_loadPluginLibrary(str(other))
      self.assertTrue(np.isfinite(steps(fish(), start(fish()), 5)).all())

  def test_no_symbol_is_left_to_the_linker(self):
    undefined = subprocess.run(['nm', '-D', '--undefined-only', LIBRARY], check=True, capture_output=True, text=True)
    names = [line.split()[-1] for line in undefined.stdout.splitlines()]
    self.assertGreater(len(names), 10)
    self.assertEqual([name for name in names if name.startswith('mj')], [])
    dynamic = subprocess.run(['readelf', '-d', LIBRARY], check=True, capture_output=True, text=True).stdout
    self.assertNotIn('mujoco', dynamic)
    defined = subprocess.run(['nm', '-D', '--defined-only', LIBRARY], check=True, capture_output=True, text=True).stdout
    self.assertIn(' hydro_plugin_load', defined)

  @unittest.skipUnless(DEBIAN.exists(), "Debian's libmujoco is not installed")
  def test_another_version_is_declined_with_both_named(self):
    code = f"""
import ctypes
ctypes.CDLL({str(DEBIAN)!r}, mode=ctypes.RTLD_GLOBAL)
ctypes.CDLL({LIBRARY!r})
print('alive')
"""
    done = subprocess.run([sys.executable, '-c', code], check=True, capture_output=True, text=True)
    self.assertIn('alive', done.stdout)
    text = done.stdout + done.stderr
    self.assertIn(f'for MuJoCo {mujoco.__version__}', text)
    self.assertIn('running MuJoCo is 2.2.2', text)
    self.assertEqual(text.count('nothing is registered'), 1)

  @unittest.skipUnless(os.environ.get('HYDRO_TEST_OTHER_WHEEL'), 'HYDRO_TEST_OTHER_WHEEL names no other wheel')
  def test_a_wheel_of_another_version_declines(self):
    code = f"""
import mujoco
mujoco.mj_loadPluginLibrary({LIBRARY!r})
try:
  mujoco.MjModel.from_xml_string({fish_xml()!r})
except ValueError as fault:
  print(mujoco.__version__, 'refused', fault)
"""
    environment = {**os.environ, 'PYTHONPATH': os.environ['HYDRO_TEST_OTHER_WHEEL']}
    done = subprocess.run([sys.executable, '-c', code], check=True, capture_output=True, text=True, env=environment)
    self.assertNotIn(mujoco.__version__ + ' refused', done.stdout)
    self.assertIn('refused', done.stdout)
    self.assertIn(f'this build of hydro is for MuJoCo {mujoco.__version__}', done.stdout + done.stderr)


class Memory(unittest.TestCase):

  def test_a_copy_goes_on_bit_for_bit(self):
    model = fish()
    data = start(model)
    steps(model, data, 37)
    twin = copy.copy(data)
    other = mujoco.MjData(model)
    mujoco.mj_copyData(other, model, data)
    expected = steps(model, data, 60)
    np.testing.assert_array_equal(steps(model, twin, 60), expected)
    np.testing.assert_array_equal(steps(model, other, 60), expected)

  def test_a_saved_state_goes_on_bit_for_bit(self):
    for integrator in ('Euler', 'implicitfast', 'RK4'):
      model = fish(integrator=integrator)
      data = start(model)
      steps(model, data, 38)
      saved = state_of(model, data)
      expected = steps(model, data, 60)
      other = mujoco.MjData(model)
      for target in (data, other):
        mujoco.mj_setState(model, target, saved, mujoco.mjtState.mjSTATE_INTEGRATION)
        np.testing.assert_array_equal(steps(model, target, 60), expected)

  def test_rollouts_repeat_at_any_thread_count(self):
    for integrator in ('Euler', 'RK4'):
      model = fish(integrator=integrator)
      starts = [start(model, seed) for seed in range(6)]
      for index, data in enumerate(starts):
        steps(model, data, 3 * index)  # the first is cold, the others are warm
      kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
      initial = np.empty((6, mujoco.mj_stateSize(model, kind)))
      for row, data in zip(initial, starts):
        mujoco.mj_getState(model, data, row, kind)
      control = 0.3 * np.sin(np.arange(6 * 80).reshape(6, 80, 1))
      results = []
      for threads in (1, 2):
        each = [mujoco.MjData(model) for _ in range(threads)]
        with mujoco.rollout.Rollout(nthread=threads if threads > 1 else 0) as rollout:
          results.append(rollout.rollout(model, each if threads > 1 else each[0], initial, control))
      for one, two in zip(*results):
        np.testing.assert_array_equal(one, two)
      # And against a plain loop.
      for row, data, controls in zip(results[0][0], starts, control):
        data.qacc_warmstart[:] = 0
        for k, value in enumerate(controls):
          data.ctrl[:] = value
          mujoco.mj_step(model, data)
          state = np.empty(mujoco.mj_stateSize(model, kind))
          mujoco.mj_getState(model, data, state, kind)
          np.testing.assert_array_equal(row[k], state)

  def test_batches_repeat_at_any_thread_count(self):
    for integrator in ('Euler', 'implicitfast', 'RK4'):
      model = fish(integrator=integrator)
      ends = []
      for threads in (1, 2):
        many = batch.Batch(model, nsim=8, nthread=threads)
        qvel, ctrl, sensors = many.bind('qvel'), many.bind('ctrl'), many.bind('sensordata')
        qvel[:] = 0.3 * np.random.default_rng(1).standard_normal(qvel.shape)
        for k in range(60):
          ctrl[:] = 0.2 * np.sin(0.1 * k + np.arange(8))[:, None]
          many.step()
        ends.append(np.concatenate([many.state, sensors], axis=1).copy())
      np.testing.assert_array_equal(*ends)
      # And against one mjData, stepped alone.
      data = mujoco.MjData(model)
      data.qvel[:] = 0.3 * np.random.default_rng(1).standard_normal((8, model.nv))[5]
      for k in range(60):
        data.ctrl[:] = 0.2 * np.sin(0.1 * k + 5)
        mujoco.mj_step(model, data)
      np.testing.assert_array_equal(ends[0][5][: model.nq + 1], state_of(model, data)[: model.nq + 1])

  def test_nothing_but_a_step_changes_memory(self):
    for count in (0, 7):
      model = fish()
      data = start(model)
      steps(model, data, count)
      before = data.plugin_state.copy()
      mujoco.mj_forward(model, data)
      mujoco.mj_inverse(model, data)
      width = 2 * model.nv + model.na
      mujoco.mjd_transitionFD(model, data, 1e-6, True, np.zeros((width, width)), np.zeros((width, model.nu)), None, None)
      np.testing.assert_array_equal(data.plugin_state, before)

  def test_evaluations_between_steps_do_not_matter(self):
    for integrator in ('Euler', 'RK4'):
      model = fish(integrator=integrator)
      plain, busy = start(model), start(model)
      for _ in range(30):
        mujoco.mj_step(model, plain)
        mujoco.mj_forward(model, busy)
        mujoco.mj_inverse(model, busy)
        mujoco.mj_step(model, busy)
      np.testing.assert_allclose(busy.plugin_state, plain.plugin_state, rtol=1e-9, atol=1e-9)

  def test_a_reset_is_a_fresh_start(self):
    model = fish()
    data = start(model)
    expected = steps(model, data, 40)
    mujoco.mj_resetData(model, data)
    again = start(model)
    data.qpos[:], data.qvel[:], data.ctrl[:] = again.qpos, again.qvel, again.ctrl
    np.testing.assert_array_equal(steps(model, data, 40), expected)

  def test_a_clock_moved_by_hand_is_a_fresh_start(self):
    model = fish()
    data = start(model)
    expected = steps(model, data, 40)
    again = start(model)
    data.time = 0
    data.qpos[:], data.qvel[:], data.qacc_warmstart[:] = again.qpos, again.qvel, 0
    got = steps(model, data, 40)
    np.testing.assert_array_equal(got[-1], expected[-1])

  def test_pickles_live_and_die_on_their_own(self):
    model = fish()
    data = start(model)
    steps(model, data, 23)
    blob = pickle.dumps((model, data))
    code = f"""
import pickle, sys, mujoco
mujoco.mj_loadPluginLibrary({LIBRARY!r})
model, data = pickle.loads(sys.stdin.buffer.read())
for _ in range(50): mujoco.mj_step(model, data)
sys.stdout.buffer.write(data.qpos.tobytes() + data.plugin_state.tobytes())
"""
    out = subprocess.run([sys.executable, '-c', code], input=blob, check=True, capture_output=True).stdout
    twin_model, twin = pickle.loads(blob)
    steps(model, data, 50)
    steps(twin_model, twin, 50)
    self.assertEqual(out, data.qpos.tobytes() + data.plugin_state.tobytes())
    self.assertEqual(twin.qpos.tobytes(), data.qpos.tobytes())
    # Freed in any order, any number of times.
    for _ in range(20):
      m, d = pickle.loads(blob)
      del m, d
    del twin, twin_model
    self.assertTrue(np.isfinite(steps(model, data, 5)).all())

  def test_memory_does_not_grow(self):
    model = fish()
    data = start(model)

    def resident():
      return int(re.search(r'VmRSS:\s+(\d+)', pathlib.Path('/proc/self/status').read_text())[1])

    def work():
      for _ in range(50_000):
        mujoco.mj_step(model, data)
      for _ in range(500):
        mujoco.MjData(model)
      for density in range(200):
        fish({'density': 900 + density})

    work()
    before = resident()
    work()
    self.assertLess(resident() - before, 8_000, 'KiB')

  def test_stepping_starts_no_thread_and_survives_a_fork(self):
    code = f"""
import os, threading, mujoco
mujoco.mj_loadPluginLibrary({LIBRARY!r})
tasks = lambda: len(os.listdir('/proc/self/task'))
before = tasks()
model = mujoco.MjModel.from_xml_string({fish_xml()!r}); data = mujoco.MjData(model)
for _ in range(100): mujoco.mj_step(model, data)
assert tasks() == before, (tasks(), before)
child = os.fork()
if child == 0:
  for _ in range(100): mujoco.mj_step(model, data)
  fresh = mujoco.MjData(model); mujoco.mj_step(model, fresh)
  os._exit(0 if data.qpos[0] == data.qpos[0] else 1)
assert os.waitpid(child, 0)[1] == 0
"""
    subprocess.run([sys.executable, '-c', code], check=True)


class Force(unittest.TestCase):

  BALL = """
<mujoco>
  <option timestep="0.002" gravity="0 0 0" integrator="{integrator}"/>
  {extension}
  <worldbody><body name="ball">{carried}<freejoint/><geom size="0.1" mass="2"/></body></worldbody>
</mujoco>
"""
  CONSTANT = np.array([3.0, -2.0, 4.0, 0.0, 0.0, 0.0])

  def test_every_integrator_applies_it_once(self):
    extension = (
        '<extension><plugin plugin="hydro.wrench"><instance name="w"><config key="checkpoint" value="'
        f'{CHECKPOINTS / "constant"}"/></instance></plugin></extension>'
    )
    for integrator in ('Euler', 'implicitfast', 'implicit', 'RK4'):
      parts = dict(integrator=integrator, extension=extension, carried='<plugin plugin="hydro.wrench" instance="w"/>')
      driven = mujoco.MjModel.from_xml_string(self.BALL.format(**parts))
      plain = mujoco.MjModel.from_xml_string(self.BALL.format(integrator=integrator, extension='', carried=''))
      one, two = mujoco.MjData(driven), mujoco.MjData(plain)
      two.qfrc_applied[:] = self.CONSTANT
      for _ in range(100):
        mujoco.mj_step(driven, one)
        mujoco.mj_step(plain, two)
      np.testing.assert_allclose(one.qvel, two.qvel, rtol=1e-9, atol=1e-9)
      np.testing.assert_allclose(one.qpos, two.qpos, rtol=1e-9, atol=1e-9)
      # Twice, or not at all, would be far off.
      np.testing.assert_allclose(one.qvel[:3], self.CONSTANT[:3] / 2 * 0.2, rtol=1e-6)

  def test_a_varying_wrench_is_that_of_qfrc_applied(self):
    for integrator in ('Euler', 'implicitfast'):
      model = fish(integrator=integrator)
      data, twin = start(model), start(fish(integrator=integrator, option=''))
      plain = fish(integrator=integrator)
      plain.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SPRING | mujoco.mjtDisableBit.mjDSBL_DAMPER
      model.dof_damping[:] = plain.dof_damping[:] = 0
      for _ in range(60):
        mujoco.mj_forward(model, data)
        wrench = data.sensordata.copy()
        world_from_base = data.body('hull').xmat.reshape(3, 3)
        twin.qfrc_applied[:] = 0
        twin.qfrc_applied[:3] = world_from_base @ wrench[:3]
        twin.qfrc_applied[3:6] = wrench[3:]
        mujoco.mj_step(model, data)
        mujoco.mj_step(plain, twin)
      np.testing.assert_allclose(data.qpos, twin.qpos, rtol=0, atol=1e-11)
      self.assertGreater(np.ptp(wrench), 0.1)

  def test_the_passive_force_is_the_sensor(self):
    model = fish()
    model.dof_damping[:] = 0
    data = start(model)
    for _ in range(33):
      mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    world_from_base = data.body('hull').xmat.reshape(3, 3)
    np.testing.assert_allclose(data.qfrc_passive[:3], world_from_base @ data.sensordata[:3], rtol=0, atol=1e-12)
    np.testing.assert_allclose(data.qfrc_passive[3:6], data.sensordata[3:], rtol=0, atol=1e-12)
    self.assertEqual(data.qfrc_passive[6], 0)

  def test_neither_capability_feeds_the_other(self):
    reference = steps(fish(), start(fish()), 30)
    silent = fish()
    silent.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SENSOR
    data = start(silent)
    steps(silent, data, 30)
    np.testing.assert_array_equal(data.qpos, reference[-1][: silent.nq])
    off = fish()
    off.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SPRING | mujoco.mjtDisableBit.mjDSBL_DAMPER
    data = start(off)
    steps(off, data, 30)
    self.assertEqual(np.abs(data.qfrc_passive).max(), 0)
    self.assertGreater(np.abs(data.sensordata).max(), 0.1)

  def test_runge_kutta_samples_the_same_motion(self):
    """For a motion that no force changes, the samples are those of Euler."""
    results = {}
    for integrator in ('Euler', 'RK4', 'implicitfast'):
      model = fish(integrator=integrator)
      model.body_mass[:] *= 1e9
      model.body_inertia[:] *= 1e9
      model.dof_damping[:] = 0
      mujoco.mj_setConst(model, mujoco.MjData(model))
      model.opt.gravity[:] = [1, 0.5, -2]
      data = mujoco.MjData(model)
      data.qvel[:3] = [0.3, -0.2, 0.1]
      rows = []
      for _ in range(50):
        mujoco.mj_step(model, data)
        rows.append(data.plugin_state[4:16].copy())
      results[integrator] = np.array(rows)
    for integrator in ('RK4', 'implicitfast'):
      np.testing.assert_allclose(results[integrator], results['Euler'], rtol=0, atol=1e-5)
    self.assertGreater(np.abs(results['Euler'][0] - results['Euler'][-1]).max(), 1e-3)

  def test_any_step_that_divides_the_period_gives_the_same_samples(self):
    samples = {}
    for timestep in (0.001, 0.002, 0.005, 0.01):
      model = fish(timestep=timestep)
      model.body_mass[:] *= 1e9
      model.body_inertia[:] *= 1e9
      model.dof_damping[:] = 0
      mujoco.mj_setConst(model, mujoco.MjData(model))
      model.opt.gravity[:] = [1, 0.5, -2]  # a velocity that is the same at every step's end
      data = mujoco.MjData(model)
      data.qvel[:3] = [0.3, -0.2, 0.1]
      with Warnings() as texts:
        rows = []
        for k in range(round(0.3 / timestep)):
          mujoco.mj_step(model, data)
          if (k + 1) % round(0.01 / timestep) == 0:
            rows.append(data.plugin_state[4:16].copy())
      self.assertEqual(texts, [])
      samples[timestep] = np.array(rows)
    scale = np.sqrt(np.mean(samples[0.002] ** 2, axis=0))
    self.assertGreater(np.ptp(samples[0.002], axis=0).max(), 0.1)
    for timestep, rows in samples.items():
      self.assertLess((np.abs(rows - samples[0.002]) / scale).max(), 1e-6, timestep)

  def test_a_step_that_does_not_divide_interpolates_and_says_so_once(self):
    model = fish(timestep=0.003)
    data = start(model)
    with Warnings() as texts:
      steps(model, data, 100)
      other = start(model)
      steps(model, other, 100)
    self.assertEqual(len(texts), 2)  # each start's
    for text in texts:
      self.assertIn('0.003 s does not divide', text)
    self.assertAlmostEqual(data.plugin_state[1], 31)
    self.assertAlmostEqual(data.plugin_state[2], 0.3)

  def test_initial_force_and_the_current(self):
    given = '1 2 3 0.4 0.5 0.6'
    model = fish({'initial_force': given})
    data = start(model)
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.sensordata, [1, 2, 3, 0.4, 0.5, 0.6])
    drifting, still = fish({'current': '0.4 0 0'}), fish()
    one, two = mujoco.MjData(drifting), mujoco.MjData(still)
    one.qvel[:3] = [0.4, 0, 0]
    mujoco.mj_forward(drifting, one)
    mujoco.mj_forward(still, two)
    np.testing.assert_allclose(one.sensordata, two.sensordata, rtol=0, atol=1e-6)

  def test_the_waterline_fades_the_force_out(self):
    model = fish({'waterline': 0})
    readings = []
    for height in (-1.0, 0.0, 1.0):
      data = mujoco.MjData(model)
      data.qpos[2] = height
      mujoco.mj_forward(model, data)
      readings.append(data.sensordata.copy())
    np.testing.assert_allclose(readings[1], 0.5 * readings[0], rtol=1e-6)
    np.testing.assert_array_equal(readings[2], 0)

  def test_engines_and_solvers_agree(self):

    def end(**attributes):
      model = fish(attributes)
      data = start(model)
      steps(model, data, 100)
      return data.plugin_state[4:16].copy()

    ends = {solver: end(engine='fused', solver=solver) for solver in ('euler', 'rk4')}
    for solver, expected in ends.items():
      np.testing.assert_allclose(end(engine='candle', solver=solver), expected, rtol=1e-4, atol=1e-4)
    self.assertGreater(np.abs(ends['euler'] - ends['rk4']).max(), 1e-3)
    np.testing.assert_array_equal(end(), ends['euler'])  # the card's

  def test_a_memoryless_checkpoint_holds_its_force(self):
    model = fish({'checkpoint': str(CHECKPOINTS / 'memoryless')})
    data = start(model)
    for _ in range(23):
      mujoco.mj_step(model, data)
    np.testing.assert_array_equal(data.plugin_state[4:10], data.plugin_state[10:16])

  def test_arrows_in_the_viewer(self):
    model = fish()
    data = start(model)
    steps(model, data, 5)
    scene, option = mujoco.MjvScene(model, 100), mujoco.MjvOption()

    def arrows():
      mujoco.mjv_updateScene(
          model, data, option, mujoco.MjvPerturb(), mujoco.MjvCamera(), mujoco.mjtCatBit.mjCAT_ALL, scene
      )
      return [g for g in scene.geoms[: scene.ngeom] if g.type == mujoco.mjtGeom.mjGEOM_ARROW]

    drawn = arrows()
    self.assertEqual(len(drawn), 2)
    mujoco.mj_forward(model, data)
    length = np.linalg.norm(data.sensordata[:3]) * model.vis.map.force
    drawn = arrows()
    self.assertAlmostEqual(float(drawn[0].size[2]) , length, delta=0.02 * length)
    np.testing.assert_allclose(drawn[0].pos, data.body('hull').xpos, atol=1e-6)
    option.flags[mujoco.mjtVisFlag.mjVIS_PERTOBJ] = 0
    self.assertEqual(arrows(), [])

  def test_not_a_number_gives_no_force_one_warning_and_a_reset_helps(self):
    model = fish({'density': 1001})
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    data = start(model)
    steps(model, data, 12)
    with Warnings() as texts:
      data.qvel[0] = np.nan
      for _ in range(30):
        mujoco.mj_step(model, data)
      mujoco.mj_forward(model, data)
    np.testing.assert_array_equal(data.sensordata, 0)
    self.assertEqual(len([t for t in texts if 'hydro' in t]), 1, texts)
    self.assertIn('until the simulation is reset', ''.join(texts))
    mujoco.mj_resetData(model, data)
    self.assertTrue(np.isfinite(steps(model, data, 30)).all())
    self.assertGreater(np.abs(data.sensordata).max(), 0.1)

  def test_not_a_number_gives_no_force_at_once(self):
    for name in ('lively', 'memoryless'):
      model = fish({'checkpoint': str(CHECKPOINTS / name)})
      for count in (0, 12):
        for field in ('qpos', 'qvel'):
          data = start(model)
          steps(model, data, count)
          getattr(data, field)[0] = np.nan
          mujoco.mj_forward(model, data)
          np.testing.assert_array_equal(data.sensordata, 0)

  def test_every_fault_is_told(self):
    model = fish()
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET

    def told(data):
      with Warnings() as texts:
        data.qvel[0] = np.nan
        steps(model, data, 5)
      return sum('until the simulation is reset' in text for text in texts)

    data, other = start(model), start(model)
    self.assertEqual((told(data), told(other)), (1, 1))
    mujoco.mj_resetData(model, data)
    self.assertEqual(told(data), 1)

  def test_the_engines_own_reset_works(self):
    model = fish()
    data = start(model)
    steps(model, data, 12)
    data.qpos[0] = np.nan
    with Warnings():
      mujoco.mj_step(model, data)
    self.assertTrue(np.isfinite(data.qpos).all())
    self.assertTrue(np.isfinite(steps(model, data, 30)).all())

  def test_a_density_that_was_never_trained_is_warned_of(self):
    # The card's mean is 1000, its deviation 20.
    for density, words in {
        '1079': [],
        '1081': ['`density` is 1081', '920.0 to 1080.0'],
        '0': ['`density` is 0', '920.0 to 1080.0'],
    }.items():
      with Warnings() as texts:
        mujoco.MjData(fish({'density': density}))
      self.assertEqual(len(texts), 2 if words else 0, texts)
      for text in texts:
        for word in words:
          self.assertIn(word, text)

  def test_a_density_that_changes_nothing_is_warned_of(self):
    for density, count in {'1000': 0, '1025': 1}.items():
      xml = LoadCell.TANK.format(
          wrench='<plugin plugin="hydro.wrench"><instance name="w"><config key="checkpoint" value="'
          f'{CHECKPOINTS / "towing"}"/><config key="density" value="{density}"/></instance></plugin>',
          carried='<plugin plugin="hydro.wrench" instance="w"/>',
          water='', fluid='', coefficients='', gravcomp='', include='',
      )
      model = mujoco.MjModel.from_xml_string(xml)
      with Warnings() as texts:
        mujoco.MjData(model)
      self.assertEqual(len(texts), count, texts)
      for text in texts:
        self.assertIn('no feature `density`', text)

  def test_the_engines_own_fluid_is_warned_of(self):
    for _ in range(2):  # every load
      with Warnings() as texts:
        model = fish(option='density="1000" viscosity="0.001"')
        data = mujoco.MjData(model)
      self.assertEqual(len(texts), 2, texts)  # the compiler makes a simulation as well
      for text in texts:
        self.assertIn('the water counts twice', text)
      with Warnings() as texts:
        steps(model, data, 3)
        mujoco.mj_resetData(model, data)
        mujoco.mj_copyData(data, model, data)
      self.assertEqual(texts, [])


class Robot(unittest.TestCase):
  """The B1's own models."""

  def spec(self, name, **attributes):
    spec = mujoco.MjSpec.from_file(str(MJCF / name))
    for plugin in spec.plugins:
      if plugin.plugin_name == 'hydro.wrench':
        plugin.config = {'checkpoint': str(CHECKPOINTS / 'b1'), **attributes}
    return spec

  def home(self, model):
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key('home').id)
    return data

  def hull(self, model, data):
    """Bounding radii, heights and volumes of the hull's ellipsoids."""
    hull = [g for g in range(model.ngeom) if model.geom(g).name.endswith('_hull')]
    self.assertEqual(len(hull), 17)
    return model.geom_rbound[hull], data.geom_xpos[hull, 2], 4 / 3 * np.pi * model.geom_size[hull].prod(axis=1)

  def test_the_swimming_robot_is_driven(self):
    with Warnings() as texts:
      model = self.spec('b1_swim.xml').compile()
      data = self.home(model)
      rows = steps(model, data, 200)
    self.assertEqual(texts, [])
    self.assertTrue(np.isfinite(rows).all())
    self.assertGreater(np.abs(data.sensor('water_wrench').data).max(), 0.1)
    still = self.spec('b1_swim.xml', initial_force='0 0 0 0 0 0').compile()
    other = self.home(still)
    mujoco.mj_forward(still, other)
    np.testing.assert_array_equal(other.sensor('water_wrench').data, 0)

  def test_the_waterline_weighs_the_hull_alone(self):
    swim = self.spec('b1_swim.xml', waterline='0.05', initial_force='0 0 100 0 0 0')
    truth = self.spec('b1_truth_default.xml')
    truth.option.density = truth.option.viscosity = 0
    truth.activate_plugin('hydro.wrench')
    water = truth.add_plugin(name='water', plugin_name='hydro.wrench', active=True)
    water.config = {'checkpoint': str(CHECKPOINTS / 'b1'), 'waterline': '0.05', 'initial_force': '0 0 100 0 0 0'}
    sensor = truth.add_sensor(name='water_wrench', type=mujoco.mjtSensor.mjSENS_PLUGIN)
    for user in (truth.body('trunk').plugin, sensor.plugin):
      user.plugin_name, user.name, user.active = 'hydro.wrench', 'water', True
    for spec, fluid in ((swim, False), (truth, True)):
      model = spec.compile()
      self.assertEqual(bool((model.geom_fluid[:, 0] > 0).any()), fluid)
      data = self.home(model)
      mujoco.mj_forward(model, data)
      radius, height, volume = self.hull(model, data)
      u = np.clip((0.05 - height + radius) / (2 * radius), 0, 1)
      part = (volume * u**2 * (3 - 2 * u)).sum() / volume.sum()
      self.assertTrue(0.3 < part < 0.9, part)
      np.testing.assert_allclose(data.sensor('water_wrench').data, [0, 0, 100 * part, 0, 0, 0], rtol=1e-9, atol=1e-9)

  def test_the_towed_robot_hangs_with_its_wet_weight(self):
    model = self.spec('b1_tow.xml').compile()
    data = self.home(model)
    rows = steps(model, data, 2500)  # until the legs hang still
    self.assertTrue(np.isfinite(rows).all())
    self.assertLess(np.abs(data.qvel).max(), 1e-5)
    mujoco.mj_forward(model, data)
    below = model.body_subtreemass[model.site('gantry').bodyid[0]]
    wet = 9.81 * (below - 1000 * self.hull(model, data)[2].sum())
    self.assertGreater(wet, 20)
    force = data.site('gantry').xmat.reshape(3, 3) @ data.sensor('gantry_force').data
    np.testing.assert_allclose(force[2], wet, rtol=1e-3)


class LoadCell(unittest.TestCase):

  # A trunk held on a gantry, welded below the cell, with a swinging leg.
  TANK = """
<mujoco>
  <option timestep="0.002" {fluid}/>
  <extension>
    {wrench}
    <plugin plugin="hydro.load_cell"/>
  </extension>
  <worldbody>
    <body name="carriage" pos="0 0 2"><joint name="rail" type="slide" axis="1 0 0"/>
      <joint name="cross" type="slide" axis="0 1 0"/>
      <geom size="0.1" mass="5"/>
      <body name="beam" pos="0.1 0.2 -0.5" euler="20 -10 35">
        <site name="cell" pos="0.05 0.02 0.1" euler="10 20 30"/>
        <geom type="box" size="0.05 0.04 0.3" mass="1" {coefficients}/>
        <body name="trunk" pos="0 0 -0.4" {gravcomp}>{carried}
          <geom type="ellipsoid" size="0.4 0.15 0.1" mass="20" {coefficients}/>
          <body name="leg" pos="0.3 0 0"><joint name="thigh" axis="0 1 0" damping="1"/>
            <geom type="capsule" size="0.03" fromto="0 0 0 0 0 -0.35" mass="2"/>
            <body name="shin" pos="0 0 -0.35"><joint name="calf" axis="0 1 0" damping="1"/>
              <geom type="capsule" size="0.02" fromto="0 0 0 0 0 -0.35" mass="1"/>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <sensor>
    <force name="plain force" site="cell"/><torque name="plain torque" site="cell"/>
    <plugin name="force" plugin="hydro.load_cell"><config key="site" value="cell"/>{include}</plugin>
    <plugin name="torque" plugin="hydro.load_cell"><config key="site" value="cell"/>
      <config key="quantity" value="torque"/>{include}</plugin>
    {water}
  </sensor>
</mujoco>
"""

  def tank(self, with_wrench, include='plugin', fluid='', coefficients='', gravcomp=''):
    wrench = carried = water = ''
    if with_wrench:
      wrench = (
          '<plugin plugin="hydro.wrench"><instance name="w"><config key="checkpoint" value="'
          f'{CHECKPOINTS / "towing"}"/></instance></plugin>'
      )
      carried = '<plugin plugin="hydro.wrench" instance="w"/>'
      water = '<plugin name="water" plugin="hydro.wrench" instance="w"/>'
    return mujoco.MjModel.from_xml_string(
        self.TANK.format(
            wrench=wrench,
            carried=carried,
            water=water,
            fluid=fluid,
            coefficients=coefficients,
            gravcomp=gravcomp,
            include=f'<config key="include" value="{include}"/>',
        )
    )

  def set_moving(self, data):
    data.qvel[:] = [0.4, -0.2, 0.7, -1.1]
    data.qpos[:] = [0.1, 0.2, 0.3, -0.6]

  def test_it_feels_the_plugin_as_an_applied_force(self):
    model, plain = self.tank(True), self.tank(False)
    data, twin = mujoco.MjData(model), mujoco.MjData(plain)
    self.set_moving(data)
    for _ in range(17):
      mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    wrench = data.sensor('water').data
    self.assertGreater(np.linalg.norm(wrench[:3]), 0.5)
    twin.qpos[:], twin.qvel[:] = data.qpos, data.qvel
    mujoco.mj_kinematics(plain, twin)
    rotation, position = twin.body('trunk').xmat.reshape(3, 3), twin.body('trunk').xpos
    force, torque = rotation @ wrench[:3], rotation @ wrench[3:]
    twin.xfrc_applied[plain.body('trunk').id, :3] = force
    arm = position - twin.body('trunk').xipos
    twin.xfrc_applied[plain.body('trunk').id, 3:] = torque + np.cross(arm, force)
    mujoco.mj_forward(plain, twin)
    # The gantry's slides feel the force through the chain.
    np.testing.assert_allclose(data.qacc, twin.qacc, rtol=0, atol=1e-9)
    for quantity in ('force', 'torque'):
      expected = twin.sensor(f'plain {quantity}').data
      np.testing.assert_allclose(data.sensor(quantity).data, expected, rtol=0, atol=1e-9)
      self.assertGreater(np.abs(data.sensor(f'plain {quantity}').data - expected).max(), 0.01)

  def test_a_weight_hung_on_it(self):
    """At rest, held still: the cell reads the weight below it, upwards, from child to parent."""
    model = self.tank(False)
    data = mujoco.MjData(model)

    model.dof_armature[:] = 1e12  # nothing moves
    mujoco.mj_setConst(model, data)
    mujoco.mj_forward(model, data)
    rotation = data.site('cell').xmat.reshape(3, 3)
    weight = 9.81 * (1 + 20 + 2 + 1)
    np.testing.assert_allclose(rotation @ data.sensor('force').data, [0, 0, weight], rtol=0, atol=1e-6)
    data.xfrc_applied[model.body('shin').id, 2] = -9.81 * 3  # three kilograms more
    mujoco.mj_forward(model, data)
    weight += 9.81 * 3
    np.testing.assert_allclose(rotation @ data.sensor('force').data, [0, 0, weight], rtol=0, atol=1e-6)

  def check_all(self, **parts):
    """Force by force: inverse dynamics of the rails see the same sum as the cell does."""
    model = self.tank(True, include='all', **parts)
    data = mujoco.MjData(model)
    self.set_moving(data)
    mujoco.mj_forward(model, data)
    # Momentum balance of everything below the cell, from accelerations alone.
    mujoco.mj_rnePostConstraint(model, data)
    below = [model.body(name).id for name in ('beam', 'trunk', 'leg', 'shin')]
    water = np.zeros(3)
    # Forces of joint space along the rails: passive force on the slides is that of the whole tree.
    water[:2] = data.qfrc_passive[:2]
    # The carriage above the cell is not below it.
    carriage = mujoco.MjModel.from_xml_string(
        f'<mujoco><option {parts.get("fluid", "")}/><worldbody><body><joint type="slide" axis="1 0 0"/>'
        '<joint type="slide" axis="0 1 0"/><geom size="0.1" mass="5"/></body></worldbody></mujoco>'
    )
    alone = mujoco.MjData(carriage)
    alone.qvel[:] = data.qvel[:2]
    mujoco.mj_forward(carriage, alone)
    water[:2] -= alone.qfrc_passive[:2]
    self.assertEqual(len(below), 4)
    rotation = data.site('cell').xmat.reshape(3, 3)
    missing = rotation @ (data.sensor('plain force').data - data.sensor('force').data)
    np.testing.assert_allclose(missing[:2], water[:2], rtol=0, atol=1e-9)
    return missing

  def test_all_adds_the_engines_box_fluid(self):
    with Warnings():
      missing = self.check_all(fluid='density="1000" viscosity="0.5" wind="0.1 0.3 -0.2"')
    self.assertGreater(np.abs(missing).max(), 5)

  def test_all_adds_the_engines_ellipsoid_fluid(self):
    with Warnings():
      missing = self.check_all(
          fluid='density="1000" viscosity="0.5" wind="0.1 0.3 -0.2"',
          coefficients='fluidshape="ellipsoid" fluidcoef="0.6 0.3 1.2 0.8 0.9"',
      )
    self.assertGreater(np.abs(missing).max(), 5)

  def test_all_adds_gravity_compensation(self):
    with_it, without = (self.tank(False, include=include, gravcomp='gravcomp="1"') for include in ('all', 'plugin'))
    readings = []
    for model in (with_it, without):
      data = mujoco.MjData(model)
      mujoco.mj_forward(model, data)
      readings.append(data.site('cell').xmat.reshape(3, 3) @ data.sensor('force').data)
    np.testing.assert_allclose(readings[1] - readings[0], [0, 0, 20 * 9.81], atol=1e-9)

  def test_refusals(self):
    for config, words in {
        '': ['`site` is missing', 'cell'],
        '<config key="site" value="sell"/>': ['`site` is `sell`', 'cell'],
        '<config key="site" value="cell"/><config key="quantity" value="power"/>': ['`quantity` is `power`', '`torque`'],
        '<config key="site" value="cell"/><config key="include" value="some"/>': ['`include` is `some`', '`all`'],
        '<config key="site" value="ground"/>': ['on the world'],
    }.items():
      xml = f"""<mujoco><extension><plugin plugin="hydro.load_cell"/></extension>
        <worldbody><site name="ground"/><body><joint/><geom size="0.1"/><site name="cell"/></body></worldbody>
        <sensor><plugin name="s" plugin="hydro.load_cell">{config}</plugin></sensor></mujoco>"""
      with self.assertRaises(ValueError) as refusal:
        mujoco.MjModel.from_xml_string(xml)
      for word in words:
        self.assertIn(word, str(refusal.exception))


class Refusals(unittest.TestCase):

  def refused(self, *words, xml=None, **parts):
    with self.assertRaises(ValueError) as refusal:
      mujoco.MjModel.from_xml_string(xml or fish_xml(**parts))
    for word in words:
      self.assertIn(word, str(refusal.exception))

  def damaged(self, change):
    folder = tempfile.TemporaryDirectory()
    self.addCleanup(folder.cleanup)
    copied = pathlib.Path(folder.name) / 'model'
    shutil.copytree(CHECKPOINTS / 'lively', copied)
    change(copied)
    return {'checkpoint': str(copied)}

  def test_attributes(self):
    self.refused('`checkpoint` and `effects` are missing', attributes={'checkpoint': None})
    self.refused(
        '`checkpoint` is `models/none`', os.getcwd(), 'HYDRO_PATH', attributes={'checkpoint': 'models/none'}
    )
    self.refused('`density` is `-3`', 'kg/m^3', attributes={'density': '-3'})
    self.refused('`density` is `wet`', attributes={'density': 'wet'})
    self.refused('`current` is `1 2`', 'm/s', attributes={'current': '1 2'})
    self.refused('`waterline` is `high`', attributes={'waterline': 'high'})
    self.refused('`solver` is `heun`', '`rk4`', attributes={'solver': 'heun'})
    self.refused('`engine` is `gpu`', '`candle`', attributes={'engine': 'gpu'})
    self.refused('`initial_force` is `some`', attributes={'initial_force': 'some'})
    self.refused('has 2 numbers', 'has 6 outputs', attributes={'initial_force': '1 2'})
    self.refused('lists 2 names', 'fin', attributes={'joints': 'fin tail'})
    self.refused('densty', attributes={'densty': '1000'})

  def test_joints(self):
    self.refused('card\'s joint `fin`', 'joints are: tail', fin='tail')
    mujoco.MjModel.from_xml_string(fish_xml({'joints': 'tail'}, fin='tail'))
    self.refused('`root`', 'Free joint', attributes={'joints': 'root'}, joint='<freejoint name="root"/>')

  def test_bases(self):
    self.refused('free joint on body `hull`', 'no joint lies between', joint='')
    self.refused('free joint on body `hull`', 'joint `pivot` (Ball)', joint='<joint name="pivot" type="ball"/>')

  def test_bodies(self):
    self.refused('bodies hull, other share it', bodies="""<body name="other"><freejoint/><geom size="0.1"/>
      <plugin plugin="hydro.wrench" instance="water"/></body>""")
    carried = '<plugin plugin="hydro.wrench" instance="water"/>'
    self.refused('no body carries it', xml=fish_xml().replace(carried, ''))
    two = fish_xml().replace(
        '</plugin>\n  </extension>',
        f'<instance name="more"><config key="checkpoint" value="{CHECKPOINTS / "lively"}"/></instance></plugin>\n  </extension>',
    ).replace(carried, carried + '<plugin plugin="hydro.wrench" instance="more"/>')
    self.refused('no body carries it', "takes the first one's place", xml=two)

  def test_checkpoints(self):
    def truncate(folder):
      weights = folder / 'weights.safetensors'
      weights.write_bytes(weights.read_bytes()[:-100])

    def flip(folder):
      weights = folder / 'weights.safetensors'
      content = bytearray(weights.read_bytes())
      content[-7] ^= 0x40
      weights.write_bytes(content)

    self.refused('is damaged', attributes=self.damaged(truncate))
    self.refused('is damaged', attributes=self.damaged(flip))
    self.refused('weights.safetensors is missing', attributes=self.damaged(lambda f: (f / 'weights.safetensors').unlink()))
    self.refused('card.json', attributes=self.damaged(lambda f: (f / 'card.json').write_text('{')))

  def test_a_robot_of_another_size(self):
    self.refused("card's joint `thigh`", attributes={'checkpoint': str(CHECKPOINTS / 'towing')})

  def test_a_refusal_leaves_the_process_well(self):
    for _ in range(50):
      with self.assertRaises(ValueError):
        fish({'density': '-1'})
    self.assertTrue(np.isfinite(steps(fish(), start(fish()), 10)).all())


if __name__ == '__main__':
  unittest.main(verbosity=2)
