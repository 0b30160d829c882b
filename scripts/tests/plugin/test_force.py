"""The force that a model adds: frames, water, timing."""

import ast
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import mujoco
import numpy as np
from scene import CHECKPOINTS, TANK, Warnings, fish, start, state_of, steps


class Force(unittest.TestCase):
    BALL = """
<mujoco>
  <option timestep="0.002" gravity="0 0 0" integrator="{integrator}"/>
  {extension}
  <worldbody><body name="ball">{carried}<freejoint/><geom size="0.1" mass="2"/></body></worldbody>
</mujoco>
"""
    CONSTANT = np.array([3.0, -2.0, 4.0, 0.0, 0.0, 0.0])

    def test_every_integrator_applies_it_once(self):
        extension = (
            '<extension><plugin plugin="hydro.wrench"><instance name="w"><config key="checkpoint" value="'
            f'{CHECKPOINTS / "constant"}"/></instance></plugin></extension>'
        )
        for integrator in ("Euler", "implicitfast", "implicit", "RK4"):
            parts = dict(
                integrator=integrator, extension=extension, carried='<plugin plugin="hydro.wrench" instance="w"/>'
            )
            driven = mujoco.MjModel.from_xml_string(self.BALL.format(**parts))
            plain = mujoco.MjModel.from_xml_string(self.BALL.format(integrator=integrator, extension="", carried=""))
            one, two = mujoco.MjData(driven), mujoco.MjData(plain)
            two.qfrc_applied[:] = self.CONSTANT
            for _ in range(100):
                mujoco.mj_step(driven, one)
                mujoco.mj_step(plain, two)
            np.testing.assert_allclose(one.qvel, two.qvel, rtol=1e-9, atol=1e-9)
            np.testing.assert_allclose(one.qpos, two.qpos, rtol=1e-9, atol=1e-9)
            # Twice, or not at all, would be far off.
            np.testing.assert_allclose(one.qvel[:3], self.CONSTANT[:3] / 2 * 0.2, rtol=1e-6)

    def test_a_varying_wrench_is_that_of_qfrc_applied(self):
        for integrator in ("Euler", "implicitfast"):
            model = fish(integrator=integrator)
            data, twin = start(model), start(fish(integrator=integrator, option=""))
            plain = fish(integrator=integrator)
            plain.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SPRING | mujoco.mjtDisableBit.mjDSBL_DAMPER
            model.dof_damping[:] = plain.dof_damping[:] = 0
            for _ in range(60):
                mujoco.mj_forward(model, data)
                wrench = data.sensordata.copy()
                world_from_base = data.body("hull").xmat.reshape(3, 3)
                twin.qfrc_applied[:] = 0
                twin.qfrc_applied[:3] = world_from_base @ wrench[:3]
                twin.qfrc_applied[3:6] = wrench[3:]
                mujoco.mj_step(model, data)
                mujoco.mj_step(plain, twin)
            np.testing.assert_allclose(data.qpos, twin.qpos, rtol=0, atol=1e-11)
            self.assertGreater(np.ptp(wrench), 0.1)

    def test_the_passive_force_is_the_sensor(self):
        model = fish()
        model.dof_damping[:] = 0
        data = start(model)
        for _ in range(33):
            mujoco.mj_step(model, data)
        mujoco.mj_forward(model, data)
        world_from_base = data.body("hull").xmat.reshape(3, 3)
        np.testing.assert_allclose(data.qfrc_passive[:3], world_from_base @ data.sensordata[:3], rtol=0, atol=1e-12)
        np.testing.assert_allclose(data.qfrc_passive[3:6], data.sensordata[3:], rtol=0, atol=1e-12)
        self.assertEqual(data.qfrc_passive[6], 0)

    def test_neither_capability_feeds_the_other(self):
        reference = steps(fish(), start(fish()), 30)
        silent = fish()
        silent.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SENSOR
        data = start(silent)
        steps(silent, data, 30)
        np.testing.assert_array_equal(data.qpos, reference[-1][: silent.nq])
        off = fish()
        off.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SPRING | mujoco.mjtDisableBit.mjDSBL_DAMPER
        data = start(off)
        steps(off, data, 30)
        self.assertEqual(np.abs(data.qfrc_passive).max(), 0)
        self.assertGreater(np.abs(data.sensordata).max(), 0.1)

    def test_runge_kutta_samples_the_same_motion(self):
        """For a motion that no force changes, the samples are those of Euler."""
        results = {}
        for integrator in ("Euler", "RK4", "implicitfast"):
            model = fish(integrator=integrator)
            model.body_mass[:] *= 1e9
            model.body_inertia[:] *= 1e9
            model.dof_damping[:] = 0
            mujoco.mj_setConst(model, mujoco.MjData(model))
            model.opt.gravity[:] = [1, 0.5, -2]
            data = mujoco.MjData(model)
            data.qvel[:3] = [0.3, -0.2, 0.1]
            rows = []
            for _ in range(50):
                mujoco.mj_step(model, data)
                rows.append(data.plugin_state[5:17].copy())
            results[integrator] = np.array(rows)
        for integrator in ("RK4", "implicitfast"):
            np.testing.assert_allclose(results[integrator], results["Euler"], rtol=0, atol=1e-5)
        self.assertGreater(np.abs(results["Euler"][0] - results["Euler"][-1]).max(), 1e-3)

    def test_any_step_that_divides_the_period_gives_the_same_samples(self):
        samples = {}
        for timestep in (0.001, 0.002, 0.005, 0.01):
            model = fish(timestep=timestep)
            model.body_mass[:] *= 1e9
            model.body_inertia[:] *= 1e9
            model.dof_damping[:] = 0
            mujoco.mj_setConst(model, mujoco.MjData(model))
            model.opt.gravity[:] = [1, 0.5, -2]  # a velocity that is the same at every step's end
            data = mujoco.MjData(model)
            data.qvel[:3] = [0.3, -0.2, 0.1]
            with Warnings() as texts:
                rows = []
                for k in range(round(0.3 / timestep)):
                    mujoco.mj_step(model, data)
                    if (k + 1) % round(0.01 / timestep) == 0:
                        rows.append(data.plugin_state[5:17].copy())
            self.assertEqual(texts, [])
            samples[timestep] = np.array(rows)
        scale = np.sqrt(np.mean(samples[0.002] ** 2, axis=0))
        self.assertGreater(np.ptp(samples[0.002], axis=0).max(), 0.1)
        for timestep, rows in samples.items():
            self.assertLess((np.abs(rows - samples[0.002]) / scale).max(), 1e-6, timestep)

    def test_a_step_that_does_not_divide_interpolates_and_says_so_once(self):
        model = fish(timestep=0.003)
        data = start(model)
        with Warnings() as texts:
            steps(model, data, 100)
            other = start(model)
            steps(model, other, 100)
        self.assertEqual(len(texts), 2)  # each start's
        for text in texts:
            self.assertIn("0.003 s does not divide", text)
        self.assertAlmostEqual(data.plugin_state[1], 31)
        self.assertAlmostEqual(data.plugin_state[2], 0.3)

    def test_a_velocity_out_of_range_is_braked_and_told_once_a_start(self):
        with tempfile.TemporaryDirectory() as folder:
            known = pathlib.Path(folder) / "known"
            shutil.copytree(CHECKPOINTS / "lively", known)
            card = json.loads((known / "card.json").read_text())
            del card["card_sha256"]
            inputs, outputs = len(card["features"]), len(card["outputs"])
            card["envelope"] = dict(
                least=[-0.5] * inputs, most=[0.5] * inputs, least_force=[-20] * outputs, most_force=[20] * outputs
            )
            (known / "card.json").write_text(json.dumps(card))
            for integrator in ("Euler", "implicitfast", "RK4"):
                model, bare = (
                    fish({"checkpoint": str(c)}, integrator=integrator) for c in (known, CHECKPOINTS / "lively")
                )
                with Warnings() as texts:
                    data, other = start(model, control=0), start(bare, control=0)
                    for one in (data, other):
                        one.qvel[:] = 0
                        one.qvel[2] = 3
                    steps(bare, other, 50)
                    self.assertEqual(texts, [])
                    steps(model, data, 25)
                    self.assertEqual(len(texts), 1)
                    self.assertIn("outside the training range -0.500 to 0.500", texts[0])
                    # The state holds the warning and the drag.
                    restored = mujoco.MjData(model)
                    mujoco.mj_setState(model, restored, state_of(model, data), mujoco.mjtState.mjSTATE_INTEGRATION)
                    np.testing.assert_array_equal(steps(model, restored, 25), steps(model, data, 25))
                    self.assertEqual(len(texts), 1)
                self.assertLess(np.linalg.norm(data.qvel[:3]), 0.8 * np.linalg.norm(other.qvel[:3]))
            # A simulation that is reset is not told again; another one is.
            for _ in range(2):
                with Warnings() as texts:
                    data = mujoco.MjData(model)
                    for _ in range(3):
                        mujoco.mj_resetData(model, data)
                        data.qvel[2] = 3
                        steps(model, data, 25)
                self.assertEqual(len(texts), 1)

    def test_initial_force_and_the_current(self):
        given = "1 2 3 0.4 0.5 0.6"
        model = fish({"initial_force": given})
        data = start(model)
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(data.sensordata, [1, 2, 3, 0.4, 0.5, 0.6])
        drifting, still = fish({"current": "0.4 0 0"}), fish()
        one, two = mujoco.MjData(drifting), mujoco.MjData(still)
        one.qvel[:3] = [0.4, 0, 0]
        mujoco.mj_forward(drifting, one)
        mujoco.mj_forward(still, two)
        np.testing.assert_allclose(one.sensordata, two.sensordata, rtol=0, atol=1e-6)

    def test_the_waterline_fades_the_force_out(self):
        model = fish({"waterline": 0})
        readings = []
        for height in (-1.0, 0.0, 1.0):
            data = mujoco.MjData(model)
            data.qpos[2] = height
            mujoco.mj_forward(model, data)
            readings.append(data.sensordata.copy())
        np.testing.assert_allclose(readings[1], 0.5 * readings[0], rtol=1e-6)
        np.testing.assert_array_equal(readings[2], 0)

    def test_engines_and_solvers_agree(self):

        def end(**attributes):
            model = fish(attributes)
            data = start(model)
            steps(model, data, 100)
            return data.plugin_state[5:17].copy()

        ends = {solver: end(engine="fused", solver=solver) for solver in ("euler", "rk4")}
        for solver, expected in ends.items():
            np.testing.assert_allclose(end(engine="candle", solver=solver), expected, rtol=1e-4, atol=1e-4)
            for rounding in ("fused-f16", "fused-i16"):
                rounded = end(engine=rounding, solver=solver)
                np.testing.assert_allclose(rounded, expected, rtol=1e-2, atol=1e-2)
                self.assertGreater(np.abs(rounded - expected).max(), 0)
        self.assertGreater(np.abs(ends["euler"] - ends["rk4"]).max(), 1e-3)
        np.testing.assert_array_equal(end(), ends["euler"])  # the card's

    def test_int16_without_its_instructions_says_so_once_and_gives_the_same_numbers(self):
        code = (
            "import mujoco, scene\n"
            "with scene.Warnings() as texts:\n"
            "    for _ in range(2):\n"
            "        model = scene.fish({'engine': 'fused-i16'}); data = scene.start(model); scene.steps(model, data, 50)\n"
            "print([text for text in texts if 'i16' in text]); print(data.plugin_state[5:17].tolist())"
        )
        found = {}
        for instructions in ("", "portable"):
            environment = os.environ | {"HYDRO_INSTRUCTIONS": instructions}
            run = subprocess.run(
                [sys.executable, "-c", code],
                cwd=pathlib.Path(__file__).parent,
                env=environment,
                capture_output=True,
                text=True,
            )
            self.assertEqual(run.returncode, 0, run.stderr)
            found[instructions] = [ast.literal_eval(line) for line in run.stdout.splitlines()[-2:]]
        (silent, fast), (told, plain) = found[""], found["portable"]
        self.assertEqual(len(told), 1)
        self.assertIn("this processor has no AVX2", told[0])
        np.testing.assert_allclose(fast, plain, rtol=1e-4, atol=1e-4)
        # A processor without AVX2 says it in both.
        self.assertIn(len(silent), (0, 1))

    def test_a_memoryless_checkpoint_holds_its_force(self):
        model = fish({"checkpoint": str(CHECKPOINTS / "memoryless")})
        data = start(model)
        for _ in range(23):
            mujoco.mj_step(model, data)
        np.testing.assert_array_equal(data.plugin_state[5:11], data.plugin_state[11:17])

    def test_arrows_in_the_viewer(self):
        model = fish()
        data = start(model)
        steps(model, data, 5)
        scene, option = mujoco.MjvScene(model, 100), mujoco.MjvOption()

        def arrows():
            mujoco.mjv_updateScene(
                model, data, option, mujoco.MjvPerturb(), mujoco.MjvCamera(), mujoco.mjtCatBit.mjCAT_ALL, scene
            )
            return [g for g in scene.geoms[: scene.ngeom] if g.type == mujoco.mjtGeom.mjGEOM_ARROW]

        drawn = arrows()
        self.assertEqual(len(drawn), 2)
        mujoco.mj_forward(model, data)
        length = np.linalg.norm(data.sensordata[:3]) * model.vis.map.force
        drawn = arrows()
        self.assertAlmostEqual(float(drawn[0].size[2]), length, delta=0.02 * length)
        np.testing.assert_allclose(drawn[0].pos, data.body("hull").xpos, atol=1e-6)
        option.flags[mujoco.mjtVisFlag.mjVIS_PERTOBJ] = 0
        self.assertEqual(arrows(), [])

    def test_not_a_number_gives_no_force_one_warning_and_a_reset_helps(self):
        model = fish({"density": 1001})
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        data = start(model)
        steps(model, data, 12)
        with Warnings() as texts:
            data.qvel[0] = np.nan
            for _ in range(30):
                mujoco.mj_step(model, data)
            mujoco.mj_forward(model, data)
        np.testing.assert_array_equal(data.sensordata, 0)
        self.assertEqual(len([t for t in texts if "hydro" in t]), 1, texts)
        self.assertIn("until the simulation is reset", "".join(texts))
        mujoco.mj_resetData(model, data)
        self.assertTrue(np.isfinite(steps(model, data, 30)).all())
        self.assertGreater(np.abs(data.sensordata).max(), 0.1)

    def test_not_a_number_gives_no_force_at_once(self):
        for name in ("lively", "memoryless"):
            model = fish({"checkpoint": str(CHECKPOINTS / name)})
            for count in (0, 12):
                for field in ("qpos", "qvel"):
                    data = start(model)
                    steps(model, data, count)
                    getattr(data, field)[0] = np.nan
                    mujoco.mj_forward(model, data)
                    np.testing.assert_array_equal(data.sensordata, 0)

    def test_every_fault_is_told(self):
        model = fish()
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET

        def told(data):
            with Warnings() as texts:
                data.qvel[0] = np.nan
                steps(model, data, 5)
            return sum("until the simulation is reset" in text for text in texts)

        data, other = start(model), start(model)
        self.assertEqual((told(data), told(other)), (1, 1))
        mujoco.mj_resetData(model, data)
        self.assertEqual(told(data), 1)

    def test_the_engines_own_reset_works(self):
        model = fish()
        data = start(model)
        steps(model, data, 12)
        data.qpos[0] = np.nan
        with Warnings():
            mujoco.mj_step(model, data)
        self.assertTrue(np.isfinite(data.qpos).all())
        self.assertTrue(np.isfinite(steps(model, data, 30)).all())

    def test_a_density_that_was_never_trained_is_warned_of(self):
        # The card's mean is 1000, its deviation 20.
        for density, words in {
            "1079": [],
            "1081": ["`density` is 1081", "920.0 to 1080.0"],
            "0": ["`density` is 0", "920.0 to 1080.0"],
        }.items():
            with Warnings() as texts:
                mujoco.MjData(fish({"density": density}))
            self.assertEqual(len(texts), 2 if words else 0, texts)
            for text in texts:
                for word in words:
                    self.assertIn(word, text)

    def test_a_density_that_changes_nothing_is_warned_of(self):
        for density, count in {"1000": 0, "1025": 1}.items():
            xml = TANK.format(
                wrench='<plugin plugin="hydro.wrench"><instance name="w"><config key="checkpoint" value="'
                f'{CHECKPOINTS / "towing"}"/><config key="density" value="{density}"/></instance></plugin>',
                carried='<plugin plugin="hydro.wrench" instance="w"/>',
                water="",
                fluid="",
                coefficients="",
                gravcomp="",
                include="",
            )
            model = mujoco.MjModel.from_xml_string(xml)
            with Warnings() as texts:
                mujoco.MjData(model)
            self.assertEqual(len(texts), count, texts)
            for text in texts:
                self.assertIn("no feature `density`", text)

    def test_the_engines_own_fluid_is_warned_of(self):
        for _ in range(2):  # every load
            with Warnings() as texts:
                model = fish(option='density="1000" viscosity="0.001"')
                data = mujoco.MjData(model)
            self.assertEqual(len(texts), 2, texts)  # the compiler makes a simulation as well
            for text in texts:
                self.assertIn("the water counts twice", text)
            with Warnings() as texts:
                steps(model, data, 3)
                mujoco.mj_resetData(model, data)
                mujoco.mj_copyData(data, model, data)
            self.assertEqual(texts, [])


if __name__ == "__main__":
    unittest.main(verbosity=2)
