"""Gaits: the generator, robots in their waters, learning and its files."""

import importlib.util
import json
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from dataclasses import replace
from pathlib import Path

import numpy as np

from hydro_mujoco.envs.b1_tasks import FASTEST, MIDDLE, REACH
from hydro_tools.datasets import DataError
from hydro_tools.gaits import episode, gait_file, generator, replay, table, waters
from hydro_tools.gaits.generator import FIRST, PARAMETERS, PERIOD, Generator, Senses
from hydro_tools.repository import SCRIPTS

HAS_CMA = importlib.util.find_spec("cma") is not None
needs_cma = unittest.skipUnless(HAS_CMA, "pip install -e . -e scripts[gaits]")
COMMAND = [sys.executable, str(SCRIPTS / "learn_gait.py")]
JOINTS = tuple(f"{leg}_{joint}_joint" for leg in ("FR", "FL", "RR", "RL") for joint in ("hip", "thigh", "calf"))
LEARNT = {"water": "truth", "seed": 0, "seconds": 12.0, "episodes": 1, "score": 0.1}


def level(**seen):
    """Senses of one robot, level and at its depth but for `seen`."""
    names = ("nose", "left", "heading", "pitch_rate", "yaw_rate", "below", "rising")
    return Senses(**{name: np.array([seen.get(name, 0.0)]) for name in names})


def vector(**given):
    """Parameters where learning begins, but for `given`."""
    names = [parameter.name for parameter in PARAMETERS]
    values = FIRST.copy()
    for name, value in given.items():
        values[names.index(name)] = value
    return values


def settled(values, senses, time=0.0):
    """Targets [12] that the limit of rate does not hold back."""
    before = np.tile(MIDDLE, (1, 1))
    for _ in range(200):
        before = Generator(values).targets(time, before, senses)
    return before[0]


class Pattern(unittest.TestCase):
    def test_a_joint_follows_its_sine_and_second_harmonic(self):
        values = vector(frequency=0.5, skew=0.2, fore_thigh_amplitude=0.3, fore_thigh_middle=0.1, hind_lead=0.4)
        for time_ in (0.0, 0.3, 1.7):
            angle = 2 * np.pi * 0.5 * time_
            wanted = MIDDLE[1] + REACH[1] * (0.1 + 0.3 * (np.sin(angle) + 0.2 * np.sin(2 * angle)))
            self.assertAlmostEqual(settled(values, level(), time_)[1], wanted, places=12)
            hind = settled(vector(frequency=0.5, hind_lead=0.4), level(), time_)[7]
            self.assertAlmostEqual(hind, MIDDLE[7] + REACH[7] * 0.35 * np.sin(angle + 0.4), places=12)

    def test_left_and_right_are_mirrored(self):
        found = settled(vector(side_lead=0.0, fore_hip_middle=0.3, hind_hip_middle=-0.2), level(), 0.2).reshape(4, 3)
        np.testing.assert_allclose(found[[0, 2]] * [-1, 1, 1], found[[1, 3]], atol=1e-12)
        self.assertGreater(found[1, 0], 0.05)

    def test_targets_stay_in_reach_and_are_no_faster_than_allowed(self):
        random = np.random.default_rng(0)
        values = generator.unit_to_values(random.uniform(size=(50, len(PARAMETERS))))
        swimming, before = Generator(values), np.tile(MIDDLE, (50, 1))
        for step in range(100):
            wild = Senses(*random.normal(size=(7, 50)))
            after = swimming.targets(step * PERIOD, before, wild)
            self.assertLessEqual(np.abs(after - before).max(), FASTEST * PERIOD + 1e-12)
            self.assertLessEqual((np.abs(after - MIDDLE) - REACH).max(), 1e-12)
            before = after

    def test_each_sense_moves_what_it_should(self):
        calm = {"frequency": 0.5}
        rest = settled(vector(**calm), level())

        def moved(gain, **seen):
            return (settled(vector(**calm, **gain), level(**seen)) - rest).reshape(4, 3)

        lean = moved({"lean_of_pitch": 0.5}, nose=-0.2)
        np.testing.assert_allclose(lean[:, 1] / REACH[1], [0.1, 0.1, -0.1, -0.1], atol=1e-12)
        np.testing.assert_allclose(moved({"lean_of_pitch_rate": 0.5}, pitch_rate=0.2), lean, atol=1e-12)
        climbing = moved({"lean_of_pitch": 0.5, "climb_of_depth": 1.0}, below=0.2)
        np.testing.assert_allclose(climbing, lean, atol=1e-12)
        np.testing.assert_allclose(moved({"lean_of_pitch": 0.5, "climb_of_speed": 1.0}, rising=-0.2), lean, atol=1e-12)
        split = moved({"split_of_roll": 0.5}, left=0.2)
        np.testing.assert_allclose(split[:, 1] / REACH[1], [-0.1, 0.1, -0.1, 0.1], atol=1e-12)
        for gain, seen in (("turn_of_heading", "heading"), ("turn_of_yaw_rate", "yaw_rate")):
            at = {"time": 0.5}
            straight = settled(vector(**calm), level(), **at).reshape(4, 3) - MIDDLE.reshape(4, 3)
            turned = settled(vector(**calm, **{gain: 0.5}), level(**{seen: 0.2}), **at).reshape(4, 3)
            scale = ((turned - MIDDLE.reshape(4, 3)) / straight)[:, 1]
            np.testing.assert_allclose(scale, [0.9, 1.1, 0.9, 1.1], atol=1e-9)

    def test_learning_begins_inside(self):
        unit = generator.values_to_unit(FIRST)
        self.assertTrue(((unit >= 0) & (unit <= 1)).all())
        np.testing.assert_allclose(generator.unit_to_values(unit), FIRST)


def straight(speed, moments=100, robots=1, **other):
    """A level track along x."""
    qpos = np.zeros((moments, robots, 19))
    qpos[..., 0] = (np.arange(moments) * PERIOD * speed)[:, None]
    qpos[..., 3] = 1.0
    track = episode.Track(
        qpos, np.zeros((moments, robots, 12)), np.full((moments, robots), 50.0), np.ones((moments, robots), bool)
    )
    return replace(track, **other)


class Worth(unittest.TestCase):
    def test_the_score_is_the_speed_less_the_prices(self):
        self.assertAlmostEqual(episode.score(straight(0.3))[0], 0.3 * 99 / 100)
        track = straight(0.0)
        track.qpos[1:, 0, 2] = -0.5
        self.assertAlmostEqual(episode.score(track)[0], -episode.DEPTH_PRICE * 0.5 * 99 / 100)
        # About x the nose stays ahead, about y it dips too, about z the trunk stays upright.
        tilt, heading = episode.TILT_PRICE, episode.HEADING_PRICE
        for axis, price in ((1, tilt), (2, tilt + heading), (3, heading)):
            track = straight(0.0)
            track.qpos[:, 0, 3:7] = 0.0
            track.qpos[:, 0, 3], track.qpos[:, 0, 3 + axis] = np.cos(0.2), np.sin(0.2)
            self.assertAlmostEqual(episode.score(track)[0], -price * (1 - np.cos(0.4)))
        half = np.ones((100, 1), bool)
        half[50:] = False
        worst = episode.DEPTH_PRICE * 1.5 + episode.TILT_PRICE + 2 * episode.HEADING_PRICE
        self.assertAlmostEqual(episode.score(straight(0.0, swims=half))[0], -worst / 2)

    def test_a_judgement_is_that_of_the_way(self):
        track = straight(0.3)
        track.qpos[-1, 0, 2] = 0.25
        angle = np.radians(20)
        track.qpos[-1, 0, 3:7] = [np.cos(angle / 2), 0, 0, np.sin(angle / 2)]
        track.qpos[30, 0, 3:7] = [np.cos(angle / 4), np.sin(angle / 4), 0, 0]
        (found,) = episode.judge(track)
        ahead = 99 * PERIOD * 0.3
        self.assertAlmostEqual(found.ahead, ahead)
        self.assertAlmostEqual(found.speed, ahead / 2)
        self.assertAlmostEqual(found.depth_drift, 0.25)
        self.assertAlmostEqual(found.heading_drift, 20)
        self.assertAlmostEqual(found.tilt_worst, 10, places=5)
        self.assertAlmostEqual(found.cost, 50 * 2 / (episode.WEIGHT * ahead))
        self.assertIsNone(episode.judge(straight(-0.1))[0].cost)


class Waters(unittest.TestCase):
    def test_foam_trims_the_robot_in_every_water(self):
        for name in ("truth", "box", "drag"):
            model = waters.water(name).model()
            lift = float((model.body_mass * model.body_gravcomp).sum())
            self.assertAlmostEqual(lift / model.body_mass.sum(), 1.0, delta=0.003, msg=name)

    def test_the_number_of_threads_and_the_neighbours_change_nothing(self):
        water, values = waters.water("truth"), np.stack([vector(), vector(frequency=1.7), vector(skew=0.3)])
        begin = episode.starts(water.model(), np.random.default_rng(3), 3)
        tracks = [episode.swim(water.robots(3, threads), values, begin, 0.4) for threads in (1, 2)]
        np.testing.assert_array_equal(tracks[0].qpos, tracks[1].qpos)
        alone = episode.Starts(*(part[1:2] for part in vars(begin).values()))
        single = episode.swim(water.robots(1, 1), values[1:2], alone, 0.4)
        np.testing.assert_array_equal(single.qpos[:, 0], tracks[0].qpos[:, 1])
        self.assertGreater(np.abs(tracks[0].qpos[-1, 0] - tracks[0].qpos[-1, 1]).max(), 1e-3)

    def test_a_robot_upside_down_has_come_to_its_end(self):
        water = waters.water("box")
        begin = episode.starts(water.model(), np.random.default_rng(0), 2)
        begin.qpos[1, 3:7] = [0, 1, 0, 0]
        track = episode.swim(water.robots(2, 1), np.tile(vector(), (2, 1)), begin, 0.2)
        self.assertEqual(track.swims.sum(axis=0).tolist(), [10, 0])

    def test_a_replay_goes_on_in_strip_theory(self):
        gait = gait_file.made(vector(), JOINTS, **LEARNT)
        found = replay.summary(replay.replay(gait, waters.water("strip"), seconds=0.1, starts=1, threads=1))
        self.assertEqual(found["swam"], 0.1)
        self.assertLess(found["depth_worst"], 0.05)

    def test_joint_torques_of_strips_are_those_of_the_checkpoint(self):
        gait = gait_file.made(vector(), JOINTS, **LEARNT)
        names = ("strip", "strip-learned", "strip-wrench")
        tracks = {
            name: replay.replay(gait, waters.water(name), seconds=1.0, starts=1, threads=1).qpos[:, 0] for name in names
        }
        # The legs are where the truth has them, or where they would be without water.
        off = {name: np.degrees(np.abs(tracks[name][:, 7:] - tracks["strip"][:, 7:]).mean()) for name in names}
        self.assertLess(off["strip-learned"], 0.3 * off["strip-wrench"])

    def test_a_run_for_a_film_is_the_same_way(self):
        from hydro_tools.datasets import replay as replays

        gait = gait_file.made(vector(), JOINTS, **LEARNT)
        truth = waters.water("truth")
        run = replay.as_run(gait, truth, 0.5)
        model = replays.compile_scene("mjcf/b1_truth.xml", density=1000.0)
        *_, last = replays.replay(model, run, 0.01)
        track = replay.replay(gait, truth, seconds=0.5, starts=1, threads=1)
        np.testing.assert_allclose(last.qpos, track.qpos[-1, 0], atol=1e-6)

    def test_a_water_that_there_is_not(self):
        with self.assertRaisesRegex(DataError, "water is 'mud'; there are: learned, drag, box, truth, strip"):
            waters.water("mud")


class Files(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = Path(folder.name, "gait.json")
        self.model = waters.water("box").model()
        self.gait = gait_file.made(vector(), gait_file.joints_of(self.model), **LEARNT)
        gait_file.write(self.path, self.gait)

    def refused(self, expected, change=None, text=None):
        content = json.loads(self.path.read_text())
        if change:
            change(content)
        self.path.write_text(json.dumps(content) if text is None else text)
        with self.assertRaises(DataError) as caught:
            gait_file.read(self.path, self.model)
        message = str(caught.exception)
        self.assertIn(expected, message)
        self.assertIn(str(self.path), message)
        self.assertLessEqual(message.count("\n"), 2)
        gait_file.write(self.path, self.gait)

    def test_a_gait_is_read_back(self):
        found = gait_file.read(self.path, self.model)
        self.assertEqual(found, self.gait)
        np.testing.assert_array_equal(found.values, vector())

    def test_each_refusal_names_what_was_found(self):
        self.refused("schema is 'hydro-trial/1'; expected 'hydro-gait/1'", lambda c: c.update(schema="hydro-trial/1"))
        self.refused("schema is 'list'", text="[]")
        self.refused("is no JSON", text="{")
        self.refused("is 1048577 bytes; expected 1048576 at most", text=" " * (gait_file.LARGEST + 1))
        self.refused("no field 'water'", lambda c: c.pop("water"))
        self.refused("of the robot 'spot' with joints", lambda c: c.update(robot="spot"))
        self.refused("this one is 'b1' with ['FR_hip_joint'", lambda c: c["joints"].reverse())
        self.refused("lacks parameter 'skew'", lambda c: c["parameters"].pop("skew"))
        self.refused("has an unknown parameter 'tail'", lambda c: c["parameters"].update(tail=1))
        self.refused("parameters are [1]", lambda c: c.update(parameters=[1]))
        self.refused(
            "'frequency' is 9.0; expected a number from 0.4 to 2", lambda c: c["parameters"].update(frequency=9.0)
        )
        self.refused("'skew' is 'much'", lambda c: c["parameters"].update(skew="much"))
        self.refused("field 'seed' is 'x'", lambda c: c.update(seed="x"))
        self.refused("the digest is not that of its content", lambda c: c["parameters"].update(skew=0.25))

    def test_a_file_that_is_not_there(self):
        with self.assertRaisesRegex(DataError, "no such file"):
            gait_file.read(self.path.with_name("none.json"), self.model)


@needs_cma
class Learning(unittest.TestCase):
    def setUp(self):
        from hydro_tools.gaits import learning

        self.learning = learning
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.plan = learning.Plan("box", 3, 3, 4, 1.0)

    def learn(self, name, plan=None):
        plan = plan or self.plan
        gait = self.learning.learn(plan, waters.water(plan.water), self.folder / name, 1)
        return gait, (self.folder / name / "state.json").read_bytes()

    def test_a_run_that_was_cut_off_ends_with_the_same_bytes(self):
        gait, state = self.learn("whole")
        cut = json.loads(state)
        cut["scores"] = cut["scores"][:1]
        (self.folder / "cut").mkdir()
        (self.folder / "cut/state.json").write_text(json.dumps(cut))
        self.assertEqual(self.learn("cut"), (gait, state))
        other, _ = self.learn("seed", replace(self.plan, seed=4))
        self.assertNotEqual(other.parameters, gait.parameters)

    def test_the_plan_is_maximised(self):
        # More generations, a better finalist in the water it was learnt in.
        first, _ = self.learn("first", replace(self.plan, generations=1, population=8))
        later, _ = self.learn("later", replace(self.plan, generations=12, population=8))
        self.assertGreater(later.score, first.score)

    def test_a_state_of_another_plan_or_a_broken_one_is_refused(self):
        (self.folder / "out").mkdir()
        path = self.folder / "out/state.json"
        good = {"schema": self.learning.STATE_SCHEMA, "plan": vars(self.plan), "scores": [[0.0] * 4]}
        for change, expected in (
            ({"plan": {**vars(self.plan), "seed": 8}}, "name another --out"),
            ({"schema": "x"}, "name another --out"),
            ({"scores": [[0.0] * 3]}, "remove it to begin anew"),
            ({"scores": [[float("nan")] * 4]}, "scores are not finite"),
            ({"scores": [[0.0] * 4] * 9}, "of more generations than 3"),
            ({"scores": "x"}, "remove it to begin anew"),
        ):
            path.write_text(json.dumps(good | change))
            with self.assertRaisesRegex(DataError, expected):
                self.learn("out")
        path.write_text("{")
        with self.assertRaisesRegex(DataError, "remove it to begin anew"):
            self.learn("out")

    def test_a_killed_command_goes_on_to_the_same_bytes(self):
        def command(name):
            options = ["--generations", "3", "--population", "4", "--seconds", "1", "--seed", "3", "--threads", "1"]
            return [*COMMAND, "learn", "--water", "box", "--out", str(self.folder / name), *options]

        subprocess.run(command("whole"), check=True, capture_output=True)
        killed = subprocess.Popen(command("killed"), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        state = self.folder / "killed/state.json"
        while not state.exists() and killed.poll() is None:
            time.sleep(0.005)
        killed.send_signal(signal.SIGKILL)
        killed.wait()
        subprocess.run(command("killed"), check=True, capture_output=True)
        for name in ("gait.json", "state.json"):
            whole, again = ((self.folder / run / name).read_bytes() for run in ("whole", "killed"))
            self.assertEqual(whole, again, name)
        gait = str(self.folder / "whole/gait.json")
        shown = subprocess.run(
            [*COMMAND, "replay", gait, "--water", "box", "--seconds", "1", "--starts", "1", "--json"],
            check=True,
            capture_output=True,
            text=True,
        ).stdout
        self.assertEqual(json.loads(shown)["swam"], 1.0)
        odd = subprocess.run([*COMMAND, "replay", str(state)], capture_output=True, text=True)
        self.assertEqual(odd.returncode, 1)
        self.assertIn("expected 'hydro-gait/1'", odd.stderr)


class Table(unittest.TestCase):
    def test_a_row_a_gait_and_a_mean_a_water(self):
        way = {"speed": 0.2, "depth_worst": 0.3, "tilt_worst": 12.0, "heading_drift": 5.0, "cost": None, "swam": 30.0}
        drag = {"water": "drag", "seed": 1, "drag": way, "truth": way | {"speed": 0.05}, "strip": way | {"speed": -0.1}}
        truth = {"water": "truth", "seed": 0, "truth": way | {"speed": 0.1, "cost": 0.25}, "strip": way}
        self.assertIn("in strip theory", table.markdown([drag, truth])[0])
        lines = table.markdown([drag, truth])
        self.assertEqual(lines[2], "| drag | 1 | 0.200 | 0.050 | 25% | 50% | 0.30 | 12 | 5 | - | 30 | -0.100 |")
        self.assertIn("| drag | **mean** | **0.200** | **0.050** | **25%** | **50%** |", lines[3])
        self.assertEqual(lines[4], "| truth | 0 | 0.100 | 0.100 | 100% | 100% | 0.30 | 12 | 5 | 0.25 | 30 | 0.200 |")
        drag["drag"] = way | {"speed": 0.01}
        self.assertIn("| 0.010 | 0.050 | - | 50% |", table.markdown([drag, truth])[2])
        self.assertIn("| 25% | - |", table.markdown([drag | {"drag": way}])[2])
        # Waters that stand for strip theory are judged by it, in a table of their own.
        wrench = {"water": "strip-wrench", "seed": 2, "strip-wrench": way, "truth": way, "strip": way | {"speed": 0.1}}
        both = table.markdown([drag, truth, wrench])
        self.assertEqual(both[:7], [*table.markdown([drag, truth]), ""])
        self.assertIn("in MuJoCo's ellipsoid fluid", both[7])
        self.assertIn("| strip-wrench | 2 | 0.200 | 0.100 | 50% | - |", both[9])


class FittedDrag(unittest.TestCase):
    def test_the_drag_of_each_axis_is_found_without_buoyancy_and_written(self):
        from safetensors.numpy import save_file

        random, folder = np.random.default_rng(0), tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        axes = [f"{kind}.{axis}" for kind in ("linear_velocity", "angular_velocity") for axis in "xyz"]
        outputs = [f"{kind}.{axis}" for kind in ("force", "torque") for axis in "xyz"]
        linear, quadratic = np.arange(1.0, 7.0), np.array([0.0, 4.0, 0.5, 2.0, 0.0, 1.0])
        for split in ("train", "test"):
            speed = random.normal(size=(4, 50, 6))
            lift = random.normal(size=speed.shape) * 100
            wrench = lift - linear * speed - quadratic * np.abs(speed) * speed
            arrays = {"x": speed, "wrench_clean": wrench, "hydrostatic": lift}
            arrays = {name: array.astype(np.float32) for name, array in arrays.items()}
            save_file(arrays, Path(folder.name, f"{split}-00000-of-00001.safetensors"))
        manifest = {"features": [{"name": name} for name in axes], "outputs": outputs, "seed": 7}
        Path(folder.name, "manifest.json").write_text(json.dumps(manifest))
        out = Path(folder.name, "drag.json")
        command = [sys.executable, str(SCRIPTS / "fit_drag.py"), "--data", folder.name, "--out", str(out)]
        subprocess.run(command, check=True, capture_output=True)
        found = json.loads(out.read_text())
        np.testing.assert_allclose(found["linear"], linear, atol=1e-3)
        np.testing.assert_allclose(found["quadratic"], quadratic, atol=1e-3)
        self.assertEqual(found["source"], {"seed": 7, "rows": 200})
