"""Real to sim: known coefficients recovered, unseen ones named, held-out tows unseen, tables refused."""

import functools
import json
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from unittest import mock

import mujoco
import numpy as np
from scipy.optimize import lsq_linear

from hydro_tools.commands import real_to_sim
from hydro_tools.datasets import DataError, scene
from hydro_tools.identification import blocks, fit, identifiability, measurements, split, study, uncertainty
from hydro_tools.identification.coefficients import DEFAULT, LARGEST, NAMES, OFFSETS, by_part, kind
from hydro_tools.identification.measurements import Measurements
from hydro_tools.identification.water import NOMINAL, Water
from hydro_tools.repository import ROOT, SCRIPTS
from hydro_tools.robot import files, identified
from hydro_tools.tank import campaign, conditions

ERROR = 0.05  # N


def plan(configurations, speeds=(0.2, 0.5)):
    """Tows in all directions, without forces."""
    chosen = [
        c
        for c in map(conditions.Condition, range(conditions.COUNT))
        if c.configuration in configurations and c.speed in speeds
    ]
    features = np.array([c.features for c in chosen])
    nothing = np.zeros((len(chosen), 2))
    return Measurements(np.array([c.index for c in chosen]), features[:, :2], features[:, 2:], nothing, nothing + ERROR)


def measured(tows, coefficients, rng, offsets=(0.0, 0.0), error=ERROR):
    """The same tows with forces by MuJoCo itself, and noise."""
    force = Water(tows).force(coefficients) + offsets + rng.normal(0, error, (len(tows), 2))
    return Measurements(tows.condition, tows.posture, tows.velocity, force, np.full((len(tows), 2), error))


def drawn(rng, drag=0.3, lift=0.5):
    """Coefficients from the prior."""
    return np.maximum(DEFAULT * fit.level_factors(drag, lift) * (1 + fit.PRIOR * rng.normal(size=len(DEFAULT))), 0.0)


def write(tows, folder):
    """As gen_task1.py writes them."""
    path = Path(folder, "raw", campaign.TABLE)
    path.parent.mkdir(parents=True, exist_ok=True)
    columns = np.column_stack((tows.condition, tows.posture, tows.velocity, tows.force, tows.error))
    rows = [
        ",".join(measurements.NEEDED),
        *(f"{int(row[0])}," + ",".join(f"{v:.9g}" for v in row[1:]) for row in columns),
    ]
    path.write_text("\n".join(rows) + "\n")
    return path


class Physics(unittest.TestCase):
    def test_force_is_that_of_the_towing_scene(self):
        # The load cell's plugin goes, the carriage stays: what it pulls against is the force on its slides.
        text = (ROOT / "mjcf/b1_tow.xml").read_text()
        text = re.sub(r"<extension>.*?</extension>", "", text, flags=re.S)
        text = re.sub(r"<plugin name=.*?/>", "", text)
        model = mujoco.MjModel.from_xml_string(text)
        data = mujoco.MjData(model)
        tows = plan({0, 6, 15})
        for row, force in enumerate(Water(tows).force(DEFAULT)):
            data.qpos[2:] = np.tile((0.0, *tows.posture[row]), 4)
            data.qvel[:2] = tows.velocity[row]
            mujoco.mj_forward(model, data)
            # The carriage feels the viscosity: 6 pi 0.001 Pa s 2 cm 0.5 m/s is 0.2 mN.
            np.testing.assert_allclose(force, data.qfrc_fluid[:2], atol=2e-4)

    def test_feet_alone_drag_as_balls(self):
        tows = plan({3})
        coefficients = np.where(np.array(NAMES) == "foot blunt", 0.7, 0.0)
        speed = np.linalg.norm(tows.velocity, axis=1, keepdims=True)
        by_hand = -4 * 1000.0 * np.pi * 0.04**2 * 0.7 * speed * tows.velocity
        np.testing.assert_allclose(Water(tows).force(coefficients), by_hand, atol=0.02)

    def test_force_is_the_weighted_sum_of_the_columns(self):
        tank = fit.Tank.from_tows(plan({1, 9, 14}))
        coefficients = drawn(np.random.default_rng(1))
        np.testing.assert_allclose(tank.water.force(coefficients), tank.rest + tank.columns @ coefficients, atol=1e-10)


class Recovery(unittest.TestCase):
    def test_known_coefficients_lie_in_their_intervals(self):
        inside, total = 0, 0
        for seed in range(6):
            rng = np.random.default_rng(seed)
            truth, offsets = drawn(rng), np.array([0.2, -0.1])
            tank = fit.Tank.from_tows(measured(plan({0, 8, 15}), truth, rng, offsets))
            found = fit.identify(tank)
            self.assertLess(found.share, 0.02)
            self.assertLess(np.abs(found.predict(tank.water) - tank.water.force(truth) - offsets).max(), 4 * ERROR)
            values = dict(zip((*NAMES, *OFFSETS), (*truth, *offsets)))
            for name, half in zip(found.solution.free, found.solution.half_width):
                total += 1
                inside += abs(found.solution.values[name] - values[name]) <= half
        self.assertGreaterEqual(inside / total, 0.85)
        self.assertLess(inside / total, 1.0)

    def test_bootstrap_solves_the_problem_of_the_toolbox(self):
        rng = np.random.default_rng(2)
        tank = fit.Tank.from_tows(measured(plan({0, 5, 10}), drawn(rng), rng, error=0.5))
        found = fit.identify(tank)
        matrix = np.concatenate((fit.whitened(tank, found.sd), np.diag(1 / found.spread)))
        wanted = np.concatenate((((tank.tows.force - tank.rest) / found.sd).ravel(), found.centre / found.spread))
        low = [-5.0 if name in OFFSETS else 0.0 for name in found.solution.free]
        high = [5.0 if name in OFFSETS else LARGEST for name in found.solution.free]
        by_hand = lsq_linear(matrix, wanted, (low, high)).x
        np.testing.assert_allclose([found.solution.values[name] for name in found.solution.free], by_hand, atol=2e-4)
        replicates = blocks.bootstrap(tank, found, fit.Prior(), 0, 60)
        self.assertEqual(replicates.shape, (60, len(by_hand)))
        self.assertTrue((replicates[:, :-2] >= 0).all())
        np.testing.assert_array_equal(replicates, blocks.bootstrap(tank, found, fit.Prior(), 0, 60))

    def test_share_of_the_form_is_found(self):
        tows = plan(set(range(16)), conditions.SPEEDS)
        rng = np.random.default_rng(3)
        force = Water(tows).force(DEFAULT)
        scale = uncertainty.typical(Measurements(tows.condition, tows.posture, tows.velocity, force, tows.error))
        gap = rng.normal(size=force.shape) * np.sqrt(tows.error**2 + (0.1 * scale) ** 2)
        self.assertAlmostEqual(uncertainty.share(gap, tows.error, scale, gap.size), 0.1, delta=0.015)
        self.assertEqual(uncertainty.share(gap * 0, tows.error, scale, gap.size), 0.0)


class Unseen(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rng = np.random.default_rng(4)
        cls.tank = fit.Tank.from_tows(measured(plan({0, 3, 8, 15}), drawn(rng), rng))
        cls.fit = fit.identify(cls.tank)
        cls.analysis = identifiability.analyse(cls.tank, cls.fit)

    def test_what_acts_on_turning_bodies_alone_is_named_and_kept(self):
        silent = {name for name in NAMES if kind(name) in ("angular", "Magnus")} | {"foot slender", "foot Kutta"}
        self.assertEqual(set(self.analysis.silent), silent)
        for name in silent:
            self.assertEqual(self.fit.coefficients[NAMES.index(name)], DEFAULT[NAMES.index(name)])
            self.assertFalse(self.analysis.outweighs(name))

    def test_exact_relations_are_found(self):
        self.assertEqual(len(self.analysis.relations), 5)
        columns = {name: self.tank.columns[..., i] for i, name in enumerate(NAMES)}
        for name, members in self.analysis.relations.items():
            made = sum(value * columns[other] for other, value in members.items())
            np.testing.assert_allclose(made, columns[name], atol=0.03 * np.abs(columns[name]).max())
        hip, trunk = (self.analysis.alike[name] for name in ("hip Kutta", "trunk Kutta"))
        self.assertEqual((hip[0], trunk[0]), ("trunk Kutta", "hip Kutta"))

    def test_density_scale_is_made_up_by_coefficients(self):
        self.assertLess(self.analysis.density, 1e-3)

    def test_ends_of_the_scale(self):
        self.assertTrue(self.analysis.outweighs("thigh blunt"))
        self.assertFalse(self.analysis.outweighs("foot blunt"))
        self.assertGreater(self.analysis.unseen["foot blunt"], 0.9)


class Held(unittest.TestCase):
    def test_every_direction_and_speed_is_held_out(self):
        tows = plan(set(range(16)), conditions.SPEEDS)
        held = split.held_out(tows, 0.25, 0)
        self.assertEqual(held.sum(), 48)
        for rows in (held, ~held):
            self.assertEqual(len(set(zip(tows.direction[rows], tows.speed[rows]))), 12)
        np.testing.assert_array_equal(held, split.held_out(tows, 0.25, 0))
        self.assertTrue((held != split.held_out(tows, 0.25, 1)).any())

    def test_repeats_of_a_condition_stay_together(self):
        tows = plan({0, 4, 8, 12})
        twice = tows.take(np.tile(np.arange(len(tows)), 2))
        held = split.held_out(twice, 0.25, 0)
        self.assertFalse(set(twice.condition[held]) & set(twice.condition[~held]))

    def test_the_fit_never_sees_held_out_tows(self):
        rng = np.random.default_rng(5)
        tows = measured(plan({0, 7, 12}), drawn(rng), rng)
        held = split.held_out(tows, 0.25, 0)
        other = Measurements(
            tows.condition,
            tows.posture,
            tows.velocity,
            np.where(held[:, None], 10 * tows.force, tows.force),
            np.where(held[:, None], 3 * tows.error, tows.error),
        )
        few = functools.partial(blocks.bootstrap, count=40)
        with mock.patch.object(study, "OTHER_PRIORS", ()), mock.patch.object(blocks, "bootstrap", few):
            one, two = (study.run(each, 0.25, 0) for each in (tows, other))
        np.testing.assert_array_equal(one.held, held)
        np.testing.assert_array_equal(one.fit.coefficients, two.fit.coefficients)
        np.testing.assert_array_equal(one.fit.solution.half_width, two.fit.solution.half_width)
        np.testing.assert_array_equal(one.replicates, two.replicates)
        self.assertTrue((one.left_out != two.left_out).any())


class Refusals(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = write(measured(plan({0, 7, 12}), DEFAULT, np.random.default_rng(6)), self.folder.name)
        self.lines = self.path.read_text().splitlines()

    def refused(self, *words, lines=None):
        if lines is not None:
            self.path.write_text("\n".join(lines) + "\n")
        with self.assertRaises(DataError) as caught:
            measurements.read(self.path)
        for word in (str(self.path), *words):
            self.assertIn(word, str(caught.exception))

    def changed(self, line, column, value):
        """The table with one field changed; lines count from 1, the header's."""
        fields = self.lines[line - 1].split(",")
        fields[measurements.NEEDED.index(column)] = value
        return [*self.lines[: line - 1], ",".join(fields), *self.lines[line:]]

    def test_what_is_written_is_read(self):
        tows = measurements.read(measurements.find(Path(self.folder.name)))
        self.assertEqual(len(tows), 18)
        self.assertEqual(measurements.find(self.path.parent), self.path)

    def test_missing_folder_names_the_command(self):
        with self.assertRaisesRegex(DataError, "gen_task1.py --out nowhere --task 1.1"):
            measurements.find(Path("nowhere"))

    def test_missing_column(self):
        cut = [",".join(line.split(",")[:-2]) for line in self.lines]
        self.refused("lacks the columns error_x, error_y", "force_y", lines=cut)

    def test_not_finite(self):
        for value in ("nan", "inf", "", "fast"):
            self.refused("line 5", "force_x", f"`{value}`", lines=self.changed(5, "force_x", value))

    def test_short_line(self):
        self.refused("line 3", "fields", lines=[*self.lines[:2], self.lines[2].rsplit(",", 1)[0], *self.lines[3:]])

    def test_unknown_condition(self):
        for value in ("192", "-1", "2.5"):
            self.refused(
                "line 2", f"condition {value} is unknown", "0 to 191", lines=self.changed(2, "condition", value)
            )

    def test_contradicted_condition(self):
        self.refused("line 4", "thigh is 0.3", "has 0", lines=self.changed(4, "thigh", "0.3"))

    def test_no_error(self):
        self.refused("line 2", "error_y is 0 N", lines=self.changed(2, "error_y", "0"))

    def test_too_little(self):
        self.refused("no tows", lines=self.lines[:1])
        self.refused("2 leg configurations", "at least 3", lines=self.lines[:13])
        self.refused("along x, y:", lines=[line for i, line in enumerate(self.lines) if i == 0 or i % 3 != 0])

    def test_not_text(self):
        self.path.write_bytes(b"\xff\xfe\x00")
        self.refused()

    def test_nothing_to_hold_out(self):
        tows = plan({0})
        with self.assertRaisesRegex(DataError, "nothing can be held out"):
            split.held_out(tows, 0.25, 0)
        with self.assertRaisesRegex(DataError, "share 1:"):
            split.held_out(tows, 1.0, 0)

    def test_scene_without_hulls(self):
        with self.assertRaisesRegex(DataError, "b1_box_fluid.xml: no geom"):
            Water(plan({0}), "mjcf/b1_box_fluid.xml")


class Committed(unittest.TestCase):
    def test_scene_has_the_identified_coefficients(self):
        held = identified.read()
        found, default = (scene.load(path).model for path in (files.IDENTIFIED, NOMINAL))
        for i in range(found.ngeom):
            name = found.geom(i).name or ""
            if name.endswith("_hull"):
                part = name.split("_")[-2]
                np.testing.assert_allclose(found.geom_fluid[i, 1:6], held[part], atol=1e-12)
                np.testing.assert_allclose(found.geom_fluid[i, 6:], default.geom_fluid[i, 6:])
        self.assertEqual((found.opt.density, found.opt.viscosity), (default.opt.density, default.opt.viscosity))

    def test_scenes_differ_in_coefficients_and_names_alone(self):
        def bare(path):
            text = (ROOT / path).read_text()
            return re.sub(r'fluidcoef="[^"]*"|<!--.*?-->|<mujoco model="[^"]*">', "", text)

        self.assertEqual(bare(files.IDENTIFIED), bare(NOMINAL))

    def test_coefficients_are_sensible(self):
        for values in identified.read().values():
            self.assertTrue(all(0 <= value <= 2 for value in values))

    def test_broken_files_are_refused(self):
        good = json.loads(identified.FILE.read_text())
        cases = {
            "schema": good | {"schema": "other"},
            "coefficients of": good | {"coefficients": {}},
            "foot has": good | {"coefficients": good["coefficients"] | {"foot": [1, 2]}},
            "hip has": good | {"coefficients": good["coefficients"] | {"hip": [1, -2, 0, 0, 0]}},
        }
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "identified.json")
            for words, content in cases.items():
                path.write_text(json.dumps(content))
                with self.assertRaisesRegex(ValueError, words):
                    identified.read(path)
            path.write_text("{")
            with self.assertRaisesRegex(ValueError, "real_to_sim.py --write"):
                identified.read(path)


class Command(unittest.TestCase):
    def test_whole_run(self):
        rng = np.random.default_rng(7)
        with tempfile.TemporaryDirectory() as folder:
            table = write(measured(plan({0, 7, 12}), drawn(rng), rng, error=0.2), Path(folder, "tank"))
            out = Path(folder, "out")
            run = subprocess.run(
                [
                    sys.executable,
                    str(SCRIPTS / "real_to_sim.py"),
                    "--towing",
                    str(table.parent.parent),
                    "--out",
                    str(out),
                    "--seed",
                    "3",
                ],
                capture_output=True,
                text=True,
            )
            self.assertEqual(run.returncode, 0, run.stderr)
            self.assertIn("held-out tows, RMSE", run.stdout)
            names = {path.name for path in out.iterdir()}
            self.assertEqual(
                names,
                {
                    "report.md",
                    "report.json",
                    "identified.json",
                    "b1_truth.xml",
                    "before_after.svg",
                    "residuals.svg",
                    "coefficients.svg",
                },
            )
            report = json.loads((out / "report.json").read_text())
            self.assertEqual(report["schema"], "hydro-real-to-sim/1")
            self.assertEqual(len(report["left_out_configuration"]["each"]), 3)
            errors = {
                model: report["errors"][model]["held_out"]["rmse"]["pooled"]["value"] for model in report["errors"]
            }
            self.assertLess(errors["identified"], 0.1 * errors["default"])
            self.assertNotIn(folder, (out / "report.md").read_text() + (out / "identified.json").read_text())
            found = identified.read(out / "identified.json")
            self.assertEqual(set(found), set(by_part(DEFAULT)))
            model = mujoco.MjModel.from_xml_path(str(out / "b1_truth.xml"))
            np.testing.assert_allclose(model.geom_fluid[model.geom("FR_calf_hull").id, 1:6], found["calf"], atol=1e-12)

    def test_faults_and_interrupts_end_cleanly(self):
        run = subprocess.run(
            [sys.executable, str(SCRIPTS / "real_to_sim.py"), "--towing", "nowhere"], capture_output=True, text=True
        )
        self.assertEqual(run.returncode, 1)
        self.assertIn("real_to_sim.py: nowhere holds no raw/conditions.csv: make it with", run.stderr)
        with (
            mock.patch.object(sys, "argv", ["real_to_sim.py"]),
            mock.patch("sys.stderr") as stderr,
            mock.patch.object(real_to_sim, "run", side_effect=KeyboardInterrupt),
        ):
            self.assertEqual(real_to_sim.main(), 130)
        self.assertIn("nothing was written", "".join(call.args[0] for call in stderr.write.call_args_list))


if __name__ == "__main__":
    unittest.main()
