"""The Task 2 generator: its bytes, its resume, its refusals."""

import hashlib
import json
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from dataclasses import replace
from pathlib import Path
from unittest import mock

import numpy as np
from safetensors.numpy import load_file

from hydro_mujoco.jobs.here import Here
from hydro_mujoco.jobs.processes import Processes
from hydro_mujoco.recording import features, files, shards, simulation
from hydro_mujoco.recording import plan as recording_plan
from hydro_tools.commands import gen_task2
from hydro_tools.commands.make_reference import built_program
from hydro_tools.datasets import DataError, dataset, gait, plan, scene, task2, waters
from hydro_tools.datasets.regime import DENSITIES, GAITS, REGIMES, SPEEDS, USUAL
from hydro_tools.repository import ROOT, SCRIPTS

SETTINGS = dataset.Settings(
    name="t", trials=8, seed=5, samples=60, splits=(0.5, 0.25, 0.25), shard_size=2, model="mjcf/b1_truth.xml"
)


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
        with mock.patch.object(shards, "BLOCK", 3):
            dataset.generate(
                dataset.Settings(**{**SETTINGS.__dict__, "shard_size": 4}), self.other("big"), executor=Here()
            )
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

        original = shards.shard_bytes
        with mock.patch.object(shards, "shard_bytes", dies), self.assertRaises(KeyboardInterrupt):
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
                dataset.generate(
                    dataset.Settings(**{**SETTINGS.__dict__, **change}), self.reference, executor=Here(), resume=True
                )

    def test_tensors_are_those_of_the_schema(self):
        shard = load_file(self.reference / "test-00000-of-00001.safetensors")
        shapes = {name: (tensor.dtype.name, tensor.shape) for name, tensor in shard.items()}
        self.assertEqual(
            shapes,
            {
                "x": ("float32", (2, 60, 35)),
                "wrench": ("float32", (2, 60, 6)),
                "wrench_clean": ("float32", (2, 60, 6)),
                "hydrostatic": ("float32", (2, 60, 6)),
                "time": ("float32", (60,)),
                "condition": ("int32", (2, 60)),
            },
        )
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

    def test_noise_is_a_tenth_of_the_clean_deviation(self):
        noise = np.concatenate(
            [(s := load_file(path))["wrench"] - s["wrench_clean"] for path in self.reference.glob("*.safetensors")]
        ).reshape(-1, 6)
        # The pilot's trajectories once more, without the generator's own factor and deviation.
        loaded = scene.load(SETTINGS.model)
        pilot = [
            plan.task2(SETTINGS.seed, plan.Stream.PILOT, i, samples=SETTINGS.samples, joint_range=loaded.joint_range)
            for i in range(task2.PILOT)
        ]
        wanted = 0.1 * simulation.simulate(loaded.system, pilot).wrench.reshape(-1, 6).std(0)
        np.testing.assert_allclose(noise.std(0), wanted, rtol=0.2)
        np.testing.assert_allclose(self.manifest["perturbation_std"], wanted, rtol=1e-9)
        self.assertTrue((np.abs(noise.mean(0)) < 0.2 * wanted).all())

    def test_splits_share_no_trajectory(self):
        starts = [load_file(path)["x"][:, 0] for path in self.reference.glob("*.safetensors")]
        self.assertEqual(len(np.unique(np.concatenate(starts), axis=0)), 8)

    def test_a_full_disk_leaves_no_half_file(self):
        with mock.patch("os.replace", side_effect=OSError(28, "No space left on device")), self.assertRaises(OSError):
            files.write_beside(self.other("full.json"), b"x")
        self.assertEqual(list(Path(self.temporary.name).glob("full*")), [])


class AsBefore(unittest.TestCase):
    """`--water ellipsoid --trials 6 --samples 50 --seed 3`, noted down at commit 49ee539, before the generator was built on `hydro_mujoco`.

    Where processor and packages are those of that time the shards have these sha256; elsewhere the sums are close.
    """

    MANIFEST = "b3b95f27723faa527399adfb7a278eb993085fad94bc4580590ab63ebde4a904"
    SHARDS = {
        "train": "858507a057c914d38ca0631b4c20d406902ad1d1b5cfcb29be891e826d42d357",
        "test": "0f854ae519e21e75bc91aff16541d236dd8cf741418a9bdeb9d9bc62f5a9a0a1",
    }
    STD = (
        15.720620542010574,
        17.747543939216683,
        18.359200377288143,
        0.7741389162449681,
        1.5708345379532282,
        0.6033653868646118,
    )
    #: Sums of cosine-weighted entries.
    SUMS = {
        "train": {
            "x": -903.2244277043608,
            "wrench": 1346.9331431505261,
            "wrench_clean": 1087.9847901064254,
            "hydrostatic": 130.74855972761043,
            "condition": -194.482427159278,
        },
        "test": {
            "x": -782.0452182998769,
            "wrench": 266.146916403834,
            "wrench_clean": 245.86258488561543,
            "hydrostatic": 235.0783996131122,
            "condition": -31.67723509168914,
        },
    }

    def test_bytes(self):
        with tempfile.TemporaryDirectory() as folder:
            arguments = ("--water", "ellipsoid", "--trials", 6, "--samples", 50, "--seed", 3, "--workers", 1)
            run = subprocess.run(command("--out", Path(folder, "ref"), *arguments), capture_output=True, text=True)
            self.assertEqual(run.returncode, 0, run.stderr)
            manifest = json.loads(Path(folder, "ref", "manifest.json").read_text())
            for split, sha256 in self.SHARDS.items():
                (entry,) = manifest["splits"][split]["shards"]
                if entry["sha256"] != sha256:
                    shard = load_file(Path(folder, "ref", entry["file"]))
                    for name, wanted in self.SUMS[split].items():
                        values = shard[name].astype(float)
                        found = np.sum(values * np.cos(np.arange(values.size)).reshape(values.shape))
                        self.assertAlmostEqual(found, wanted, delta=1e-3 * np.abs(values).sum() ** 0.5)
        np.testing.assert_allclose(manifest.pop("perturbation_std"), self.STD, rtol=1e-9)
        for key in ("splits", "mujoco", "numpy", "name"):
            del manifest[key]
        self.assertEqual(hashlib.sha256(json.dumps(manifest).encode()).hexdigest(), self.MANIFEST)


class Strips(unittest.TestCase):
    """The water that remembers: its own arrays, its manifest, every condition at every switch."""

    SETTINGS = replace(SETTINGS, trials=4, samples=12, water=waters.STRIP, switch=plan.ALL)

    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.temporary.cleanup)
        # Warm-ups of 8 s are half a minute of this test.
        for what, name, value in ((task2, "PILOT", 2), (recording_plan, "WARM_UP", 0.3)):
            patch = mock.patch.object(what, name, value)
            patch.start()
            cls.addClassCleanup(patch.stop)
        cls.out = Path(cls.temporary.name, "strip")
        cls.manifest = dataset.generate(cls.SETTINGS, cls.out, executor=Here())

    def test_shards_hold_every_degree_of_freedom_and_the_added_mass(self):
        shard = load_file(self.out / "train-00000-of-00001.safetensors")
        self.assertEqual(shard["generalised"].shape, (2, 12, 18))
        self.assertEqual(shard["added_mass"].shape, (2, 12, 6))
        turn = shard["x"][..., 24:28].astype(float)
        wrench = features.base_wrench(turn, shard["generalised"][..., :6].astype(float))
        np.testing.assert_allclose(wrench, shard["wrench_clean"], rtol=1e-4, atol=1e-3)
        self.assertGreater(np.abs(shard["added_mass"]).max(), 1.0)
        self.assertGreater(np.abs(shard["generalised"][..., 6:]).max(), 0.1)

    def test_the_manifest_says_its_water(self):
        self.assertEqual(self.manifest["switch"], "all")
        self.assertEqual(self.manifest["water"]["name"], "strip")
        self.assertEqual(len(self.manifest["generalised"]), 18)
        share = np.array(self.manifest["added_mass_share"])
        self.assertTrue(((share > 0.01) & (share < 3.0)).all(), share)

    def test_the_same_seed_gives_the_same_bytes_in_other_shards(self):
        other = Path(self.temporary.name, "other")
        dataset.generate(replace(self.SETTINGS, shard_size=1), other, executor=Here())
        parts = [load_file(path) for path in sorted(other.glob("train-*"))]
        (whole,) = (load_file(path) for path in self.out.glob("train-*"))
        for name in ("x", "wrench", "generalised", "added_mass"):
            np.testing.assert_array_equal(np.concatenate([part[name] for part in parts]), whole[name])

    def test_buoyancy_is_told_on_every_degree_of_freedom(self):
        shard = load_file(self.out / "train-00000-of-00001.safetensors")
        turn = shard["x"][..., 24:28].astype(float)
        lift = shard["generalised_hydrostatic"].astype(float)
        np.testing.assert_allclose(
            features.base_wrench(turn, lift[..., :6]), shard["hydrostatic"], rtol=1e-4, atol=1e-3
        )
        self.assertGreater(np.abs(lift[..., 6:]).max(), 0.1)

    def test_an_added_mass_in_the_inertia_is_no_part_of_the_label(self):
        out = Path(self.temporary.name, "inertia")
        water = replace(waters.STRIP, added_mass=waters.IN_INERTIA)
        manifest = dataset.generate(replace(self.SETTINGS, water=water), out, executor=Here())
        apart, whole = (load_file(folder / "train-00000-of-00001.safetensors") for folder in (out, self.out))
        np.testing.assert_array_equal(apart["x"], whole["x"])
        np.testing.assert_array_equal(apart["added_mass"], whole["added_mass"])
        np.testing.assert_allclose(
            whole["wrench_clean"] - apart["wrench_clean"], whole["added_mass"], rtol=1e-4, atol=2e-3
        )
        turn = apart["x"][..., 24:28].astype(float)
        wrench = features.base_wrench(turn, apart["generalised"][..., :6].astype(float))
        np.testing.assert_allclose(wrench, apart["wrench_clean"], rtol=1e-4, atol=1e-3)

        self.assertEqual(manifest["water"], self.manifest["water"] | {"added_mass": "inertia"})
        np.testing.assert_allclose(manifest["added_mass_share"], self.manifest["added_mass_share"], rtol=1e-9)
        self.assertNotIn("added_mass", self.manifest)
        bodies = {entry["body"]: np.reshape(entry["matrix"], (6, 6)) for entry in manifest["added_mass"]}
        self.assertEqual(len(bodies), 13)
        for body, matrix in bodies.items():
            np.testing.assert_allclose(matrix, matrix.T, atol=1e-15, err_msg=body)
            self.assertGreater(np.linalg.eigvalsh(matrix).min(), -1e-12, body)
        # Heave of the trunk: 91 kg of fresh water.
        self.assertAlmostEqual(bodies["trunk"][2, 2] * 1000, 91.1, places=1)

    def test_another_water_is_not_resumed(self):
        with self.assertRaisesRegex(DataError, "water was .*strip"):
            dataset.generate(
                replace(self.SETTINGS, water=waters.ELLIPSOID, switch=plan.MIXED),
                self.out,
                executor=Here(),
                resume=True,
            )

    def test_every_switch_changes_density_gait_and_push(self):
        loaded = scene.load()
        drawn = plan.task2(5, plan.Stream.TEST, 3, samples=400, joint_range=loaded.joint_range, switch=plan.ALL)
        switches = np.flatnonzero(np.diff(drawn.condition))
        self.assertEqual(len(switches), 40)
        sample = drawn.warm_up + switches + 1
        held = np.diff(drawn.push, axis=0)
        for at in sample:
            self.assertNotEqual(drawn.density[at], drawn.density[at - 1])
            self.assertTrue(held[at - 1].any(), f"the push does not begin to change at {at}")
        mixed = plan.task2(5, plan.Stream.TEST, 3, samples=400, joint_range=loaded.joint_range)
        self.assertTrue((np.diff(mixed.push, axis=0)[sample - 1] == 0).all(axis=1).any())

    def test_an_added_mass_in_the_inertia_wants_strips_without_a_surface(self):
        strip = ["--added-mass", "inertia", "--waterline", "1"]
        ellipsoid = ["--water", "ellipsoid", "--added-mass", "inertia"]
        for flags, words in ((strip, "expected no --waterline"), (ellipsoid, "expected --water strip")):
            run = subprocess.run(command("--out", self.temporary.name, *flags), capture_output=True, text=True)
            self.assertEqual(run.returncode, 2)
            self.assertIn(words, run.stderr)

    def test_a_waterline_wants_strips_and_a_number(self):
        for flags in (["--water", "ellipsoid", "--waterline", "1"], ["--waterline", "nan"]):
            run = subprocess.run(command("--out", self.temporary.name, *flags), capture_output=True, text=True)
            self.assertEqual(run.returncode, 2)
            self.assertIn("expected a height [m], with --water strip", run.stderr)


class Regimes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.joint_range = scene.load().joint_range
        cls.temporary = tempfile.TemporaryDirectory()

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def plans(self, regime, count=40):
        return [
            plan.task2(5, plan.Stream.TEST, i, samples=60, joint_range=self.joint_range, regime=regime)
            for i in range(count)
        ]

    def made(self, name, regime, **changes):
        settings = dataset.Settings(**{**SETTINGS.__dict__, "trials": 3, "splits": (0.0, 0.0, 1.0), "regime": regime})
        out = Path(self.temporary.name, name)
        with mock.patch.object(task2, "PILOT", 2):
            return out, dataset.generate(settings, out, **{"executor": Here(), **changes})

    def test_the_usual_draws_are_those_of_before_there_were_regimes(self):
        """Sums of cosine-weighted entries, noted down from the plans of that time."""
        noted = {
            (0, 7): (
                423,
                -1.770099078619884,
                -2.0268470556433558,
                1.2958340126721324,
                -493.15987707050505,
                -555.9491197545344,
            ),
            (2, 0): (
                473,
                0.9867331445873728,
                -1.4134219085187705,
                -0.5615542662580819,
                206.5528032216771,
                -545.9889149974645,
            ),
            (3, 7): (
                319,
                -0.6143087361580916,
                -3.8707816977432596,
                0.09189189463543634,
                29.096390382259976,
                1508.0003130994946,
            ),
        }
        for (stream, index), wanted in noted.items():
            drawn = plan.task2(5, stream, index, samples=60, joint_range=self.joint_range)
            arrays = (drawn.qpos, drawn.qvel, drawn.ctrl, drawn.push, drawn.density)
            sums = [np.sum(a * np.cos(np.arange(a.size)).reshape(a.shape)) for a in arrays]
            np.testing.assert_allclose([drawn.warm_up, *sums], wanted, rtol=1e-9)

    def test_a_usual_manifest_says_nothing_of_regimes(self):
        _, manifest = self.made("usual", USUAL)
        self.assertFalse({"regime", "ranges"} & set(manifest))

    def test_speeds_start_beyond_the_usual_ones(self):
        usual = USUAL.ranges
        for drawn in self.plans(SPEEDS):
            self.assertGreater(np.linalg.norm(drawn.qvel[:3]), usual.speed_norm[1])
            self.assertGreater(np.linalg.norm(drawn.qvel[3:6]), usual.rate_norm[1])
            self.assertTrue(drawn.push.any())
        pushes = [np.concatenate([p.push for p in self.plans(regime)]).std(axis=0) for regime in (USUAL, SPEEDS)]
        self.assertTrue((pushes[1] > 5 * pushes[0]).all(), pushes)

    def test_densities_lie_in_both_bands(self):
        density = np.concatenate([drawn.density for drawn in self.plans(DENSITIES)])
        light, heavy = ((density >= low) & (density <= high) for low, high in DENSITIES.ranges.density)
        self.assertTrue((light | heavy).all())
        self.assertTrue(0.3 < light.mean() < 0.5, light.mean())
        self.assertLess(density[light].max(), USUAL.ranges.density[0][0])
        self.assertGreater(density[heavy].min(), USUAL.ranges.density[0][1])

    def test_gaits_are_quicker_wider_and_elsewhere(self):
        usual, rng = USUAL.ranges, plan.generator(5, 0)
        widest, furthest = np.tile(usual.amplitude[1], 4), usual.lean[1][1] + usual.scatter[1]
        for _ in range(200):
            drawn = gait.draw(rng, GAITS.ranges)
            self.assertGreater(drawn.frequency, usual.frequency[1])
            self.assertTrue((drawn.amplitude > widest).all(), drawn.amplitude)
            self.assertTrue((np.abs(drawn.centre - np.tile(gait.CENTRE, 4))[1::3] > furthest).all(), drawn.centre)
        for drawn in self.plans(GAITS, 10):
            self.assertTrue(((drawn.ctrl > self.joint_range[:, 0]) & (drawn.ctrl < self.joint_range[:, 1])).all())

    def test_regimes_change_nothing_else_and_share_no_random_numbers(self):
        changed = {
            "speeds": {
                "start_speed",
                "speed_norm",
                "start_rate",
                "rate_norm",
                "push_share",
                "push_force",
                "push_torque",
            },
            "densities": {"density"},
            "gaits": {"glide_share", "frequency", "amplitude", "lean", "scatter"},
        }
        for name, own in changed.items():
            ranges = REGIMES[name].ranges.__dict__
            self.assertEqual({key for key, value in USUAL.ranges.__dict__.items() if ranges[key] != value}, own)
        self.assertEqual(len({regime.key for regime in REGIMES.values()}), len(REGIMES))
        postures = [drawn.qpos[3:7] for regime in REGIMES.values() for drawn in self.plans(regime, 5)]
        self.assertEqual(len(np.unique(postures, axis=0)), 5 * len(REGIMES))

    def test_a_set_of_one_split_is_whole_and_says_its_ranges(self):
        for name in ("speeds", "densities", "gaits"):
            out, manifest = self.made(name, REGIMES[name])
            on_disk = json.loads((out / "manifest.json").read_text())
            self.assertEqual(on_disk, manifest)
            self.assertEqual(on_disk["regime"], name)
            self.assertEqual(on_disk["ranges"]["density"], [list(band) for band in REGIMES[name].ranges.density])
            self.assertEqual(
                {split: part["trajectories"] for split, part in on_disk["splits"].items()},
                {"train": 0, "val": 0, "test": 3},
            )
            self.assertEqual(on_disk["splits"]["train"], {"trajectories": 0, "shards": []})
            entries = on_disk["splits"]["test"]["shards"]
            self.assertEqual(sorted(e["file"] for e in entries), sorted(p.name for p in out.glob("*.safetensors")))
            for entry in entries:
                shard = load_file(out / entry["file"])
                self.assertEqual(shard["x"].shape, (entry["trajectories"], 60, 35))
                self.assertTrue(all(np.isfinite(tensor).all() for tensor in shard.values()))

    def test_two_workers_and_a_resume_give_the_same_bytes(self):
        one, _ = self.made("one", SPEEDS)
        two, _ = self.made("two", SPEEDS, executor=Processes(2))
        (one / "test-00001-of-00002.safetensors").unlink()
        self.made("one", SPEEDS, resume=True)
        self.assertEqual(contents(one), contents(two))

    def test_resume_with_another_regime_is_refused(self):
        wider = replace(SPEEDS, ranges=replace(SPEEDS.ranges, push_force=401.0))
        for before, after, word in (
            (USUAL, GAITS, "regime was 'usual', now 'gaits'"),
            (GAITS, USUAL, "regime was 'gaits', now 'usual'"),
            (GAITS, SPEEDS, "regime was 'gaits', now 'speeds'"),
            (SPEEDS, wider, "ranges was"),
        ):
            name = f"{before.name} to {after.name}"
            self.made(name, before)
            with self.assertRaisesRegex(DataError, word):
                self.made(name, after, resume=True)


class CommandLine(unittest.TestCase):
    def refused(self, *arguments, code):
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder, "out")
            if "FULL" in arguments:
                out.mkdir()
                (out / "notes.txt").write_text("mine")
            run = subprocess.run(
                command("--out", out, *(a for a in arguments if a != "FULL")), capture_output=True, text=True
            )
            self.assertEqual(run.returncode, code, run.stderr)
            self.assertNotIn("Traceback", run.stderr)
            if out.exists():
                self.assertEqual([path.name for path in out.iterdir()], ["notes.txt"])
            return run.stderr

    def test_non_empty_output(self):
        self.assertIn("not empty (notes.txt)", self.refused("FULL", code=1))

    def test_nothing_to_resume(self):
        self.assertIn("nothing to resume", self.refused("FULL", "--resume", code=1))

    def test_a_folder_that_cannot_be_used_is_refused_before_the_water_is_made(self):
        with tempfile.TemporaryDirectory() as temporary:
            full, file, torn = (Path(temporary, name) for name in ("full", "file", "torn"))
            full.mkdir()
            (full / "notes.txt").write_text("mine")
            file.write_text("mine")
            torn.mkdir()
            (torn / "generation.json.tmp").write_text("{")
            for out, flags, message in (
                (full, {}, "not empty"),
                (full, {"resume": True}, "nothing to resume"),
                (file, {"overwrite": True}, "is a file"),
                (torn, {}, "not empty"),
            ):
                with (
                    self.subTest(out=out.name, **flags),
                    mock.patch.object(dataset, "_head", side_effect=AssertionError("water is made")),
                    self.assertRaisesRegex(DataError, message),
                ):
                    dataset.generate(SETTINGS, out, executor=Here(), **flags)

    def test_a_split_that_gets_nothing_is_named(self):
        with tempfile.TemporaryDirectory() as folder:
            arguments = ("--trials", 6, "--samples", 5, "--workers", 1, "--water", "ellipsoid")
            run = subprocess.run(command("--out", Path(folder, "out"), *arguments), capture_output=True, text=True)
            self.assertEqual(run.returncode, 0, run.stderr)
            self.assertIn("split val of 6 trajectories is empty", run.stderr)

    @unittest.skipUnless(built_program().is_file(), "no `hydro` is built: cargo build")
    def test_without_a_test_split_the_generator_says_so_train_saves_and_evaluate_refuses(self):
        with tempfile.TemporaryDirectory() as temporary:
            data, out = Path(temporary, "data"), Path(temporary, "out")
            words = ("--trials", 4, "--samples", 20, "--workers", 1, "--water", "ellipsoid")
            run = subprocess.run(command("--out", data, *words), capture_output=True, text=True)
            self.assertEqual(run.returncode, 0, run.stderr)
            self.assertIn("split test of 4 trajectories is empty: no error is known", run.stderr)
            self.assertIn("train 3, val 1, test 0 trajectories", run.stdout)

            sizes = ("--model=mlp", "--hidden=8", "--epochs=1", "--batch=2", "--horizon=10")
            train = [built_program(), "train", "--data", data, "--out", out, *sizes]
            run = subprocess.run(train, capture_output=True, text=True)
            self.assertEqual(run.returncode, 0, run.stderr)
            self.assertIn(f"saved without errors on the test split of {data}", run.stderr)
            self.assertIn("not tested", run.stdout)
            self.assertEqual({path.name for path in out.iterdir()}, {"card.json", "weights.safetensors"})

            evaluate = [built_program(), "evaluate", "--checkpoint", out, "--data", data]
            run = subprocess.run(evaluate, capture_output=True, text=True)
            self.assertEqual((run.returncode, run.stdout), (1, ""))
            self.assertIn(f"{data}: the test split is empty; there is nothing to evaluate", run.stderr)

    def test_bad_splits(self):
        self.assertIn("sum to 1", self.refused("--splits", "0.5,0.1,0.1", code=2))

    def test_strips_are_the_default_and_each_water_switches_in_its_way(self):
        for flags, water, switch in (
            ([], "strip", plan.ALL),
            (["--water", "ellipsoid"], "ellipsoid", plan.MIXED),
            (["--switch", "mixed"], "strip", plan.MIXED),
        ):
            with mock.patch.object(sys, "argv", ["gen_task2.py", *flags]):
                args = gen_task2.parse()
            self.assertEqual((args.water, args.switch, args.added_mass), (water, switch, waters.IN_LABEL))

    def test_unknown_regime(self):
        self.assertIn("choose from 'usual', 'speeds', 'densities', 'gaits'", self.refused("--regime", "fast", code=2))

    def test_other_regimes_are_for_the_test_split(self):
        with tempfile.TemporaryDirectory() as folder:
            arguments = ("--regime", "densities", "--trials", 2, "--samples", 5, "--workers", 1, "--water", "ellipsoid")
            run = subprocess.run(command("--out", Path(folder, "out"), *arguments), capture_output=True, text=True)
            self.assertEqual(run.returncode, 0, run.stderr)
            self.assertIn("train 0, val 0, test 2 trajectories", run.stdout)

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
            sizes = ("--trials", 12, "--samples", 30, "--shard-size", 1)
            arguments = ("--out", out, *sizes, "--workers", 2, "--water", "ellipsoid")
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
