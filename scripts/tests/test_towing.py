"""The towing tank: strips against closed forms, wakes and lags, and traces whose truth is known."""

import dataclasses
import subprocess
import sys
import unittest
from unittest import mock

import mujoco
import numpy as np

from hydro_tools.datasets import DataError
from hydro_tools.repository import ROOT, SCRIPTS
from hydro_tools.tank import (
    cell,
    coefficients,
    conditions,
    force,
    geometry,
    motion,
    processing,
    recording,
    shedding,
    wake,
)
from hydro_tools.tank.conditions import Condition, Stance
from hydro_tools.tank.drag import DENSITY, Strips
from hydro_tools.tank.geometry import Body, Link

X, Y, Z = np.eye(3)
STANCE = Stance(0.5, -1.3, "x")
#: Directions that the tank does not tow along, for symmetry.
MIRRORED = {"-y": (0.0, -1.0), "x-y": (np.sqrt(0.5), -np.sqrt(0.5))}


def bar(name="bar", at=(0.0, 0.0, 0.0), length=1.0, breadths=(0.08, 0.05), strips=4, part="thigh"):
    """An upright bar whose section axes are x and y."""
    start = np.asarray(at, float)
    return Link(name, part, start, start - length * Z, X, Y, breadths, strips)


def ball(radius=0.04):
    return Link("ball", "foot", radius * Z, -radius * Z, X, Y, (2 * radius, 2 * radius), 1, ball=True)


def total(strips, velocity):
    """Drag [3] of strips that all move alike."""
    return strips.drag(np.broadcast_to(velocity, strips.body.centre.shape)).sum(axis=0)


class Drag(unittest.TestCase):
    def test_a_bar_across_the_flow(self):
        # Half rho C D L U^2: along x the flow meets 0.05 m of breadth, behind which the bar is 0.08 m deep.
        strips, speed = Strips(Body((bar(),))), 0.4
        reynolds = speed * 0.05 / 1e-6
        fall = 1 - 0.25 / (1 + np.exp(-(np.log10(reynolds) - 4.9) / 0.15))
        coefficient = coefficients.section_drag(0.08 / 0.05, 0.10) * 0.81 * fall  # length / breadth = 20
        expected = 0.5 * DENSITY * coefficient * 0.05 * 1.0 * speed**2
        np.testing.assert_allclose(total(strips, speed * X), [-expected, 0, 0], atol=1e-12)

    def test_tabulated_sections(self):
        for (depth, corner), expected in {
            (0.5, 0): 2.5,
            (1, 0): 2.2,
            (2, 0): 1.6,
            (1, 0.167): 1.2,
            (2, 0.167): 0.7,
        }.items():
            self.assertAlmostEqual(coefficients.section_drag(depth, corner), expected)

    def test_a_ball(self):
        # Re = 4e4: 24/Re + 6/(1 + 200) + 0.4 on pi r^2, in any direction.
        expected = 0.5 * DENSITY * (24 / 4e4 + 6 / 201 + 0.4) * np.pi * 0.04**2 * 0.5**2
        strips = Strips(Body((ball(),)))
        for direction in (X, Z, np.array([0.6, 0.0, 0.8])):
            np.testing.assert_allclose(total(strips, 0.5 * direction), -expected * direction, atol=1e-12)

    def test_flow_along_a_bar_does_not_change_the_force_across(self):
        strips = Strips(Body((bar(),)))
        across, both = total(strips, 0.3 * X), total(strips, 0.3 * X + 0.5 * Z)
        np.testing.assert_allclose(both[:2], across[:2], rtol=1e-12)
        self.assertLess(both[2], 0)

    def test_along_a_bar_there_are_its_ends_and_its_skin(self):
        strips, speed = Strips(Body((bar(length=0.63),))), 0.5
        # A square rod of length over breadth 10: 0.95, half of it open; ITTC-1957 on the wetted surface.
        skin = 0.075 / (np.log10(speed * 0.63 / 1e-6) - 2) ** 2 * 2 * (0.08 + 0.05) * 0.63
        expected = 0.5 * DENSITY * (0.5 * 0.95 * 0.08 * 0.05 + skin) * speed**2
        np.testing.assert_allclose(total(strips, speed * Z), [0, 0, -expected], atol=1e-12)

    def test_every_strip_loses_energy(self):
        strips, rng = force.prepared(STANCE)[0], np.random.default_rng(0)
        velocity = rng.normal(0, 0.5, (200, *strips.body.centre.shape))
        power = np.sum(strips.drag(velocity) * velocity, axis=-1)
        self.assertTrue((power < 0).all())

    def test_only_the_velocity_relative_to_the_water_counts(self):
        strips = force.prepared(STANCE)[0]
        robot, stream = np.array([0.3, 0.1, 0.0]), np.array([0.2, -0.4, 0.1])
        shape = strips.body.centre.shape
        moved = strips.drag(np.broadcast_to(robot + stream, shape) - np.broadcast_to(stream, shape))
        np.testing.assert_allclose(moved.sum(axis=0), total(strips, robot), rtol=1e-12)
        np.testing.assert_array_equal(total(strips, 0 * robot), 0)

    def test_more_strips_change_nothing_in_uniform_flow(self):
        coarse, fine = (Strips(Body((bar(strips=n),))) for n in (1, 7))
        velocity = np.array([0.2, 0.3, -0.1])
        np.testing.assert_allclose(total(coarse, velocity), total(fine, velocity), rtol=1e-12)


class AddedMass(unittest.TestCase):
    def test_a_square_bar(self):
        mass = Strips(Body((bar(breadths=(0.06, 0.06)),))).added_mass()
        self.assertAlmostEqual(mass[0, 0], 1.51 * DENSITY * np.pi * 0.03**2)
        self.assertAlmostEqual(mass[1, 1], mass[0, 0])
        np.testing.assert_allclose(mass, np.diag(np.diag(mass)), atol=1e-12)

    def test_a_ball_carries_half_of_what_it_displaces(self):
        mass = Strips(Body((ball(0.04),))).added_mass()
        np.testing.assert_allclose(mass, np.eye(3) * 0.5 * DENSITY * 4 / 3 * np.pi * 0.04**3, atol=1e-12)

    def test_it_acts_while_the_carriage_changes_speed_and_never_else(self):
        path, marks = motion.tows((Condition(0),), 0.02)
        added = force.along(path, None).added
        mark = marks[0]
        ramps = ((path.time > mark.leave) & (path.time < mark.reach)) | (
            (path.time > mark.brake) & (path.time < mark.stop)
        )
        np.testing.assert_allclose(added[~ramps], 0, atol=1e-9)
        mass = force.prepared(Condition(0).stance)[0].added_mass()
        middle = int(np.argmin(np.abs(path.time - (mark.leave + motion.RAMP / 2))))
        peak = 0.2 * np.pi / 2 / motion.RAMP
        np.testing.assert_allclose(added[middle], -mass @ (peak * X), rtol=1e-6, atol=1e-9)


class Wake(unittest.TestCase):
    def pair(self, apart=0.5):
        return Strips(Body((bar("front"), bar("rear", at=(-apart, 0, 0)))))

    def test_behind_a_bar_it_is_that_of_huse(self):
        strips = self.pair()
        found = wake.wakes(strips, X)
        front = strips.drag(np.broadcast_to(wake.REFERENCE_SPEED * X, (8, 3)))[:4, 0].sum()
        coefficient = -front / (0.5 * DENSITY * 0.05 * wake.REFERENCE_SPEED**2)
        expected = np.sqrt(coefficient * 0.05 / (0.5 + 4 * 0.05 / coefficient))
        np.testing.assert_allclose(found.share[4:, 0], expected, rtol=1e-9)
        np.testing.assert_allclose(found.travel[4:, 0], wake.DRIFT * 0.5)

    def test_it_lies_downstream_only(self):
        found = wake.wakes(self.pair(), X)
        np.testing.assert_array_equal(found.share[:4], 0)
        np.testing.assert_array_equal(wake.wakes(self.pair(), -X).share[4:], 0)
        self.assertTrue((wake.wakes(self.pair(), Y).share < 1e-9).all())

    def test_a_strip_feels_it_after_the_robot_has_gone_the_way(self):
        # A rear leg of the robot: its steady drag in a tow falls once the front leg's wake has come.
        path, marks = motion.tows((Condition(3 * 3),), 0.02)
        steady = force._steady(path)
        strips, found = force.prepared(path.stances[0])
        strip = int(
            np.argmax(
                found.share[:, [link.name == "FR_calf" for link in strips.body.links]].max(axis=1)
                * (strips.body.centre[:, 0] < -0.3)
            )
        )
        gone = force._path(path) - np.interp(marks[0].leave, path.time, force._path(path))
        arrival = found.travel[strip][found.share[strip] > 0.05].max()
        self.assertGreater(arrival, 0.3)
        cruising = path.time > marks[0].reach
        alone = steady[cruising & (gone < 0.9 * found.travel[strip][found.share[strip] > 0.05].min()), strip, 0]
        later = steady[cruising & (gone > arrival + 0.1) & (path.time < marks[0].brake), strip, 0]
        undisturbed = strips.drag(np.broadcast_to(Condition(9).speed * X, strips.body.centre.shape))[strip, 0]
        self.assertGreater(len(alone), 5)
        np.testing.assert_allclose(alone, undisturbed, rtol=1e-6)
        self.assertTrue((np.abs(later) < 0.9 * abs(undisturbed)).all())

    def test_water_in_a_wake_follows_and_never_leads(self):
        for name in conditions.DIRECTIONS:
            strips, found = force.prepared(Stance(1.5, -0.75, name))
            self.assertTrue((found.share >= 0).all())
            np.testing.assert_array_less(
                np.abs(force.developed(Stance(1.5, -0.75, name), 0.4)[:2]).sum(),
                np.abs(total(strips, 0.4 * Stance(1.5, -0.75, name).unit)[:2]).sum(),
            )


class Tow(unittest.TestCase):
    def test_a_long_tow_settles_to_the_developed_force(self):
        path, marks = motion.tows(conditions.of_run(27), 0.02)
        forces = force.along(path, None)
        for condition, mark in zip(conditions.of_run(27), marks):
            rows = (path.time > mark.brake - 2) & (path.time < mark.brake - 0.1)
            np.testing.assert_allclose(
                forces.drag[rows].mean(axis=0), force.developed(condition.stance, condition.speed), atol=0.01
            )

    def test_at_rest_before_the_first_tow_there_is_no_force(self):
        path, marks = motion.tows((Condition(5),), 0.02)
        np.testing.assert_array_equal(
            force.along(path, np.random.default_rng(0)).total[path.time < marks[0].leave - 0.1], 0
        )

    def test_force_opposes_the_tow(self):
        for index in range(0, conditions.COUNT, 7):
            condition = Condition(index)
            self.assertLess(force.developed(condition.stance, condition.speed) @ condition.stance.unit, 0)

    def test_mirrored_direction_mirrors_the_force(self):
        with mock.patch.dict(conditions.DIRECTIONS, MIRRORED):
            for name, mirror in (("y", "-y"), ("xy", "x-y")):
                there, back = (force.developed(Stance(0.5, -1.85, d), 0.3) for d in (name, mirror))
                np.testing.assert_allclose(back, there * [1, -1, 1], atol=1e-9)
        np.testing.assert_allclose(force.developed(Stance(0.5, -1.85, "x"), 0.3)[1], 0, atol=1e-9)

    def test_it_is_no_plain_square_of_the_speed(self):
        for name in conditions.DIRECTIONS:
            slow, fast = (
                force.developed(Stance(0.5, -1.3, name), speed) @ Stance(0.5, -1.3, name).unit for speed in (0.2, 0.5)
            )
            self.assertGreater(abs(fast / slow / 6.25 - 1), 0.005)
        # Nor does 45 degrees follow from the two axes.
        x, y, xy = (force.developed(Stance(0.5, -1.3, name), 0.4) for name in ("x", "y", "xy"))
        self.assertGreater(abs(xy[1] - y[1] * 0.5), 1.0)

    def test_half_the_step_gives_the_same_force(self):
        coarse, fine = (force.along(motion.tows((Condition(7),), step)[0], None).total for step in (0.02, 0.01))
        difference = np.abs(fine[::2][: len(coarse)] - coarse)
        self.assertLess(difference.max(), 0.15)
        self.assertLess(difference.mean(), 0.01)

    def test_drag_builds_up_as_an_exponential_in_the_way_gone(self):
        path = motion.switching((Condition(0),), samples=100, period=0.1, substeps=4)
        start = dataclasses.replace(path, underway=False)
        steady = np.zeros((len(path.speed), 48, 3))
        steady[:, 0, 0] = 1.0
        breadth = np.sqrt(0.30 * 0.15)
        expected = 0.5 + 0.5 * (1 - np.exp(-path.time * 0.2 / (2 * breadth)))
        np.testing.assert_allclose(force._lagged(start, steady)[:, 0], expected, atol=1e-12)


class Switching(unittest.TestCase):
    def test_no_sample_falls_on_a_switch(self):
        path = motion.switching(tuple(Condition(i) for i in (0, 100, 50)), samples=10, period=0.1, substeps=4)
        self.assertEqual(len(path.speed), 120)
        np.testing.assert_array_equal(path.stance[::4], np.repeat([0, 1, 2], 10))
        self.assertEqual(int(np.flatnonzero(np.diff(path.stance))[0]), 4 * 10 - 3)

    def test_first_condition_has_lasted_for_ever_and_the_next_takes_its_time(self):
        sequence = (Condition(9), Condition(10), Condition(11))
        path = motion.switching(sequence, samples=200, period=0.1, substeps=4)
        found = force.along(path, None).total[::4]
        before, after = (force.developed(c.stance, c.speed) for c in sequence[:2])
        np.testing.assert_allclose(found[:200], np.broadcast_to(before, (200, 3)), atol=1e-9)
        np.testing.assert_allclose(found[399], after, atol=0.02)
        # At the next sample it has neither stayed nor arrived.
        self.assertGreater(np.linalg.norm(found[200] - after), 0.1 * np.linalg.norm(before - after))
        self.assertGreater(np.linalg.norm(found[200] - before), 0.1 * np.linalg.norm(before - after))

    def test_there_is_no_impulse_in_a_sample(self):
        path = motion.switching((Condition(0), Condition(191)), samples=10, period=0.1, substeps=4)
        np.testing.assert_array_equal(force.along(path, None).added, 0)


class Vortices(unittest.TestCase):
    def test_unit_variance_at_the_shedding_frequency(self):
        rate = np.full((40000, 4), 2 * np.pi * 1.5)
        found = shedding.oscillate(rate, 0.02, np.random.default_rng(3))
        self.assertAlmostEqual(found.std(), 1.0, delta=0.1)
        spectrum = np.mean(np.abs(np.fft.rfft(found, axis=0)) ** 2, axis=1)
        spectrum = np.convolve(spectrum, np.ones(40), "same")
        self.assertAlmostEqual(np.fft.rfftfreq(40000, 0.02)[np.argmax(spectrum)], 1.5, delta=0.15)

    def test_lift_is_across_link_and_flow(self):
        lift, hertz = shedding.lift(bar(), X, DENSITY)
        np.testing.assert_allclose(lift, [0, lift[1], 0], atol=1e-12)
        self.assertAlmostEqual(abs(lift[1]), 0.5 * DENSITY * shedding.LIFT * 0.05)
        self.assertAlmostEqual(hertz, 0.2 / 0.05)
        np.testing.assert_allclose(shedding.lift(bar(), Z, DENSITY)[0], 0, atol=1e-12)


class Geometry(unittest.TestCase):
    def test_feet_and_knees_are_where_mujoco_has_them(self):
        model = mujoco.MjModel.from_xml_path(str(ROOT / "mjcf/b1.xml"))
        data = mujoco.MjData(model)
        thigh, calf = 0.7, -1.6
        data.qpos[:7] = [0, 0, 0, 1, 0, 0, 0]
        data.qpos[7:] = np.tile([0, thigh, calf], 4)
        mujoco.mj_kinematics(model, data)
        by_name = {link.name: link for link in geometry.links(thigh, calf)}
        for leg in ("FR", "FL", "RR", "RL"):
            np.testing.assert_allclose(by_name[f"{leg}_thigh"].start, data.body(f"{leg}_thigh").xpos, atol=1e-12)
            np.testing.assert_allclose(by_name[f"{leg}_calf"].start, data.body(f"{leg}_calf").xpos, atol=1e-12)
            calf_frame = data.body(f"{leg}_calf")
            foot = calf_frame.xpos + calf_frame.xmat.reshape(3, 3) @ [0, 0, -0.35]
            found = by_name[f"{leg}_foot"]
            np.testing.assert_allclose((found.start + found.end) / 2, foot, atol=1e-12)

    def test_shapes(self):
        body = geometry.body(0.5, -1.3)
        self.assertEqual(
            (len(body.links), body.centre.shape, body.axes.shape, body.breadth.shape),
            (17, (48, 3), (48, 3, 3), (48, 2)),
        )
        np.testing.assert_allclose(
            np.einsum("sij,skj->sik", body.axes, body.axes), np.tile(np.eye(3), (48, 1, 1)), atol=1e-12
        )
        along = np.array([(link.end - link.start) / link.length for link in body.links])[body.link]
        np.testing.assert_allclose(np.abs(np.einsum("si,si->s", body.axes[:, 2], along)), 1, atol=1e-12)


class Conditions(unittest.TestCase):
    def test_there_are_192_different_ones(self):
        found = np.array([Condition(i).features for i in range(conditions.COUNT)])
        self.assertEqual(found.shape, (192, 4))
        self.assertEqual(len(np.unique(found, axis=0)), 192)
        np.testing.assert_allclose(np.unique(np.round(np.hypot(found[:, 2], found[:, 3]), 9)), conditions.SPEEDS)
        self.assertEqual(len({Condition(i).configuration for i in range(192)}), 16)

    def test_a_number_out_of_range_is_refused(self):
        for index in (-1, 192):
            with self.assertRaisesRegex(ValueError, f"condition {index}: expected 0 to 191"):
                Condition(index)

    def test_angles_outside_the_limits_are_refused(self):
        with (
            mock.patch.object(conditions, "CALVES", (-2.4, -0.5)),
            self.assertRaisesRegex(ValueError, "FR_calf.*-2.6 to -0.6"),
        ):
            conditions._inside_limits()


def synthetic(offset=(3.0, -2.0, -40.0), drift=(0.02, -0.01, 0.0), mean=(-5.0, -9.0, 1.0), vibration=1.0):
    """A run of one tow of condition 0 whose force is `mean` at speed."""
    path, marks = motion.tows((Condition(0),), 1 / cell.RATE)
    share = path.speed / 0.2
    water = share[:, None] * np.array(mean)
    reading = (
        water
        + np.array(offset)
        + np.array(drift) * path.time[:, None]
        + vibration * np.sin(2 * np.pi * 8 * path.time)[:, None]
    )
    mark = marks[0]
    return recording.Run(
        reading,
        cell.RATE,
        np.array([0], np.int32),
        np.array([[mark.leave, mark.reach, mark.brake, mark.stop]]),
        motion.REST,
        water,
        cell.RATE,
    )


class Processing(unittest.TestCase):
    def test_offset_drift_and_vibration_are_taken_off(self):
        found = processing.steady(synthetic(), 0.0)[0]
        np.testing.assert_allclose(found.force, np.tile([-5.0, -9.0], (len(found.time), 1)), atol=0.01)
        np.testing.assert_allclose(found.mean, [-5.0, -9.0], atol=2e-3)

    def test_start_up_and_brake_are_cut(self):
        run = synthetic()
        found = processing.steady(run, 0.0)[0]
        _, reach, brake, _ = run.marks[0]
        self.assertGreaterEqual(found.time[0], reach + 4.0 / 0.2)
        self.assertLess(found.time[-1], brake - 0.99)

    def test_bridge_is_that_of_drawn_walks(self):
        rng, steps = np.random.default_rng(0), 400
        walks = np.cumsum(rng.normal(0, np.sqrt(10 / steps), (4000, steps)), axis=1)
        bridged = walks - walks[:, -1:] * np.arange(1, steps + 1) / steps
        part = bridged[:, int(0.3 * steps) : int(0.8 * steps)].mean(axis=1)
        self.assertAlmostEqual(part.var() / processing.bridge(3.0, 8.0, 10.0), 1.0, delta=0.1)

    def test_mean_force_is_found_within_its_error(self):
        runs = [recording.tow(11, 0, number) for number in range(0, conditions.RUNS, 4)]
        runs = [dataclasses.replace(run, truth=np.full_like(run.truth, np.nan)) for run in runs]  # it must not look
        intensity = float(np.mean([processing.walk(run) for run in runs]))
        self.assertAlmostEqual(intensity / cell.DRIFT_WALK**2, 1.0, delta=0.5)
        parts = [part for run in runs for part in processing.steady(run, intensity)]
        error = np.array([part.error for part in parts])
        missed = np.array(
            [part.mean - force.developed(part.condition.stance, part.condition.speed)[:2] for part in parts]
        )
        self.assertLess(error.max(), 0.3)
        self.assertLess(np.abs(missed / error).max(), 4.0)
        self.assertAlmostEqual(np.sqrt(np.mean((missed / error) ** 2)), 1.0, delta=0.25)
        # What is left of the raw offsets would be noticed.
        raw = np.array([run.reading[:, :2].mean(axis=0) for run in runs])
        self.assertGreater(np.abs(raw).max(), 1.0)

    def test_unusable_runs_are_refused(self):
        run = synthetic()
        broken = run.reading.copy()
        broken[100, 1] = np.nan
        for change, words in (
            ({"reading": broken}, "1 numbers that are none"),
            ({"reading": run.reading[:, :2]}, "expected finite readings"),
            ({"reading": run.reading[:3000]}, "lacks the 6.0 s of rest"),
            ({"marks": run.marks - [0, 0, 33.0, 0]}, "condition 0: no steady part"),
        ):
            with self.assertRaisesRegex(DataError, words):
                processing.steady(dataclasses.replace(run, **change), 0.0)
        with self.assertRaisesRegex(DataError, "a run of 1 tow does not show how its zero wanders"):
            processing.steady(run)


class Cell(unittest.TestCase):
    def test_at_rest_it_shows_wet_weight_and_zero(self):
        run = recording.tow(0, 0, 0)
        rest = run.reading[: round(run.rest * run.rate)].mean(axis=0)
        self.assertAlmostEqual(rest[2], cell.WET_WEIGHT, delta=cell.ZERO + 1)
        self.assertTrue((np.abs(rest[:2]) < cell.ZERO + 1).all())

    def test_a_run_depends_on_seed_repeat_and_number_alone(self):
        first, again = recording.tow(3, 0, 5), recording.tow(3, 0, 5)
        np.testing.assert_array_equal(first.reading, again.reading)
        for other in (recording.tow(4, 0, 5), recording.tow(3, 1, 5)):
            self.assertFalse(np.array_equal(first.reading, other.reading))

    def test_the_tank_needs_no_mujoco(self):
        code = "import sys, hydro_tools.commands.gen_task1, hydro_tools.tank.figures; sys.exit('mujoco' in sys.modules)"
        self.assertEqual(subprocess.run([sys.executable, "-c", code], cwd=SCRIPTS).returncode, 0)


if __name__ == "__main__":
    unittest.main()
