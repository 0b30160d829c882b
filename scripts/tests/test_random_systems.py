"""Cases on random systems."""

import json
import os
import tempfile
import unittest
from pathlib import Path

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import mujoco
import numpy as np

from hydro_tools.hidden_cases.effects import IDS
from hydro_tools.hidden_cases.systems.generic import Generic
from hydro_tools.random_systems import build, cases


def system(index: int) -> Generic:
    """One of a fixed list."""
    return Generic(build.robot(np.random.default_rng([9, index])))


class Build(unittest.TestCase):
    def test_all_kinds_come_and_every_one_loads_with_named_parts(self):
        seen, declared = set(), set()
        for index in range(12):
            robot = build.robot(np.random.default_rng([9, index]))
            model = mujoco.MjModel.from_xml_string(robot.xml)
            seen.add(robot.name)
            declared.add(robot.noise_declared)
            self.assertEqual(len(robot.reach), model.nu)
            self.assertGreater(model.nu, 0)
            self.assertGreater(model.nsensor, 0)
            self.assertEqual(round(robot.period / model.opt.timestep) * model.opt.timestep, robot.period)
            self.assertTrue(all(model.body(i).name for i in range(1, model.nbody)))
            self.assertNotIn("noise", Generic(robot).shown_xml(robot.xml) if not robot.noise_declared else "")
        self.assertEqual(seen, {f"random_{kind}" for kind in build.KINDS})
        self.assertEqual(declared, {True, False})

    def test_what_floats_neither_sinks_nor_rises(self):
        for index in range(12):
            robot = build.robot(np.random.default_rng([9, index]))
            if robot.name != "random_float":
                continue
            model = mujoco.MjModel.from_xml_string(robot.xml)
            data = mujoco.MjData(model)
            mujoco.mj_forward(model, data)
            pull = data.qfrc_passive[2] - data.qfrc_bias[2]
            self.assertLess(abs(pull), 1e-3 * 9.81 * model.body_subtreemass[1])

    def test_the_same_numbers_give_the_same_system(self):
        again = [build.robot(np.random.default_rng([9, 3])).xml for _ in range(2)]
        self.assertEqual(*again)


class Draw(unittest.TestCase):
    def test_shares_of_nulls_and_effects_of_the_catalogue(self):
        one = system(0)
        specs = [cases.draw(np.random.default_rng(i), 9, i, one, null_share=0.25, small=True) for i in range(200)]
        nulls = sum(spec.kind == "null" for spec in specs) / len(specs)
        self.assertAlmostEqual(nulls, 0.25, delta=0.1)
        self.assertEqual({spec.kind for spec in specs}, {"null", "single", "pair", "several"})
        for spec in specs:
            self.assertTrue(set(spec.effects) <= set(IDS))
            self.assertEqual(len(spec.effects), len(set(spec.effects)))
            self.assertTrue(all(cases.LEAST <= target <= cases.MOST for target in spec.target))


class Make(unittest.TestCase):
    def test_a_case_has_the_fields_of_the_others(self):
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder)
            name = cases.make(5, 1, out, null_share=1.0, small=True)
            self.assertEqual(name, cases.case_id(5, 1, small=True))
            answer = json.loads((out / "sealed" / name / "answer.json").read_text())
            self.assertEqual((answer["kind"], answer["effects"]), ("null", []))
            self.assertLessEqual({"strength", "identifiable", "noise_declared", "perturbations"}, set(answer))
            self.assertEqual(len(list((out / "cases" / name / "trials").iterdir())), 4)


if __name__ == "__main__":
    unittest.main()
