"""The closed-loop scripts: truth replays itself, faults are told; the swim and tow scenes without their plugin."""

import json
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import mujoco
import numpy as np

from hydro_tools.datasets import DataError, replay, rollouts, scene
from hydro_tools.repository import ROOT, SCRIPTS


def script(name, *arguments):
    return subprocess.run([sys.executable, str(SCRIPTS / name), *map(str, arguments)], capture_output=True, text=True)


def without_plugins(name):
    """A scene with every mention of a plugin cut out."""
    text = (ROOT / "mjcf" / name).read_text()
    text = re.sub(r"<extension>.*?</extension>", "", text, flags=re.S)
    return mujoco.MjModel.from_xml_string(re.sub(r"<plugin [^>]*/>", "", text))


class Simulate(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.temporary.name, "runs")
        made = script("record_rollouts.py", "--out", cls.folder, "--count", 2, "--duration", 1.2, "--seed", 9)
        assert made.returncode == 0, made.stderr

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def test_truth_replays_itself(self):
        run = script("simulate.py", "--rollouts", self.folder, "--scene", scene.TRUTH, "--json")
        self.assertEqual(run.returncode, 0, run.stderr)
        for result in json.loads(run.stdout)["rollouts"]:
            self.assertEqual([e["t"] for e in result["errors"]], [1.0])
            self.assertLess(result["errors"][0]["position_m"], 1e-9)
            self.assertLess(result["errors"][0]["attitude_deg"], 1e-5)

    def test_other_water_strays(self):
        run = script("simulate.py", "--rollouts", self.folder, "--scene", "mjcf/b1_box_fluid.xml", "--json")
        worst = max(e["position_m"] for r in json.loads(run.stdout)["rollouts"] for e in r["errors"])
        self.assertGreater(worst, 0.01)

    def test_another_water_is_said(self):
        strip = Path(self.temporary.name, "strip")
        shutil.copytree(ROOT / "tests/data/rollouts-strip", strip)
        run = script("simulate.py", "--rollouts", strip, "--scene", "mjcf/b1_box_fluid.xml")
        self.assertIn("ANOTHER WATER", run.stderr)
        self.assertIn("strip (added mass in the inertia)", run.stderr)
        self.assertIn("ANOTHER WATER", script("simulate.py", "--rollouts", self.folder, "--water", "strip").stderr)
        for arguments in (
            ("--rollouts", strip, "--water", "strip"),
            ("--rollouts", self.folder, "--scene", scene.TRUTH),
        ):
            self.assertNotIn("ANOTHER WATER", script("simulate.py", *arguments).stderr)

    def test_the_water_of_a_checkpoint_is_that_of_its_card(self):
        self.assertIsNone(replay.water_of("mjcf/b1_swim.xml"))
        self.assertEqual(replay.water_of("mjcf/b1_swim.xml", Path("models/b1-strip"))["name"], "strip")
        with self.assertRaisesRegex(DataError, "card.json"):
            replay.water_of("mjcf/b1_swim.xml", Path("models/none"))

    def test_strips_replay_themselves_but_for_the_wakes_at_the_start(self):
        index, runs = rollouts.read(ROOT / "tests/data/rollouts-strip")
        for run in runs:
            states = [data.qpos.copy() for data in replay.replay_in_strips(scene.load(), run)]
            distance = np.linalg.norm(states[-1][:3] - run["qpos"][-1, :3])
            travelled = np.linalg.norm(run["qpos"][-1, :3] - run["qpos"][0, :3])
            self.assertLess(distance, 0.2 * travelled)
            self.assertGreater(distance, 0.0)

    def test_missing_plugin_is_told(self):
        run = script("simulate.py", "--rollouts", self.folder, "--plugin", "nowhere/libhydro_plugin.so")
        self.assertEqual(run.returncode, 1)
        self.assertIn("cargo build --release", run.stderr)

    def test_runs_too_short_are_told(self):
        run = script("simulate.py", "--rollouts", ROOT / "tests/data/rollouts", "--scene", scene.TRUTH)
        self.assertEqual(run.returncode, 1)
        self.assertIn("--duration", run.stderr)

    def test_missing_rollouts_are_told(self):
        run = script("simulate.py", "--rollouts", self.folder / "none", "--scene", scene.TRUTH)
        self.assertEqual(run.returncode, 1)
        self.assertIn("rollouts.json", run.stderr)


class PluginScenes(unittest.TestCase):
    def test_swim_is_the_truth_without_its_water(self):
        """With the recorded truth wrench on the base and the water's torques on the joints, swim moves as truth."""
        model, truth = without_plugins("b1_swim.xml"), scene.load().model
        np.testing.assert_allclose(model.body_mass[1:].sum() + 17e-6, truth.body_mass.sum(), rtol=1e-12)
        self.assertEqual((model.opt.density, model.opt.viscosity, model.opt.integrator), (0, 0, truth.opt.integrator))
        _, runs = rollouts.read(ROOT / "tests/data/rollouts")
        scene.set_density(truth, float(runs[0]["density"]))
        a, b = mujoco.MjData(truth), mujoco.MjData(model)
        for data in (a, b):
            data.qpos[:], data.qvel[:] = runs[0]["qpos"][0], runs[0]["qvel"][0]
        for ctrl in runs[0]["ctrl"][:20]:
            a.ctrl[:] = b.ctrl[:] = ctrl
            for _ in range(5):
                mujoco.mj_step(truth, a)
                b.qfrc_applied[:] = a.qfrc_fluid + a.qfrc_gravcomp
                mujoco.mj_step(model, b)
        np.testing.assert_allclose(b.qpos, a.qpos, atol=1e-5)

    def test_plugin_scenes_name_what_the_plugin_reads(self):
        swim = (ROOT / "mjcf/b1_swim.xml").read_text()
        self.assertIn('<plugin name="water_wrench" plugin="hydro.wrench" instance="water"/>', swim)
        self.assertEqual(replay.WRENCH_SENSOR, "water_wrench")
        tow = (ROOT / "mjcf/b1_tow.xml").read_text()
        self.assertEqual(tow.count('<config key="include" value="all"/>'), 2)

    def test_tow_settles_at_the_speed_that_is_asked(self):
        """At rest the dry cell carries the robot's weight less nothing; towed, the carriage feels the drag."""
        model = without_plugins("b1_tow.xml")
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        for _ in range(1000):
            mujoco.mj_step(model, data)
        weight = model.body("trunk").subtreemass[0] * 9.81
        np.testing.assert_allclose(np.abs(data.sensor("gantry_force_dry").data), [0, 0, weight], atol=1e-2)
        data.ctrl[0] = 0.4
        for _ in range(1500):
            mujoco.mj_step(model, data)
        speed = data.joint("gantry_x").qvel[0]
        self.assertAlmostEqual(speed, 0.4, delta=0.02)
        drag = data.qfrc_fluid[0]
        self.assertLess(drag, -5.0)
        # Steady: the servo balances the drag, which MuJoCo's own force sensor does not feel.
        self.assertAlmostEqual(data.actuator("gantry_x").force[0], -drag, delta=1.0)
        self.assertLess(abs(data.sensor("gantry_force_dry").data[0]), 1.0)


if __name__ == "__main__":
    unittest.main()
