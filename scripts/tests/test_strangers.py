"""Cases on others' robots, where the wheels are; the wheel reader, on a wheel of its own."""

import os
import tempfile
import unittest
import zipfile
from pathlib import Path

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import mujoco
import numpy as np

from hydro_tools.hidden_cases import HiddenCaseError
from hydro_tools.hidden_cases.case import Case, Spec
from hydro_tools.hidden_cases.plant import Plant
from hydro_tools.hidden_cases.systems.base import Schedule
from hydro_tools.hidden_cases.systems.generic import Generic, Robot
from hydro_tools.strangers import cases, mend
from hydro_tools.strangers.robots import ROBOTS, system
from hydro_tools.strangers.wheels import Wheels

WHEELS = os.environ.get("HYDRO_WHEELS")
TWO_LINKS = """
<mujoco>
  <option timestep="0.005" integrator="RK4"/>
  <asset><texture name="sky" type="skybox" builtin="flat" width="8" height="8"/>
    <mesh name="m" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/></asset>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body name="upper">
      <joint name="shoulder" axis="0 1 0"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.4" size="0.03" mass="1"/>
      <body pos="0 0 -0.4"><joint axis="0 1 0"/><geom type="mesh" mesh="m" mass="0.5"/></body>
    </body>
  </worldbody>
  <actuator><motor joint="shoulder"/></actuator>
</mujoco>
"""


class Mend(unittest.TestCase):
    def test_what_is_left_stands_alone_and_moves_as_before(self):
        spec = mujoco.MjSpec.from_string(TWO_LINKS)
        before = mujoco.MjModel.from_xml_string(TWO_LINKS)
        xml = mend.bare(spec).to_xml()
        for gone in ("mesh", "texture", "plane"):
            self.assertNotIn(f"<{gone}", xml)
        after = mujoco.MjModel.from_xml_string(xml)
        self.assertTrue(all(after.body(i).name for i in range(after.nbody)))
        moved = []
        for model in (before, after):
            model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
            data = mujoco.MjData(model)
            data.qpos[:] = [0.7, -0.3]
            mujoco.mj_step(model, data, 100)
            moved.append(data.qpos.copy())
        np.testing.assert_allclose(moved[1], moved[0], rtol=1e-4)

    def test_servos_swing_at_the_pace_that_was_asked_for(self):
        spec = mend.bare(mujoco.MjSpec.from_string(TWO_LINKS))
        mend.servos(spec, ["shoulder"], np.zeros(2), pace=20.0, damping=0.5)
        model = spec.compile()
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        full = np.zeros((2, 2))
        mujoco.mj_fullM(model, data, full)
        felt = 1 / np.linalg.inv(full)[0, 0]
        self.assertAlmostEqual(model.actuator_gainprm[0, 0] / felt, 400.0, delta=1.0)
        self.assertAlmostEqual(-model.actuator_biasprm[0, 2] / felt, 20.0, delta=0.1)


class WheelFolder(unittest.TestCase):
    def test_a_wheel_and_a_folder_are_read_alike_and_what_is_missing_is_named(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder)
            with self.assertRaisesRegex(HiddenCaseError, "pip download"):
                Wheels(folder)
            with zipfile.ZipFile(folder / "dm_control-1.0-py3-none-any.whl", "w") as wheel:
                wheel.writestr("dm_control/suite/cartpole.xml", "<mujoco/>")
                wheel.writestr("dm_control/suite/cartpole.py", "")
            wheels = Wheels(folder)
            path = wheels.path("dm_control/suite/cartpole.xml")
            self.assertEqual(path.read_text(), "<mujoco/>")
            self.assertFalse(path.with_suffix(".py").exists())
            with self.assertRaisesRegex(HiddenCaseError, "robosuite/x.xml"):
                wheels.path("robosuite/x.xml")


class Plan(unittest.TestCase):
    def test_a_robot_has_a_null_its_singles_and_a_pair(self):
        specs = cases.plan("panda", ["joint_damping", "joint_friction", "payload"], 3, small=True)
        self.assertEqual([spec.kind for spec in specs], ["null", "single", "single", "single", "pair"])
        self.assertEqual(specs, cases.plan("panda", ["joint_damping", "joint_friction", "payload"], 3, small=True))
        other = cases.plan("fish", ["current"], 3, small=True)
        self.assertFalse({spec.case_id for spec in specs} & {spec.case_id for spec in other})

    def test_factors_are_drawn_where_no_strength_is_aimed_at(self):
        specs = cases.plan("ur5e_pan", ["joint_damping", "joint_friction"], 3, (0.5, 5.0), small=True)
        self.assertEqual([len(spec.factors) for spec in specs], [0, 1, 1, 2])
        self.assertTrue(all(0.5 <= factor <= 5.0 for spec in specs for factor in spec.factors))
        self.assertFalse(any(spec.target for spec in specs))


class NoisyCommands(unittest.TestCase):
    def test_noise_is_in_the_log_alone(self):
        spec = mend.bare(mujoco.MjSpec.from_string(TWO_LINKS))
        mend.encoders(spec, 1e-3, 1e-2)
        xml, one = spec.to_xml(), np.ones(1)
        logs = []
        with tempfile.TemporaryDirectory() as folder:
            for noise in (0.0, 0.25):
                robot = Robot(
                    "links", xml, "upper", np.zeros(2), 0 * one, one, 0.02, seconds=(4.0, 4.0), command_noise=noise
                )
                Case(Spec(0, 1, "null", "links", (), (), 1.0, True), Generic(robot)).make(Path(folder))
                (trial,) = Path(folder).glob("cases/*/trials/trial_00.npz")
                logs.append(dict(np.load(trial)))
        noise = logs[1]["control_data"] - logs[0]["control_data"]
        self.assertAlmostEqual(noise.std(), 0.25, delta=0.04)
        np.testing.assert_array_equal(logs[1]["sensordata_data"], logs[0]["sensordata_data"])


@unittest.skipUnless(WHEELS, "HYDRO_WHEELS names no folder of the wheels: pip download --no-deps, see gen_strangers.py")
class Robots(unittest.TestCase):
    def test_every_robot_loads_and_runs_for_a_moment(self):
        wheels = Wheels(Path(WHEELS))
        for name in ROBOTS:
            robot = system(name, wheels)
            model = robot.model
            schedule = Schedule(2, 10, robot.robot.period)
            drive = robot.drive(np.random.default_rng(0), model, schedule, "normal")
            plant = Plant(model, [], qpos=drive.qpos, qvel=drive.qvel, start=np.zeros(2), act=drive.act)
            record = plant.run(10, robot.robot.period, drive.policy, lead=model.opt.timestep)
            robot.check(model, record)
            self.assertTrue(np.all(model.sensor_noise > 0), name)
            self.assertEqual(model.nu, len(robot.robot.reach), name)

    def test_a_step_four_times_finer_changes_little(self):
        self.assertLess(cases.stepping(system("cartpole", Wheels(Path(WHEELS))), True), 1.0)


if __name__ == "__main__":
    unittest.main()
