"""Patched models in the MuJoCo wheel: each beside its nominal, changed by hand.

Needs HYDRO_TEST_PATCHED, a folder with nominal and patched models and `cases.json`: a list of
{"name", "nominal", "patched", "effect", "target", "parameters", "native"}; `cargo test --test gap patch_python::`
writes it and runs this file.
"""

import collections
import json
import os
import pathlib
import unittest

import mujoco
import numpy as np

if "HYDRO_TEST_PATCHED" not in os.environ:
    raise unittest.SkipTest("run by cargo test --test gap patch_python::, which writes the models")
FOLDER = pathlib.Path(os.environ["HYDRO_TEST_PATCHED"])
CASES = json.loads((FOLDER / "cases.json").read_text())
STEPS = 250


def cases(effect: str) -> list[dict]:
    """Cases of an effect that were written in plain MJCF, of nominal models that MuJoCo takes."""
    found = [case for case in CASES if case["effect"] == effect and case["native"] and loads(case)]
    assert found, effect
    return found


def loads(case: dict) -> bool:
    """False where a default class and an element do not go together."""
    try:
        load(case, "nominal")
    except ValueError:
        return False
    return True


def load(case: dict, which: str) -> mujoco.MjModel:
    """The nominal or the patched model of a case."""
    return mujoco.MjModel.from_xml_path(str(FOLDER / case[which]))


def commands(count: int, width: int) -> np.ndarray:
    """Smooth commands with steps among them, (count, width)."""
    rng = np.random.default_rng(7)
    time = np.arange(count)[:, None] * 0.002
    smooth = np.sin(time * rng.uniform(3, 30, width) + rng.uniform(0, 6, width))
    return smooth + np.repeat(rng.uniform(-1, 1, (count // 50 + 1, width)), 50, axis=0)[:count]


def start(model: mujoco.MjModel) -> mujoco.MjData:
    """A state in motion."""
    data = mujoco.MjData(model)
    for joint in ("hinge", "rail"):
        if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, joint) >= 0:
            data.joint(joint).qpos = 0.2
            data.joint(joint).qvel = -0.5
    data.qvel[:6] = 0.1, -0.2, 0.05, 0.3, 0.2, -0.1
    return data


def run(model: mujoco.MjModel, through=None, before=None) -> np.ndarray:
    """Positions of all steps, (STEPS, nq); `through` changes a command, `before` acts before each step."""
    data = start(model)
    positions = []
    for row in commands(STEPS, model.nu):
        data.ctrl[:] = through(row) if through else row
        if before:
            before(model, data)
        mujoco.mj_step(model, data)
        positions.append(data.qpos.copy())
    return np.array(positions)


class Patched(unittest.TestCase):
    def same(self, case: dict, expected: np.ndarray, tolerance: float = 1e-8) -> None:
        found = run(load(case, "patched"))
        nominal = run(load(case, "nominal"))
        self.assertTrue(np.isfinite(found).all(), case["name"])
        # The effect is there, and it is the one that was meant.
        self.assertGreater(np.abs(expected - nominal).max(), 1e-5, case["name"])
        self.assertLess(np.abs(expected - found).max(), tolerance, case["name"])

    def test_gain(self):
        for case in cases("actuator_gain"):
            model, patched = load(case, "nominal"), load(case, "patched")
            actuator = model.actuator(case["target"]).id
            factor = case["parameters"][0]
            model.actuator_gainprm[actuator] *= factor
            model.actuator_biasprm[actuator] *= factor
            with self.subTest(case["name"]):
                for table in ("gainprm", "biasprm", "dynprm"):
                    if table == "dynprm" and (model.actuator_dyntype == 0).all():
                        continue
                    name = f"actuator_{table}"
                    np.testing.assert_allclose(
                        getattr(patched, name)[actuator][:3], getattr(model, name)[actuator][:3], rtol=1e-8, atol=1e-12
                    )
                for table in ("gaintype", "biastype", "dyntype", "ctrlrange", "forcerange", "ctrllimited", "gear"):
                    name = f"actuator_{table}"
                    np.testing.assert_array_equal(getattr(patched, name), getattr(model, name), name)
                self.same(case, run(model))

    def test_lag(self):
        for case in cases("actuator_lag"):
            model = load(case, "nominal")
            actuator = model.actuator(case["target"]).id
            share = -np.expm1(-model.opt.timestep / case["parameters"][0])
            state = [0.0]

            def through(row):
                row = row.copy()
                limited = model.actuator_ctrllimited[actuator]
                command = np.clip(row[actuator], *model.actuator_ctrlrange[actuator]) if limited else row[actuator]
                state[0] += share * (command - state[0])
                row[actuator] = state[0]
                return row

            with self.subTest(case["name"]):
                self.same(case, run(model, through))

    def test_delay(self):
        for case in cases("actuator_delay"):
            model = load(case, "nominal")
            actuator = model.actuator(case["target"]).id
            whole, part = divmod(case["parameters"][0] / model.opt.timestep, 1)
            past = collections.deque([0.0] * 300, maxlen=300)

            def through(row):
                row = row.copy()
                past.appendleft(row[actuator])
                row[actuator] = (1 - part) * past[int(whole)] + part * past[int(whole) + 1]
                return row

            with self.subTest(case["name"]):
                self.same(case, run(model, through))

    def test_damping(self):
        for case in cases("joint_damping"):
            model = load(case, "nominal")
            model.dof_damping[model.joint(case["target"]).dofadr] += case["parameters"][0]
            with self.subTest(case["name"]):
                self.same(case, run(model))

    def test_armature(self):
        for case in cases("joint_armature"):
            model = load(case, "nominal")
            model.dof_armature[model.joint(case["target"]).dofadr] += case["parameters"][0]
            # The softness of dry friction goes by it.
            mujoco.mj_setConst(model, mujoco.MjData(model))
            with self.subTest(case["name"]):
                self.same(case, run(model))

    def test_stiffness(self):
        for case in cases("joint_stiffness"):
            model = load(case, "nominal")
            joint = model.joint(case["target"])
            stiffness, reference = case["parameters"]

            def before(model, data):
                data.qfrc_applied[joint.dofadr] = -stiffness * (data.qpos[joint.qposadr] - reference)

            with self.subTest(case["name"]):
                self.same(case, run(model, before=before))

    def test_friction(self):
        for case in cases("joint_friction"):
            model = load(case, "nominal")
            model.dof_frictionloss[model.joint(case["target"]).dofadr] += case["parameters"][0]
            with self.subTest(case["name"]):
                self.same(case, run(model))

    def test_play(self):
        for case in cases("joint_backlash"):
            model, nominal = load(case, "patched"), load(case, "nominal")
            half = case["parameters"][0] / 2
            extra = model.joint(case["target"] + "_play")
            own = model.joint(case["target"])
            with self.subTest(case["name"]):
                self.assertEqual((model.nq, model.nv), (nominal.nq + 1, nominal.nv + 1))
                np.testing.assert_allclose(extra.range, [-half, half])
                np.testing.assert_allclose(extra.axis, own.axis)
                self.assertEqual(extra.type, own.type)
                for table in (extra.damping, extra.stiffness, extra.frictionloss):
                    np.testing.assert_array_equal(np.ravel(table), 0)
                for key in range(model.nkey):
                    rest = np.delete(model.key_qpos[key], extra.qposadr)
                    np.testing.assert_allclose(rest, nominal.key_qpos[key])
                data = start(model)
                slack = []
                for row in commands(4 * STEPS, model.nu):
                    data.ctrl[:] = row
                    mujoco.mj_step(model, data)
                    slack.append(data.qpos[extra.qposadr][0])
                slack = np.array(slack)
                self.assertTrue(np.isfinite(slack).all())
                self.assertGreater(np.ptp(slack), 1.5 * half)
                self.assertLess(np.abs(slack).max(), 2 * half)

    def test_payload(self):
        for case in cases("payload"):
            model, patched = load(case, "nominal"), load(case, "patched")
            mass, *position = case["parameters"]
            of, with_it = mujoco.MjData(model), mujoco.MjData(patched)
            rng = np.random.default_rng(3)
            with self.subTest(case["name"]):
                for _ in range(5):
                    of.qpos[:] = model.qpos0 + rng.normal(size=model.nq)
                    mujoco.mj_normalizeQuat(model, of.qpos)
                    with_it.qpos[:] = of.qpos
                    full, expected = np.zeros((model.nv, model.nv)), np.zeros((model.nv, model.nv))
                    for the_model, the_data, into in ((model, of, expected), (patched, with_it, full)):
                        mujoco.mj_forward(the_model, the_data)
                        mujoco.mj_fullM(the_model, the_data, into)
                    body = model.body(case["target"]).id
                    point = of.xpos[body] + of.xmat[body].reshape(3, 3) @ position
                    jacobian = np.zeros((3, model.nv))
                    mujoco.mj_jac(model, of, jacobian, None, point, body)
                    np.testing.assert_allclose(full, expected + mass * jacobian.T @ jacobian, atol=1e-5)
                    weight = -mass * jacobian.T @ model.opt.gravity
                    np.testing.assert_allclose(with_it.qfrc_bias, of.qfrc_bias + weight, atol=1e-4)

    def test_buoyancy(self):
        for case in cases("net_buoyancy"):
            model = load(case, "nominal")
            body = model.body(case["target"]).id

            def before(model, data):
                data.xfrc_applied[body, 2] = case["parameters"][0]

            with self.subTest(case["name"]):
                self.same(case, run(model, before=before), 1e-6)

    def test_current(self):
        for case in cases("current"):
            model = load(case, "nominal")
            model.opt.wind += case["parameters"]
            with self.subTest(case["name"]):
                self.same(case, run(model))

    def test_files_are_found_from_anywhere(self):
        found = [case for case in CASES if case["effect"] == "files"]
        self.assertTrue(found)
        os.chdir("/")
        for case in found:
            with self.subTest(case["name"]):
                model, patched = load(case, "nominal"), load(case, "patched")
                self.assertGreater(model.nmesh, 0)
                np.testing.assert_array_equal(patched.mesh_vert, model.mesh_vert)
                np.testing.assert_array_equal(patched.body_mass, model.body_mass)

    def test_what_is_left_to_the_plugin_is_right_but_for_the_plugin(self):
        found = [case for case in CASES if not case["native"] and case["effect"] != "files"]
        self.assertTrue(found)
        for case in found:
            with self.subTest(case["name"]), self.assertRaisesRegex(ValueError, r"hydro\."):
                load(case, "patched")


if __name__ == "__main__":
    unittest.main()
