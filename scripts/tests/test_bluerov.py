"""The BlueROV2 cases: Fossen's equations against closed forms, the nominal against them, the files."""

import csv
import json
import os
import tempfile
import unittest
from pathlib import Path

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import mujoco
import numpy as np

from hydro_mujoco.plugin import built_library, load_plugin
from hydro_tools.bluerov import case, fossen, manoeuvres, nominal, numbers
from hydro_tools.bluerov.parts import WATER, Part, uncertain, without
from hydro_tools.hidden_cases.frames import rotation
from hydro_tools.hidden_cases.scenes import without_plugins

HOLD, PERIOD = nominal.STEP, case.PERIOD


def driven(vehicle, states, commands, seconds):
    """A run under one command for all time, with steps as long as a row."""
    commands = np.broadcast_to(commands, (len(states), len(numbers.PLACES[vehicle.configuration])))
    rows = round(seconds / PERIOD)
    return fossen.run(vehicle, states, lambda row, *_: commands, rows=rows, period=PERIOD, hold=PERIOD, step=PERIOD)


def command_of(wrench):
    """Thruster commands [8] of a wrench [6]."""
    return np.linalg.pinv(numbers.allocation("heavy")) @ wrench


class ClosedForms(unittest.TestCase):
    def test_allocation_gives_any_wrench_heavy_and_all_but_pitch_standard(self):
        for configuration, rank in (("heavy", 6), ("standard", 5)):
            matrix = numbers.allocation(configuration)
            self.assertEqual(np.linalg.matrix_rank(matrix), rank)
        self.assertEqual(numbers.allocation("heavy")[2, 4], numbers.THRUST)

    def test_terminal_speed_is_the_root_of_the_drag_polynomial(self):
        # Each way alone, no righting moment, so that nothing turns.
        vehicle = without(without(fossen.public(), Part.BUOYANCY_OFFSET), Part.NET_BUOYANCY)
        ways, pushes = [0, 1, 2, 5], np.array([30.0, 30.0, 25.0, 2.0])
        wrenches = np.zeros((4, 6))
        wrenches[range(4), ways] = pushes
        end = driven(vehicle, fossen.resting(4), command_of(wrenches.T).T, 8.0).states[range(4), -1, 7 + np.array(ways)]
        a, b = numbers.QUADRATIC_DRAG[ways], numbers.LINEAR_DRAG[ways]
        np.testing.assert_allclose(end, (-b + np.sqrt(b * b + 4 * a * pushes)) / (2 * a), rtol=1e-3)

    def test_small_rolls_swing_like_a_pendulum(self):
        vehicle = fossen.public()
        for part in (Part.LINEAR_DRAG, Part.QUADRATIC_DRAG, Part.NET_BUOYANCY):
            vehicle = without(vehicle, part)
        states = fossen.resting(1)
        states[0, 3:7] = [np.cos(0.01), np.sin(0.01), 0, 0]
        record = driven(vehicle, states, 0.0, 12.0)
        roll = record.readings[0, :, 4]
        up = np.flatnonzero((roll[1:] > 0) & (roll[:-1] <= 0))
        crossings = PERIOD * (up + roll[up] / (roll[up] - roll[up + 1]))
        arm = numbers.MASS * numbers.GRAVITY * numbers.BUOYANCY_CENTRE[2]
        period = 2 * np.pi * np.sqrt((numbers.INERTIA[0] + numbers.ADDED_MASS[3]) / arm)
        self.assertAlmostEqual(np.diff(crossings).mean(), period, delta=0.005)

    def test_without_drag_energy_and_momentum_are_kept(self):
        vehicle = fossen.public()
        for part in (Part.LINEAR_DRAG, Part.QUADRATIC_DRAG, Part.NET_BUOYANCY, Part.BUOYANCY_OFFSET):
            vehicle = without(vehicle, part)
        states = fossen.resting(1)
        states[0, 7:] = [0.4, -0.3, 0.2, 0.5, -0.8, 1.1]
        record = driven(vehicle, states, 0.0, 4.0)
        matrix = fossen.rigid_body(vehicle)[0] + vehicle.added[0]
        nu = record.states[0, :, 7:]
        momentum = nu @ matrix
        energy = 0.5 * (momentum * nu).sum(1)
        np.testing.assert_allclose(energy, energy[0], rtol=1e-6)
        # Kirchhoff: the linear momentum of body and water stands still in the world.
        world = np.einsum("kij,kj->ki", rotation(record.states[0, :, 3:7]), momentum[:, :3])
        np.testing.assert_allclose(world, np.tile(world[0], (len(world), 1)), atol=1e-5)

    def test_a_steady_current_is_a_frame_that_moves(self):
        # Galileo: what is seen from the water does not know of the current.
        still, stream = without(fossen.public(), Part.NET_BUOYANCY), np.array([0.2, -0.1, 0.05])
        states = fossen.resting(1)
        states[0, 7:] = [0.3, 0.1, -0.1, 0.5, 0.7, 1.2]
        push = command_of(np.array([20.0, -10, 5, 0.3, 0.2, 1]))
        plain = driven(still, states, push, 3.0)
        states[0, 7:10] += rotation(states[:, 3:7])[0].T @ stream
        carried = driven(still.replaced(current=stream[None]), states, push, 3.0)
        shift = carried.states[0, :, :3] - plain.states[0, :, :3]
        np.testing.assert_allclose(shift, np.outer(np.arange(len(shift)) * PERIOD, stream), atol=1e-5)
        np.testing.assert_allclose(carried.states[0, :, 3:7], plain.states[0, :, 3:7], atol=1e-5)

    def test_runge_kutta_is_of_fourth_order(self):
        rng = np.random.default_rng(1)
        states, pilot, _ = manoeuvres.drive(rng, 2, 10, PERIOD, "heavy")
        commands = pilot(5, states[:, :3], states[:, 3:7], states[:, 7:])
        states[:, 7:] = rng.normal(0, 0.4, (2, 6))
        motion = fossen.Motion(fossen.public())
        ends = []
        for count in (10, 20, 160):
            now = [states[:, :3], states[:, 3:7], states[:, 7:]]
            for k in range(count):
                now = motion.step(*now, motion.tau(commands), np.full(2, k / count), 1.0 / count)
            ends.append(np.concatenate(now, 1))
        coarse, fine = (np.abs(end - ends[2]).max() for end in ends[:2])
        # The kinks of |nu| nu cost a little of the order.
        self.assertGreater(np.log2(coarse / fine), 3.0)


class Nominal(unittest.TestCase):
    def test_the_complete_nominal_is_the_truth_where_its_numbers_are(self):
        library = built_library("HYDRO_TEST_LIBRARY")
        if not library.is_file():
            self.skipTest(f"{library}: no plugin library; build it with `cargo build --release`")
        load_plugin(library)
        model = mujoco.MjModel.from_xml_string(nominal.mjcf(WATER, "full"))
        rows = 60
        states, pilot, _ = manoeuvres.drive(np.random.default_rng(0), 2, rows, PERIOD, "heavy")
        record = fossen.run(fossen.public(), states, pilot, rows=rows, period=PERIOD, hold=HOLD, step=0.002)
        noise = np.concatenate([np.full(d, s) for d, s in zip(model.sensor_dim, model.sensor_noise)])
        per_row = round(PERIOD / HOLD)
        for member in range(2):
            data = mujoco.MjData(model)
            data.qpos[:], data.qvel[:] = states[member, :7], states[member, 7:]
            for k in range(rows * per_row):
                row, part = divmod(k, per_row)
                u = record.commands[member, row : row + 2]
                data.ctrl[:] = u[0] + (u[1] - u[0]) * part / per_row
                mujoco.mj_step(model, data)
                off = (data.sensordata - record.readings[member, 2 * k, :16]) / noise
                # Readings of the state at t - timestep, to a hundredth of the noise.
                self.assertLess(np.abs(off).max(), 0.01)

    def test_a_dry_nominal_knows_no_water_and_one_part_less_is_one_part_less(self):
        dry = nominal.mjcf(frozenset(), "full")
        self.assertNotIn("plugin", dry)
        self.assertIn('gravcomp="1"', dry)
        model = mujoco.MjModel.from_xml_string(dry)
        self.assertEqual((model.nv, model.nu, model.opt.density), (6, 8, 0.0))
        for part in WATER:
            xml = nominal.mjcf(WATER - {part}, "dvl")
            mujoco.MjModel.from_xml_string(without_plugins(xml))
            self.assertEqual(f'"{part.value}"' in xml, False)
        self.assertEqual(len(uncertain(WATER)) - len(uncertain(WATER - {Part.LINEAR_DRAG})), 3)


class Files(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.out = Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.before = dict(case.SIZES)
        case.SIZES[True] = (2, 1.2, 1)
        cls.specs = [case.Spec("dry", "full", 3, True), case.Spec("current", "dvl", 3, True)]
        cls.answers = [case.Case(spec).make(cls.out) for spec in cls.specs]

    @classmethod
    def tearDownClass(cls):
        case.SIZES.update(cls.before)

    def test_an_answer_says_what_is_missing_and_how_strongly(self):
        dry, current = self.answers
        self.assertEqual((dry["kind"], current["kind"]), ("several", "single"))
        self.assertEqual({e["effect"] for e in dry["effects"]}, {part.value for part in WATER})
        for effect in dry["effects"]:
            self.assertGreater(effect["strength"]["projected"], 1.0)
            self.assertLess(effect["strength"]["projected"], effect["strength"]["raw"] * 1.01)
            self.assertLess(effect["strength"]["form"], effect["strength"]["projected"])
        self.assertEqual([p["unit"] for p in current["effects"][0]["parameters"]], ["m/s"] * 3)
        self.assertEqual(set(current["distances"]), {part.value for part in Part} - {"current"})

    def test_the_open_half_tells_nothing_and_stands_as_the_contract_says(self):
        for spec in self.specs:
            folder = self.out / "cases" / spec.case_id
            public = json.loads((folder / "case.json").read_text())
            self.assertNotIn("kind", public)
            self.assertEqual(public["uncertainty"]["mass"], 0.002)
            self.assertEqual(len(list((folder / "trials").iterdir())), 2)
            self.assertEqual(len(list((self.out / "sealed" / spec.case_id / "never_shown").iterdir())), 1)

    def test_a_dvl_suite_logs_of_the_position_the_depth_alone(self):
        file = self.out / "cases" / self.specs[1].case_id / "trials" / "trial_00.csv"
        with open(file) as text:
            rows = list(csv.reader(text))
        self.assertIn("position[2]", rows[0])
        self.assertNotIn("position[0]", rows[0])
        self.assertNotIn("attitude[0]", rows[0])
        self.assertEqual(rows[1][0], "0")
        self.assertEqual(set(rows[1][9:]), {""})

    def test_the_same_seed_gives_the_same_bytes(self):
        with tempfile.TemporaryDirectory() as folder:
            case.Case(self.specs[1]).make(Path(folder))
            for name in ("nominal.xml", "trials/trial_01.csv"):
                path = Path("cases") / self.specs[1].case_id / name
                self.assertEqual((Path(folder) / path).read_bytes(), (self.out / path).read_bytes())


if __name__ == "__main__":
    unittest.main()
