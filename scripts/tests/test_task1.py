"""The Task 1 generator: its bytes, its splits, its resume, its refusals."""

import contextlib
import io
import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from unittest import mock

import numpy as np
from safetensors.numpy import load_file

from hydro_mujoco.recording import files, folder
from hydro_tools.commands import gen_task1
from hydro_tools.datasets import DataError
from hydro_tools.repository import SCRIPTS
from hydro_tools.tank import campaign, conditions, dataset, force, processing, task1
from hydro_tools.tank.conditions import Condition

SHARES = (0.5, 0.25, 0.25)


def settings(task, **changes):
    values = {"task": task, "trials": 8, "seed": 5, "splits": SHARES, "by": "trajectory", "shard_size": 3}
    return dataset.Settings(**values | changes)


def contents(folder_):
    return {path.name: path.read_bytes() for path in Path(folder_).iterdir()}


def tensors(folder_):
    """All shards of a folder, by split."""
    out = {}
    for split in folder.SPLITS:
        parts = [load_file(path) for path in sorted(Path(folder_).glob(f"{split}-*.safetensors"))]
        out[split] = {name: np.concatenate([part[name] for part in parts]) for name in parts[0] if name != "time"}
    return out


def command(*arguments):
    return [sys.executable, str(SCRIPTS / "gen_task1.py"), *map(str, arguments)]


class Data(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.root = Path(cls.temporary.name)
        cls.tank = cls.root / "raw"
        campaign.tow(cls.tank, 5, settings("1.1").tows())
        cls.pilot = mock.patch.object(task1, "PILOT", 16)
        cls.pilot.start()
        cls.manifests = {task: dataset.generate(settings(task), cls.root / task, cls.tank) for task in task1.SAMPLES}
        cls.tensors = {task: tensors(cls.root / task) for task in task1.SAMPLES}

    @classmethod
    def tearDownClass(cls):
        cls.pilot.stop()
        cls.temporary.cleanup()

    def test_tensors_are_those_of_the_schema(self):
        for task, samples in task1.SAMPLES.items():
            shard = load_file(self.root / task / "train-00000-of-00002.safetensors")
            shapes = {name: (tensor.dtype.name, tensor.shape) for name, tensor in shard.items()}
            self.assertEqual(
                shapes,
                {
                    "x": ("float32", (3, samples, 4)),
                    "wrench": ("float32", (3, samples, 2)),
                    "wrench_clean": ("float32", (3, samples, 2)),
                    "hydrostatic": ("float32", (3, samples, 2)),
                    "time": ("float32", (samples,)),
                    "condition": ("int32", (3, samples)),
                },
            )
            np.testing.assert_allclose(shard["time"], np.arange(samples) * 0.1, rtol=1e-6)
            self.assertFalse(shard["hydrostatic"].any())
            manifest = self.manifests[task]
            self.assertEqual([part["trajectories"] for part in manifest["splits"].values()], [4, 2, 2])
            self.assertEqual((manifest["schema"], manifest["samples"]), ("hydro-dataset/1", samples))
            for part in manifest["splits"].values():
                for entry in part["shards"]:
                    self.assertEqual(files.sha256(self.root / task / entry["file"]), entry["sha256"])

    def test_features_are_those_of_the_condition(self):
        for task in task1.SAMPLES:
            for part in self.tensors[task].values():
                expected = np.array([[Condition(int(c)).features for c in row] for row in part["condition"]])
                np.testing.assert_array_equal(part["x"], expected.astype(np.float32))

    def test_constant_trajectories_hold_one_condition_each_their_own(self):
        rows = np.concatenate([part["condition"] for part in self.tensors["1.1"].values()])
        self.assertTrue((rows == rows[:, :1]).all())
        self.assertEqual(len(set(rows[:, 0])), 8)

    def test_constant_trajectories_measure_the_force(self):
        for part in self.tensors["1.1"].values():
            for wrench, clean, row in zip(part["wrench"], part["wrench_clean"], part["condition"]):
                condition = Condition(int(row[0]))
                mean = force.developed(condition.stance, condition.speed)[:2]
                # The cell's error, not zero; the tank's unsteadiness, not constant.
                self.assertLess(np.abs(wrench.mean(axis=0) - mean).max(), 0.4)
                self.assertLess(np.abs(clean.mean(axis=0) - mean).max(), 0.15)
                self.assertGreater(np.abs(wrench - clean).max(), 0.01)
                self.assertGreater(wrench.std(axis=0).max(), 0.01)

    def test_changing_trajectories_hold_five_conditions_ten_samples_each(self):
        for part in self.tensors["1.2"].values():
            blocks = part["condition"].reshape(-1, 5, 10)
            self.assertTrue((blocks == blocks[..., :1]).all())
            self.assertTrue(all(len(set(row)) == 5 for row in blocks[..., 0]))
            np.testing.assert_array_equal(part["wrench"], part["wrench_clean"])

    def test_splits_share_no_trajectory(self):
        for task in task1.SAMPLES:
            rows = np.concatenate([part["condition"] for part in self.tensors[task].values()])
            self.assertEqual(len(np.unique(rows, axis=0)), 8)

    def test_force_lags_behind_a_switch(self):
        missed = {0: [], 9: []}
        for part in self.tensors["1.2"].values():
            for clean, row in zip(part["wrench_clean"], part["condition"]):
                for k in missed:
                    held = [Condition(int(c)) for c in row[10 + k :: 10]]
                    mean = np.array([force.developed(c.stance, c.speed)[:2] for c in held])
                    missed[k].append(np.abs(clean[10 + k :: 10] - mean))
        self.assertGreater(np.mean(missed[0]), 2 * np.mean(missed[9]))

    def test_noisy_trajectories_are_the_changing_ones_with_a_tenth_of_noise(self):
        manifest = self.manifests["1.3"]
        noise = []
        for split, part in self.tensors["1.3"].items():
            for name in ("x", "wrench_clean", "condition"):
                np.testing.assert_array_equal(part[name], self.tensors["1.2"][split][name])
            noise.append((part["wrench"] - part["wrench_clean"]).reshape(-1, 2))
        noise = np.concatenate(noise)
        # The pilot's trajectories once more, without the generator's own factor and deviation.
        everything = list(range(conditions.COUNT))
        pilot = [task1.switched(5, task1.PILOT_SPLIT, i, everything)["wrench_clean"] for i in range(task1.PILOT)]
        wanted = 0.1 * np.concatenate(pilot).std(axis=0)
        np.testing.assert_allclose(noise.std(axis=0), wanted, rtol=0.2)
        np.testing.assert_allclose(manifest["perturbation_std"], wanted, rtol=1e-9)
        self.assertLess(abs(np.mean(noise[1:] * noise[:-1]) / noise.var()), 0.1)

    def test_same_seed_same_bytes_and_another_seed_others(self):
        for task in ("1.1", "1.3"):
            dataset.generate(settings(task), self.root / f"{task} again", self.tank)
            self.assertEqual(contents(self.root / f"{task} again"), contents(self.root / task))
        dataset.generate(settings("1.2", seed=6), self.root / "other", self.tank)
        self.assertFalse(np.array_equal(tensors(self.root / "other")["train"]["x"], self.tensors["1.2"]["train"]["x"]))

    def test_shard_size_changes_no_trajectory(self):
        dataset.generate(settings("1.2", shard_size=50), self.root / "big", self.tank)
        for split, part in tensors(self.root / "big").items():
            for name, values in part.items():
                np.testing.assert_array_equal(values, self.tensors["1.2"][split][name])

    def test_resume_after_a_kill_gives_the_same_bytes(self):
        out, made, original = self.root / "killed", [], task1.switched

        def dies(*arguments):
            if len(made) == 5:
                raise KeyboardInterrupt
            made.append(arguments)
            return original(*arguments)

        with mock.patch.object(task1, "switched", dies), self.assertRaises(KeyboardInterrupt):
            dataset.generate(settings("1.2"), out, self.tank)
        self.assertFalse((out / "manifest.json").exists())
        first = out / "train-00000-of-00002.safetensors"
        kept = first.stat().st_mtime_ns
        dataset.generate(settings("1.2"), out, self.tank, resume=True)
        self.assertEqual(first.stat().st_mtime_ns, kept, "a finished shard was made again")
        self.assertEqual(contents(out), contents(self.root / "1.2"))

    def test_a_damaged_run_is_towed_again(self):
        raw = self.root / "damaged"
        campaign.tow(raw, 5, [(0, 0), (0, 1)])
        whole = contents(raw)
        (raw / "run-001.npz").write_bytes(b"half")
        with self.assertRaisesRegex(DataError, "not empty"):
            campaign.tow(raw, 5, [(0, 0), (0, 1)])
        campaign.tow(raw, 5, [(0, 0), (0, 1)], resume=True)
        self.assertEqual(contents(raw), whole)
        with self.assertRaisesRegex(DataError, "seed was 5, now 6"):
            campaign.tow(raw, 6, [(0, 0), (0, 1)], resume=True)
        with self.assertRaisesRegex(DataError, "--trials"):
            campaign.tow(raw, 5, [(0, 0)], resume=True)

    def test_resume_with_other_settings_is_refused(self):
        for change, word in (
            ({"seed": 6}, "seed was 5, now 6"),
            ({"trials": 12}, "--trials"),
            ({"by": "configuration", "splits": (0.4, 0.3, 0.3)}, "split_by was 'trajectory'"),
        ):
            with self.assertRaisesRegex(DataError, word):
                dataset.generate(settings("1.2", **change), self.root / "1.2", self.tank, resume=True)

    def test_a_tank_that_is_not_there_or_not_whole_is_refused(self):
        with self.assertRaisesRegex(DataError, "not towed to its end"):
            dataset.generate(settings("1.1"), self.root / "new", self.root / "nowhere")
        raw = self.root / "changed"
        campaign.tow(raw, 5, settings("1.1").tows())
        victim = next(raw.glob("run-*.npz"))
        victim.write_bytes(victim.read_bytes()[:-1] + b"!")
        with self.assertRaisesRegex(DataError, "run-.*not what manifest.json says"):
            dataset.generate(settings("1.1"), self.root / "new", raw)

    def test_a_run_file_that_lacks_an_array_is_refused(self):
        path = self.root / "strange.npz"
        np.savez(path, reading=np.zeros((3, 3)))
        with self.assertRaisesRegex(DataError, "lacks rate, condition.*; it holds reading"):
            campaign.read(path)
        path.write_bytes(b"no zip")
        with self.assertRaisesRegex(DataError, "strange.npz"):
            campaign.read(path)

    def test_the_table_has_a_line_for_every_tow(self):
        lines = (self.tank / campaign.TABLE).read_text().splitlines()
        runs = len(settings("1.1").tows())
        self.assertEqual(len(lines), 1 + 3 * runs)
        self.assertEqual(lines[0], ",".join(campaign.COLUMNS))
        # Resuming writes the same table.
        before = contents(self.tank)
        campaign.tow(self.tank, 5, settings("1.1").tows(), resume=True)
        self.assertEqual(contents(self.tank), before)

    def test_a_window_longer_than_the_steady_part_is_refused(self):
        run = campaign.read(sorted(self.tank.glob("run-*.npz"))[0])
        part = processing.steady(run)[0]
        short = processing.Steady(part.condition, part.time[:900], part.force[:900], part.mean, part.spread, part.error)
        with self.assertRaisesRegex(DataError, "lasts 4.5 s, a trajectory 10 s"):
            task1.constant(run, short, np.random.default_rng(0))


class Splits(unittest.TestCase):
    def test_by_configuration_no_configuration_is_shared(self):
        part = task1.Partition(3, (0.7, 0.1, 0.2), "configuration")
        held = part.configurations()
        self.assertEqual([len(c) for c in held.values()], [11, 2, 3])
        self.assertEqual(sorted(c for group in held.values() for c in group), list(range(16)))
        for pool in (part.drawn(), {split: [c for c, _ in tows] for split, tows in part.towed(192).items()}):
            for split, numbers in pool.items():
                self.assertEqual({Condition(c).configuration for c in numbers}, set(held[split]))
                self.assertEqual(len(numbers), 12 * len(held[split]))

    def test_generated_by_configuration(self):
        with tempfile.TemporaryDirectory() as out:
            manifest = dataset.generate(settings("1.2", by="configuration"), Path(out, "d"), Path(out, "no tank"))
            found = {
                split: {Condition(int(c)).configuration for c in part["condition"].ravel()}
                for split, part in tensors(Path(out, "d")).items()
            }
            for split, held in manifest["configurations"].items():
                self.assertLessEqual(found[split], set(held))
            self.assertFalse(
                found["train"] & found["test"] or found["train"] & found["val"] or found["val"] & found["test"]
            )

    def test_repeats_of_a_condition_stay_in_one_split(self):
        for by in task1.BY:
            towed = task1.Partition(0, (0.8, 0.1, 0.1), by).towed(500)
            self.assertEqual(sum(len(tows) for tows in towed.values()), 500)
            self.assertEqual(len({tow for tows in towed.values() for tow in tows}), 500)
            groups = [{c for c, _ in tows} for tows in towed.values()]
            self.assertFalse(groups[0] & groups[1] or groups[0] & groups[2] or groups[1] & groups[2])

    def test_every_condition_is_towed_once_by_default(self):
        towed = task1.Partition(0, (0.8, 0.1, 0.1), "trajectory").towed(192)
        self.assertEqual({split: len(tows) for split, tows in towed.items()}, {"train": 154, "val": 19, "test": 19})
        self.assertEqual(sorted(c for tows in towed.values() for c, _ in tows), list(range(conditions.COUNT)))

    def test_a_split_without_a_trajectory_is_refused(self):
        with self.assertRaisesRegex(DataError, "1 trajectories leave val, test without any"):
            settings("1.1", trials=1, splits=(0.8, 0.1, 0.1)).counts()

    def test_a_split_with_too_few_conditions_is_refused(self):
        with self.assertRaisesRegex(DataError, "between 5 conditions, this split has 3"):
            task1.switched(0, 0, 0, [1, 2, 3])


class CommandLine(unittest.TestCase):
    def refused(self, *arguments, code):
        with tempfile.TemporaryDirectory() as temporary:
            out = Path(temporary, "out")
            if "FULL" in arguments:
                (out / "1.2").mkdir(parents=True)
                (out / "1.2/notes.txt").write_text("mine")
            run = subprocess.run(
                command("--out", out, *(a for a in arguments if a != "FULL")), capture_output=True, text=True
            )
            self.assertEqual(run.returncode, code, run.stderr)
            self.assertNotIn("Traceback", run.stderr)
            if out.exists():
                self.assertEqual([path.name for path in out.rglob("*") if path.is_file()], ["notes.txt"])
            return run.stderr

    def test_non_empty_output(self):
        self.assertIn("not empty (notes.txt)", self.refused("FULL", "--task", "1.2", code=1))

    def test_nothing_to_resume(self):
        self.assertIn("nothing to resume", self.refused("FULL", "--task", "1.2", "--resume", code=1))

    def test_bad_values(self):
        for message, *arguments in (
            ("sum to 1", "--splits", "0.5,0.1,0.1"),
            ("not a positive number", "--trials", "0"),
            ("argument --seed", "--seed", "-1"),
            ("invalid choice: '1.4'", "--task", "1.4"),
            ("invalid choice: 'row'", "--split-by", "row"),
        ):
            said = io.StringIO()
            with mock.patch.object(sys, "argv", ["gen_task1.py", *arguments]), contextlib.redirect_stderr(said):
                with self.assertRaises(SystemExit) as stopped:
                    gen_task1.parse()
            self.assertEqual(stopped.exception.code, 2)
            self.assertIn(message, said.getvalue())

    def test_too_few_trials(self):
        self.assertIn("raise --trials", self.refused("--trials", "2", code=1))

    def test_whole(self):
        with tempfile.TemporaryDirectory() as temporary:
            out = Path(temporary, "out")
            arguments = ("--out", out, "--trials", 4, "--splits", "0.5,0.25,0.25")
            done = subprocess.run(command(*arguments), capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            held = sorted(str(path.relative_to(out)) for path in out.iterdir())
            self.assertEqual(held, ["1.1", "1.2", "1.3", "figures", "raw"])
            for name in ("raw.svg", "speeds.svg"):
                self.assertIn("<svg", (out / "figures" / name).read_text())
            before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
            again = subprocess.run(command(*arguments, "--overwrite"), capture_output=True, text=True)
            self.assertEqual(again.returncode, 0, again.stderr)
            self.assertEqual({path: path.read_bytes() for path in out.rglob("*") if path.is_file()}, before)
            self.assertEqual(json.loads((out / "1.3/manifest.json").read_text())["features"], list(task1.FEATURES))


if __name__ == "__main__":
    unittest.main()
