"""Recorded rollouts: replayed in MuJoCo alone they give themselves."""

import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import mujoco
import numpy as np

from hydro_mujoco.recording import features
from hydro_tools.datasets import DataError, rollouts, scene
from hydro_tools.repository import ROOT, SCRIPTS

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
