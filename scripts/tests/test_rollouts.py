"""Recorded rollouts: replayed in MuJoCo alone they give themselves."""

import subprocess
import sys
import tempfile
import unittest
from dataclasses import replace
from pathlib import Path
from unittest import mock

import mujoco
import numpy as np

from hydro_mujoco.recording import features
from hydro_mujoco.recording import plan as recording_plan
from hydro_tools.datasets import DataError, plan, rollouts, scene, waters
from hydro_tools.repository import ROOT, SCRIPTS
from hydro_tools.strip_water import forces, simulation, strips, wake

RECORDED = ROOT / "tests/data/rollouts"


class Recorded(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.index, cls.runs = rollouts.read(RECORDED)

    def test_belong_to_the_present_scene(self):
        self.assertEqual(self.index["model_sha256"], scene.load().sha256, "record tests/data/rollouts again")
        self.assertEqual(self.index["features"], scene.load().layout.names())

    def test_shapes(self):
        for run in self.runs:
            n = len(run["ctrl"])
            shapes = {name: array.shape for name, array in run.items()}
            self.assertEqual(
                shapes,
                {
                    "time": (n + 1,),
                    "qpos": (n + 1, 19),
                    "qvel": (n + 1, 18),
                    "ctrl": (n, 12),
                    "push": (n, 6),
                    "x": (n + 1, 35),
                    "wrench_clean": (n + 1, 6),
                    "hydrostatic": (n + 1, 6),
                    "density": (),
                },
            )

    def test_plain_mujoco_repeats_them(self):
        for run in self.runs:
            model = mujoco.MjModel.from_xml_path(str(scene.find(self.index["model"])))
            scene.set_density(model, float(run["density"]))
            data = mujoco.MjData(model)
            data.qpos[:], data.qvel[:] = run["qpos"][0], run["qvel"][0]
            for k, (ctrl, push) in enumerate(zip(run["ctrl"], run["push"])):
                data.ctrl[:], data.xfrc_applied[1] = ctrl, push
                mujoco.mj_step(model, data, 5)
                np.testing.assert_allclose(data.qpos, run["qpos"][k + 1], rtol=0, atol=1e-9)
            mujoco.mj_forward(model, data)
            wrench = features.base_wrench(data.qpos[3:7], data.qfrc_fluid[:6] + data.qfrc_gravcomp[:6])
            np.testing.assert_allclose(wrench, run["wrench_clean"][-1], atol=1e-5)

    def test_features_are_those_of_the_state(self):
        for run in self.runs:
            density = np.full(len(run["time"]), run["density"])
            np.testing.assert_array_equal(scene.load().layout.features(run["qpos"], run["qvel"], density), run["x"])


class Strips(unittest.TestCase):
    """A run of 4 s in strip water, whose generalised force is the oracle of all joints."""

    SECONDS = 4.0

    @classmethod
    def setUpClass(cls):
        cls.scene = scene.load()
        # A warm-up of 8 s would be most of this test.
        with mock.patch.object(recording_plan, "WARM_UP", 0.3):
            cls.run_ = rollouts.record(
                cls.scene,
                5,
                0,
                duration=cls.SECONDS,
                density_range=plan.DENSITY_RANGE,
                water=replace(waters.STRIP, added_mass=waters.IN_INERTIA),
            )

    def driven(self, force):
        """Positions [N+1,19] of plain MuJoCo without water, given `force(data, k, step)` in every physics step."""
        model = simulation.dry(self.scene.model)
        data = mujoco.MjData(model)
        data.qpos[:], data.qvel[:] = self.run_["qpos"][0], self.run_["qvel"][0]
        out = [data.qpos.copy()]
        for k, (ctrl, push) in enumerate(zip(self.run_["ctrl"], self.run_["push"])):
            data.ctrl[:], data.xfrc_applied[1] = ctrl, push
            for step in range(self.scene.system.substeps):
                data.qfrc_applied[:] = force(data, k, step)
                mujoco.mj_step(model, data)
            out.append(data.qpos.copy())
        return np.array(out)

    def test_arrays(self):
        n = round(self.SECONDS / scene.SAMPLE_PERIOD)
        shapes = {name: self.run_[name].shape for name in rollouts.STRIPS_ALONE}
        self.assertEqual(shapes, {"generalised": (n + 1, 18), "gyroscopic": (n + 1, 6), "step_force": (n, 90)})
        wrench = features.base_wrench(self.run_["qpos"][:, 3:7], self.run_["generalised"][:, :6])
        np.testing.assert_allclose(wrench, self.run_["wrench_clean"], atol=1e-9)
        self.assertGreater(np.abs(self.run_["gyroscopic"]).max(), 0.1)

    def test_the_recorded_force_on_all_joints_gives_the_motion_back(self):
        steps = self.run_["step_force"].reshape(len(self.run_["ctrl"]), -1, 18)
        found = self.driven(lambda data, k, step: steps[k, step])
        moved = np.linalg.norm(self.run_["qpos"][-1, :3] - self.run_["qpos"][0, :3])
        self.assertGreater(moved, 0.05)
        np.testing.assert_allclose(found, self.run_["qpos"], atol=1e-9)
        # On the base alone it does not.
        base = self.driven(lambda data, k, step: np.concatenate((steps[k, step, :6], np.zeros(12))))
        self.assertGreater(np.linalg.norm(base[-1, :3] - self.run_["qpos"][-1, :3]), 1e-3)

    def test_the_true_force_at_its_own_state_stays_within_a_millimetre(self):
        """The oracle of all joints: its wakes follow its own motion, not the recorded one."""
        truth = forces.water(self.scene.model, strips.b1())
        shadow = simulation.Simulation(simulation.dry(self.scene.model), truth, 1)
        shadow.density[:] = self.run_["density"]
        told = []

        def force(data, k, step):
            if told:
                wakes = wake.follow(
                    truth.strips, shadow.wakes, told[0].velocity, told[0].pace, shadow.model.opt.timestep
                )
                shadow.wakes[:] = wakes
            own = shadow.datas[0]
            own.qpos[:], own.qvel[:], own.ctrl[:] = data.qpos, data.qvel, data.ctrl
            own.xfrc_applied[:] = data.xfrc_applied
            if not told:
                shadow.wakes[:] = self.first_wakes(truth)
            now = shadow.evaluate([0])
            told[:] = [now]
            return (now.drag + now.lift + now.added(shadow.accelerations([0])))[0]

        found = self.driven(force)
        distance = np.linalg.norm(found[:, :3] - self.run_["qpos"][:, :3], axis=1)
        self.assertLess(distance[-1], 1e-3)
        self.assertLess(distance.max(), 1e-3)

    def first_wakes(self, truth):
        """Wakes at the first sample, from the drag that they led to in the first physics step: found by replaying the warm-up."""
        with mock.patch.object(recording_plan, "WARM_UP", 0.3):
            drawn = plan.rollout(
                5,
                0,
                samples=len(self.run_["time"]),
                density_range=plan.DENSITY_RANGE,
                joint_range=self.scene.joint_range,
            )
        run = simulation.Simulation(simulation.dry(self.scene.model), truth, 1)
        run.density[:] = self.run_["density"]
        data = run.datas[0]
        data.qpos[:], data.qvel[:] = drawn.qpos, drawn.qvel
        run.settle([0])
        for row in range(drawn.warm_up):
            data.ctrl[:], data.xfrc_applied[1] = drawn.ctrl[row], drawn.push[row]
            for _ in range(self.scene.system.substeps):
                run.step([0])
        np.testing.assert_array_equal(data.qpos, self.run_["qpos"][0])
        return run.wakes


class Recorder(unittest.TestCase):
    def record(self, *arguments):
        return subprocess.run(
            [sys.executable, str(SCRIPTS / "record_rollouts.py"), *map(str, arguments)], capture_output=True, text=True
        )

    def test_same_seed_same_bytes_and_no_mixing(self):
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder, "a")
            arguments = ("--out", out, "--count", 2, "--duration", 0.1, "--seed", 3, "--density-range", "1000,1001")
            self.assertEqual(self.record(*arguments).returncode, 0)
            before = {path.name: path.read_bytes() for path in out.iterdir()}
            again = self.record(*arguments)
            self.assertEqual(again.returncode, 1)
            self.assertIn("--overwrite", again.stderr)
            self.assertEqual(self.record(*arguments, "--overwrite").returncode, 0)
            self.assertEqual({path.name: path.read_bytes() for path in out.iterdir()}, before)
            _, runs = rollouts.read(out)
            self.assertTrue(all(1000 <= run["density"] <= 1001 for run in runs))

    def test_bad_density_range(self):
        run = self.record("--out", "nowhere", "--density-range", "1030,990")
        self.assertEqual(run.returncode, 2)
        self.assertIn("LOW,HIGH", run.stderr)

    def test_changed_run_is_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            self.record("--out", Path(folder, "a"), "--count", 1, "--duration", 0.05)
            with open(Path(folder, "a", "rollout-000.npz"), "ab") as file:
                file.write(b"!")
            with self.assertRaisesRegex(DataError, "sha256"):
                rollouts.read(Path(folder, "a"))


if __name__ == "__main__":
    unittest.main()
