"""Real measurements as trials: what is written, where the release is, what SciPy finds. Skipped without the data."""

import subprocess
import sys
import tempfile
import unittest
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np

from hydro_tools.datasets.measured import MeasuredError, ball_drops, captive, crazyflie, glider, roll_decay
from hydro_tools.datasets.measured.trial import Trial, write
from hydro_tools.repository import ROOT, SCRIPTS
from test_gap import program

DATA = ROOT.parent / "shared" / "data"
FILES = (roll_decay.FILE, ball_drops.FILE, crazyflie.FILE, captive.FILE, glider.FILE)
HAVE_DATA = all((DATA / name).is_file() for name in FILES)
WITHOUT = f"the measurements are not in {DATA}"
# Trials by case.
CASES = {"roll_decay": 1, **dict.fromkeys(ball_drops.BALLS, 2), "crazyflie_normal": 6, "crazyflie_weight": 4}

try:
    from hydro_tools.datasets.measured import reference
except ImportError:
    reference = None


class Scenes(unittest.TestCase):
    def load(self, case):
        return mujoco.MjModel.from_xml_path(str(ROOT / "mjcf/gap" / f"{case}.xml"))

    def test_roll_has_the_published_period_and_decrement(self):
        model = self.load("roll_decay")
        data = mujoco.MjData(model)
        data.qpos[0] = 0.001
        angles = []
        for _ in range(int(20 * 2.54 / model.opt.timestep)):
            mujoco.mj_step(model, data)
            angles.append(data.qpos[0])
        angles = np.array(angles)
        falls = np.flatnonzero((angles[:-1] > 0) & (angles[1:] <= 0))
        self.assertAlmostEqual(np.diff(falls).mean() * model.opt.timestep, 2.54, delta=0.002)
        peaks = [angles[a:b].max() for a, b in zip(falls[:-1], falls[1:])]
        # Published: the amplitude of a cycle falls by 0.0091 of itself where it is small.
        self.assertAlmostEqual(1 - peaks[-1] / peaks[-2], 0.0091, delta=1e-4)

    def test_balls_fall_as_in_vacuum(self):
        for case in ball_drops.BALLS:
            model = self.load(case)
            data = mujoco.MjData(model)
            mujoco.mj_step(model, data, 2000)
            self.assertAlmostEqual(data.qpos[0], -0.5 * 9.81 * 4, delta=0.011, msg=case)

    def test_a_crazyflie_hovers_at_its_weight_and_rolls_to_the_right_by_its_left_motors(self):
        model = self.load("crazyflie")
        data = mujoco.MjData(model)
        hover = 0.0378 * 9.81 / 4 / 2.245e-6
        data.ctrl[:] = data.act[:] = hover
        mujoco.mj_step(model, data, 500)
        np.testing.assert_allclose(data.qpos, 0.0, atol=1e-6)
        data.ctrl[2:] = 1.01 * hover
        mujoco.mj_step(model, data, 20)
        self.assertGreater(data.qpos[1], 0.0)


class Files(unittest.TestCase):
    def test_rows_are_labelled_a_step_late(self):
        trial = Trial("a", np.array([3.0, 3.1]), {"height": np.array([1.0, 2.0])}, 1.0, 0.5)
        with tempfile.TemporaryDirectory() as folder, np.load(write(trial, Path(folder), 0.001)) as file:
            np.testing.assert_allclose(file["sensordata_times"], [0.001, 0.101])
            np.testing.assert_array_equal(file["sensordata_data"], [[1.0], [2.0]])
            np.testing.assert_array_equal(file["initial_state"], [0.0, 1.0, 0.5])
            self.assertEqual(file["control_data"].shape, (2, 0))
            self.assertEqual(str(file["sensordata_signal_mapping"]), '{"height": [0, [0]]}')

    def test_absent_data_are_named(self):
        with self.assertRaisesRegex(MeasuredError, "--data"):
            roll_decay.read(Path("nowhere"))
        with tempfile.TemporaryDirectory() as out:
            done = subprocess.run(
                [sys.executable, SCRIPTS / "real_data.py", "--data", "nowhere", "--out", out],
                capture_output=True,
                text=True,
            )
        self.assertEqual(done.returncode, 1)
        self.assertIn("roll_decay_kvlcc2_zero_speed.csv is not there", done.stderr)


class Hops(unittest.TestCase):
    def test_what_flies_lies_between_take_off_and_landing(self):
        rows = np.zeros((900, 8))
        rows[:, 0] = 0.01 * np.arange(900)
        for first, end in ((100, 400), (500, 550), (600, 900)):
            rows[first:end, 1], rows[first:end, 4:] = 0.5, 40000.0
        # Drift on the floor, motors off.
        rows[420:480, 1] = 0.15
        self.assertEqual(crazyflie.hops(rows), [slice(100, 400), slice(600, 900)])

    def test_commands_act_from_the_samples_own_time(self):
        trial = Trial("a", np.array([0.0, 0.1]), {"roll": np.zeros(2)}, controls={"m1": [1, 2], "m2": [3, 4]})
        with tempfile.TemporaryDirectory() as folder, np.load(write(trial, Path(folder), 0.002)) as file:
            np.testing.assert_allclose(file["control_times"], [0.0, 0.1])
            np.testing.assert_allclose(file["sensordata_times"], [0.002, 0.102])
            np.testing.assert_array_equal(file["control_data"], [[1.0, 3.0], [2.0, 4.0]])
            self.assertNotIn("initial_state", file)


class Captive(unittest.TestCase):
    """A hull towed with its bow to starboard of the course, and water that pushes it as water does."""

    def test_signs_are_those_of_a_load_cell_in_mujoco(self):
        # To starboard of the bow goes the hull: v > 0, a negative drift angle. The water pushes it to port, ahead
        # of midships, and against the course.
        forces = {"X": -30.0, "Y": -550.0, "N": -760.0}
        pressure = 0.5 * 1000 * 7**2 * 1.2**2
        row = [np.radians(-30), 1.2, forces["X"] / pressure, forces["Y"] / pressure, forces["N"] / pressure / 7]
        columns = captive.steady(np.array([row])).columns
        model = mujoco.MjModel.from_xml_path(str(ROOT / "mjcf/gap/captive_kvlcc2.xml"))
        data = mujoco.MjData(model)
        data.qvel[0], data.qpos[2] = columns["tow_vel"][0], columns["yaw"][0]
        mujoco.mj_forward(model, data)
        hull = model.body("hull").id
        velocity = np.zeros(6)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, hull, velocity, 1)
        # Ahead, and to starboard: in MuJoCo y points to port.
        np.testing.assert_allclose(velocity[3:5], [1.2 * np.cos(np.pi / 6), -1.2 * np.sin(np.pi / 6)])
        # The water's force and torque on the hull at the load cell: forward, port, up, in the world.
        turn = data.body("hull").xmat.reshape(3, 3)
        at = data.site("load_cell").xpos - data.xipos[hull]
        force = turn @ [forces["X"], -forces["Y"], 0.0]
        torque = turn @ [0.0, 0.0, -forces["N"]] + np.cross(at, force)
        data.xfrc_applied[hull] = np.concatenate([force, torque])
        # What holds the carriage at constant speed.
        mujoco.mj_forward(model, data)
        needed = np.zeros(model.nv)
        mujoco.mj_mulM(model, data, needed, data.qacc)
        data.qfrc_applied[:] = -needed
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(data.qacc, 0, atol=1e-9)
        read = {"force": data.sensor("force").data, "torque": data.sensor("torque").data}
        self.assertAlmostEqual(read["force"][0], columns["force[0]"][0], places=6)
        self.assertAlmostEqual(read["force"][1], columns["force[1]"][0], places=6)
        self.assertAlmostEqual(read["torque"][2], columns["torque[2]"][0], places=6)
        # The sign in words: with the weight off, the sensor shows what the parent exerts on the child.
        self.assertAlmostEqual(read["force"][2], 3272 * 9.81, places=6)


class Release(unittest.TestCase):
    def test_second_extremum_and_its_state(self):
        time = np.arange(0.0, 20.0, 0.01)
        free = np.maximum(time - 2.0, 0.0)
        roll = np.where(time < 2.0, -0.1 * time, -0.2 * np.cos(2.5 * free) * np.exp(-0.02 * free))
        row = roll_decay.free_from(time, roll)
        self.assertAlmostEqual(time[row], 2.0 + np.pi / 2.5, delta=0.02)
        angle, rate = roll_decay.initial_state(time, roll, row)
        # The parabola cuts an extremum by (w t)^4 / 24 of it at most.
        self.assertAlmostEqual(angle, roll[row], delta=0.002 * roll[row])
        self.assertAlmostEqual(rate, 0.0, delta=0.01)

    def test_start_of_a_fall(self):
        time = np.arange(0.0, 1.0, 1 / 15)
        height, speed = ball_drops.initial_state(time, 40.0 - 2.0 * time - 0.5 * 9.81 * time**2)
        self.assertAlmostEqual(height, 40.0)
        self.assertAlmostEqual(speed, -2.0)


@unittest.skipUnless(HAVE_DATA, WITHOUT)
class Measured(unittest.TestCase):
    def test_every_case_is_written(self):
        with tempfile.TemporaryDirectory() as out:
            done = subprocess.run(
                [sys.executable, SCRIPTS / "real_data.py", "--out", out], capture_output=True, text=True
            )
            self.assertEqual(done.returncode, 0, done.stderr)
            for case, count in CASES.items():
                model = mujoco.MjModel.from_xml_path(str(Path(out, case, "nominal.xml")))
                size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
                files = sorted(Path(out, case, "trials").glob("*.npz"))
                self.assertEqual(len(files), count)
                for path in files:
                    with np.load(path) as file:
                        if "initial_state" in file:
                            self.assertEqual(file["initial_state"].shape, (size,))
                        self.assertEqual(file["control_data"].shape[1], model.nu)
                        self.assertTrue(np.isfinite(file["sensordata_data"]).all())
                        self.assertTrue((np.diff(file["sensordata_times"]) > 0).all())
            for case in (captive.CASE, glider.CASE):
                mujoco.MjModel.from_xml_path(str(Path(out, case, "nominal.xml")))
            table = np.genfromtxt(Path(out, captive.CASE, "trials", "steady.csv"), delimiter=",", names=True)
            self.assertEqual(len(table), 18)
            # The largest side force, published as 0.0166 of 1/2 rho L^2 U^2.
            self.assertAlmostEqual(max(abs(table["force1"])), 558, delta=1)
            dives = sorted(Path(out, glider.CASE, "trials").glob("*.csv"))
            self.assertEqual(len(dives), 18)
            for path in dives:
                dive = np.genfromtxt(path, delimiter=",", names=True)
                self.assertTrue((dive["height"] < -5).all() and dive["height"].min() > -43)
                self.assertTrue((np.diff(dive["time"]) > 0).all())

    @unittest.skipUnless(program(), "no `hydro` is built: cargo build")
    def test_the_nominal_follows_a_dive_though_nothing_measures_how_far_ahead_it_is(self):
        with tempfile.TemporaryDirectory() as out:
            nominal = ROOT / "mjcf/gap/glider.xml"
            dive, trials = glider.trials(DATA)[0], Path(out, "trials")
            trials.mkdir()
            glider.write(dive, trials, mujoco.MjModel.from_xml_path(str(nominal)).opt.timestep)
            command = [program(), "gap", "find", "--model", nominal, "--trials", trials, "--out", f"{out}/gap"]
            ran = subprocess.run(command, capture_output=True, text=True)
            self.assertEqual(ran.returncode, 0, ran.stderr)

    @unittest.skipIf(reference is None, "scipy is not installed")
    def test_scipy_finds_the_published_quadratic_damping(self):
        trial = roll_decay.trials(DATA)[0]
        # The large amplitudes: with the whole minute SciPy takes three times as long.
        first = slice(0, len(trial.time) * 3 // 10)
        sensors = {name: values[first] for name, values in trial.sensors.items()}
        trial = replace(trial, time=trial.time[first], sensors=sensors)
        fit = reference.roll(trial, 134.3, 821.9, 816.0, 0.962)
        # Published decrement 0.0045 a degree and cycle: d = 3/8 0.0045 180/pi = 0.0967 1/rad, times the inertia.
        self.assertAlmostEqual(fit["quadratic"].value, 0.0967 * 134.3, delta=0.06 * 0.0967 * 134.3)
        self.assertGreater(fit["quadratic"].log_evidence, fit["nominal"].log_evidence + 10)

    @unittest.skipIf(reference is None, "scipy is not installed")
    def test_scipy_finds_drag_on_a_volleyball_and_none_on_a_bowling_ball(self):
        light = reference.ball(ball_drops.trials(DATA, "ball_volleyball"))
        self.assertGreater(light["quadratic"].log_evidence, light["none"].log_evidence + 10)
        heavy = reference.ball(ball_drops.trials(DATA, "ball_bowling_ball"))
        self.assertLess(heavy["quadratic"].log_evidence, heavy["none"].log_evidence)


if __name__ == "__main__":
    unittest.main()
