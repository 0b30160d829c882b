"""The Task 2 generator: its bytes, its resume, its refusals."""

import json
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path
from unittest import mock

import numpy as np
from paths import ROOT, SCRIPTS
from safetensors.numpy import load_file

from fanout.here import Here
from fanout.processes import Processes
from hydro_data import DataError, dataset, files, task2

SETTINGS = dataset.Settings(name="t", trials=8, seed=5, samples=60, splits=(0.5, 0.25, 0.25), shard_size=2,
                            model="mjcf/b1_truth_default.xml")


def command(*arguments):
    return [sys.executable, str(SCRIPTS / "gen_task2.py"), *map(str, arguments)]


def contents(folder):
    return {path.name: path.read_bytes() for path in Path(folder).iterdir()}


class Bytes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.pilot = mock.patch.object(task2, "PILOT", 4)
        cls.pilot.start()
        cls.temporary = tempfile.TemporaryDirectory()
        cls.reference = Path(cls.temporary.name, "reference")
        cls.manifest = dataset.generate(SETTINGS, cls.reference, executor=Here())

    @classmethod
    def tearDownClass(cls):
        cls.pilot.stop()
        cls.temporary.cleanup()

    def other(self, name):
        return Path(self.temporary.name, name)

    def test_two_workers_give_the_same_bytes(self):
        dataset.generate(SETTINGS, self.other("two"), executor=Processes(2))
        self.assertEqual(contents(self.other("two")), contents(self.reference))

    def test_shard_size_and_block_change_no_trajectory(self):
        with mock.patch.object(task2, "BLOCK", 3):
            dataset.generate(dataset.Settings(**{**SETTINGS.__dict__, "shard_size": 4}), self.other("big"), executor=Here())
        big = load_file(self.other("big") / "train-00000-of-00001.safetensors")
        for name in ("x", "wrench", "wrench_clean", "hydrostatic", "condition"):
            small = [load_file(self.reference / f"train-{i:05d}-of-00002.safetensors")[name] for i in range(2)]
            np.testing.assert_array_equal(np.concatenate(small), big[name])

    def test_resume_after_a_kill_gives_the_same_bytes(self):
        out = self.other("killed")
        made = 0

        def dies(*arguments):
            nonlocal made
            made += 1
            if made == 3:
                (out / "val-00000-of-00001.safetensors.tmp").write_bytes(b"half a sh")
                raise KeyboardInterrupt
            return original(*arguments)

        original = task2.shard_bytes
        with mock.patch.object(task2, "shard_bytes", dies), self.assertRaises(KeyboardInterrupt):
            dataset.generate(SETTINGS, out, executor=Here())
        self.assertFalse((out / "manifest.json").exists())
        first = out / "train-00000-of-00002.safetensors"
        kept = first.stat().st_mtime_ns
        second = out / "train-00001-of-00002.safetensors"
        second.write_bytes(second.read_bytes()[:-1] + b"!")
        dataset.generate(SETTINGS, out, executor=Here(), resume=True)
        self.assertEqual(first.stat().st_mtime_ns, kept, "a finished shard was made again")
        self.assertEqual(contents(out), contents(self.reference))

    def test_resume_with_other_settings_is_refused(self):
        for change, word in (({"seed": 6}, "seed was 5, now 6"), ({"trials": 9}, "--trials")):
            with self.assertRaisesRegex(DataError, word):
                dataset.generate(dataset.Settings(**{**SETTINGS.__dict__, **change}), self.reference, executor=Here(), resume=True)

    def test_tensors_are_those_of_the_schema(self):
        shard = load_file(self.reference / "test-00000-of-00001.safetensors")
        shapes = {name: (tensor.dtype.name, tensor.shape) for name, tensor in shard.items()}
        self.assertEqual(shapes, {
            "x": ("float32", (2, 60, 35)), "wrench": ("float32", (2, 60, 6)), "wrench_clean": ("float32", (2, 60, 6)),
            "hydrostatic": ("float32", (2, 60, 6)), "time": ("float32", (60,)), "condition": ("int32", (2, 60)),
        })
        np.testing.assert_allclose(shard["time"][[0, 1, 59]], [0, 0.01, 0.59])
        self.assertEqual(shard["condition"].min(), 0)
        self.assertEqual(shard["condition"].max(), 40)
        density = shard["x"][..., 34]
        np.testing.assert_array_equal(np.diff(shard["condition"], axis=1) != 0, np.diff(density, axis=1) != 0)
        self.assertTrue(((density >= 990) & (density <= 1030)).all())
        self.assertTrue((shard["x"][:, 0, 24] >= 0).all())
        self.assertEqual(len(self.manifest["features"]), 35)
        self.assertEqual([part["trajectories"] for part in self.manifest["splits"].values()], [4, 2, 2])
        for part in self.manifest["splits"].values():
            for entry in part["shards"]:
                self.assertEqual(files.sha256(self.reference / entry["file"]), entry["sha256"])

    def test_noise_is_a_tenth_of_the_deviation(self):
        noise = np.concatenate([(s := load_file(path))["wrench"] - s["wrench_clean"]
                                for path in self.reference.glob("*.safetensors")]).reshape(-1, 6)
        wanted = np.array(self.manifest["perturbation_std"])
        np.testing.assert_allclose(noise.std(0), wanted, rtol=0.15)
        self.assertTrue((np.abs(noise.mean(0)) < 0.2 * wanted).all())

    def test_splits_share_no_trajectory(self):
        starts = [load_file(path)["x"][:, 0] for path in self.reference.glob("*.safetensors")]
        self.assertEqual(len(np.unique(np.concatenate(starts), axis=0)), 8)

    def test_a_full_disk_leaves_no_half_file(self):
        with mock.patch("os.replace", side_effect=OSError(28, "No space left on device")), self.assertRaises(OSError):
            files.write_beside(self.other("full.json"), b"x")
        self.assertEqual(list(Path(self.temporary.name).glob("full*")), [])


class CommandLine(unittest.TestCase):
    def refused(self, *arguments, code):
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder, "out")
            if "FULL" in arguments:
                out.mkdir()
                (out / "notes.txt").write_text("mine")
            run = subprocess.run(command("--out", out, *(a for a in arguments if a != "FULL")), capture_output=True, text=True)
            self.assertEqual(run.returncode, code, run.stderr)
            self.assertNotIn("Traceback", run.stderr)
            if out.exists():
                self.assertEqual([path.name for path in out.iterdir()], ["notes.txt"])
            return run.stderr

    def test_non_empty_output(self):
        self.assertIn("not empty (notes.txt)", self.refused("FULL", code=1))

    def test_nothing_to_resume(self):
        self.assertIn("nothing to resume", self.refused("FULL", "--resume", code=1))

    def test_bad_splits(self):
        self.assertIn("sum to 1", self.refused("--splits", "0.5,0.1,0.1", code=2))

    def test_unknown_model(self):
        self.assertIn("mjcf/none.xml: no such file", self.refused("--model", "mjcf/none.xml", code=1))

    def test_model_without_a_floating_base(self):
        with tempfile.TemporaryDirectory() as folder:
            model = Path(folder, "pole.xml")
            model.write_text('<mujoco><worldbody><body><joint/><geom size="1"/></body></worldbody></mujoco>')
            self.assertIn("free joint", self.refused("--model", model, code=1))

    def test_bad_numbers(self):
        self.assertIn("not a positive number", self.refused("--trials", "0", code=2))
        self.assertIn("--seed", self.refused("--seed", "-1", code=2))

    def test_workers_and_ray(self):
        self.assertIn("not allowed with", self.refused("--ray", "auto", "--workers", "2", code=2))

    def test_killed_and_resumed(self):
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder, "out")
            arguments = ("--out", out, "--trials", 12, "--samples", 30, "--shard-size", 1, "--workers", 2)
            run = subprocess.Popen(command(*arguments), stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
            until = time.monotonic() + 30
            while not list(out.glob("*.safetensors")) and time.monotonic() < until:
                time.sleep(0.02)
            run.send_signal(signal.SIGKILL)
            run.wait()
            self.assertFalse((out / "manifest.json").exists())
            done = subprocess.run(command(*arguments, "--resume"), capture_output=True, text=True, cwd=ROOT)
            self.assertEqual(done.returncode, 0, done.stderr)
            manifest = json.loads((out / "manifest.json").read_text())
            entries = [entry for part in manifest["splits"].values() for entry in part["shards"]]
            self.assertEqual(len(entries), 12)
            self.assertEqual(len(list(out.iterdir())), 13)
            for entry in entries:
                self.assertEqual(files.sha256(out / entry["file"]), entry["sha256"])


if __name__ == "__main__":
    unittest.main()
