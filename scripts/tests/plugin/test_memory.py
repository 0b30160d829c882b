"""Memory of a simulation; copies, threads and resets keep it apart."""

import copy
import pathlib
import pickle
import re
import subprocess
import sys
import unittest

import mujoco
import mujoco.rollout
import numpy as np
from mujoco import batch
from scene import KINDS, LIBRARY, fish, fish_xml, start, state_of, steps


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
        for integrator in ("Euler", "implicitfast", "RK4"):
            model = fish(integrator=integrator)
            data = start(model)
            steps(model, data, 38)
            saved = state_of(model, data)
            expected = steps(model, data, 60)
            other = mujoco.MjData(model)
            for target in (data, other):
                mujoco.mj_setState(model, target, saved, mujoco.mjtState.mjSTATE_INTEGRATION)
                np.testing.assert_array_equal(steps(model, target, 60), expected)

    def test_every_kind_of_model_goes_on_bit_for_bit(self):
        self.assertTrue(KINDS)
        for checkpoint in KINDS:
            with self.subTest(checkpoint.name):
                model = fish({"checkpoint": str(checkpoint)})
                data = start(model)
                steps(model, data, 38)
                twin, saved = copy.copy(data), state_of(model, data)
                expected = steps(model, data, 60)
                np.testing.assert_array_equal(steps(model, twin, 60), expected)
                other = start(model, seed=1)
                steps(model, other, 23)
                for target in (data, other):
                    mujoco.mj_setState(model, target, saved, mujoco.mjtState.mjSTATE_INTEGRATION)
                    np.testing.assert_array_equal(steps(model, target, 60), expected)

    def test_rollouts_repeat_at_any_thread_count(self):
        for integrator in ("Euler", "RK4"):
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
        for integrator in ("Euler", "implicitfast", "RK4"):
            model = fish(integrator=integrator)
            ends = []
            for threads in (1, 2):
                many = batch.Batch(model, nsim=8, nthread=threads)
                qvel, ctrl, sensors = many.bind("qvel"), many.bind("ctrl"), many.bind("sensordata")
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
            mujoco.mjd_transitionFD(
                model, data, 1e-6, True, np.zeros((width, width)), np.zeros((width, model.nu)), None, None
            )
            np.testing.assert_array_equal(data.plugin_state, before)

    def test_evaluations_between_steps_do_not_matter(self):
        for integrator in ("Euler", "RK4"):
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
        out = subprocess.run([sys.executable, "-c", code], input=blob, check=True, capture_output=True).stdout
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
            return int(re.search(r"VmRSS:\s+(\d+)", pathlib.Path("/proc/self/status").read_text())[1])

        def work():
            for _ in range(50_000):
                mujoco.mj_step(model, data)
            for _ in range(500):
                mujoco.MjData(model)
            for density in range(200):
                fish({"density": 900 + density})

        work()
        before = resident()
        work()
        self.assertLess(resident() - before, 8_000, "KiB")

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
        subprocess.run([sys.executable, "-c", code], check=True)


if __name__ == "__main__":
    unittest.main(verbosity=2)
