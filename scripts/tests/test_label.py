"""Labels and features against computations that share no code with them."""

import unittest

import mujoco
import numpy as np

from hydro_mujoco.recording import features, simulation
from hydro_tools.datasets import plan, scene


class TowedBox(unittest.TestCase):
    """MuJoCo's ellipsoid fluid, pure translation; formulas of "Fluid forces, ellipsoid model" in its documentation.

    A box acts as the ellipsoid of its half-sizes. Drag: -(3 pi D mu + rho |v| (C_blunt A_proj +
    C_slender (A_max - A_proj))) v, with D = 2/3 (a + b + c). The added-mass terms of a pure
    translation are the torque of Munk alone, -v x (m_A v) up to its sign.
    """

    HALF, DENSITY, VISCOSITY = np.array([0.3, 0.2, 0.1]), 1000.0, 0.001
    BLUNT, SLENDER = 0.8, 0.25

    def wrench(self, velocity, quaternion=(1, 0, 0, 0)):
        """Fluid and buoyancy on a towed box of 20 kg, in its own frame."""
        volume = 8 * np.prod(self.HALF)
        model = mujoco.MjModel.from_xml_string(f"""
        <mujoco><option density="{self.DENSITY}" viscosity="{self.VISCOSITY}"/><worldbody><body><freejoint/>
          <geom type="box" size="0.3 0.2 0.1" mass="20" fluidshape="ellipsoid" fluidcoef="{self.BLUNT} {self.SLENDER} 1.5 0 0"/>
          <body gravcomp="{self.DENSITY * volume / 1e-6}"><inertial pos="0 0 0" mass="1e-6" diaginertia="1e-14 1e-14 1e-14"/></body>
        </body></worldbody></mujoco>""")
        data = mujoco.MjData(model)
        data.qpos[3:7], data.qvel[:3] = quaternion, velocity
        mujoco.mj_forward(model, data)
        return (
            features.base_wrench(data.qpos[3:7], data.qfrc_fluid[:6]),
            features.base_wrench(data.qpos[3:7], data.qfrc_gravcomp[:6]),
            model,
        )

    def drag(self, v):
        a, b, c = self.HALF
        num = (b * c) ** 4 * v[0] ** 2 + (c * a) ** 4 * v[1] ** 2 + (a * b) ** 4 * v[2] ** 2
        den = (b * c) ** 2 * v[0] ** 2 + (c * a) ** 2 * v[1] ** 2 + (a * b) ** 2 * v[2] ** 2
        area, widest = np.pi * np.sqrt(num / den), np.pi * a * b
        stokes = 3 * np.pi * (2 / 3) * (a + b + c) * self.VISCOSITY
        speed = np.linalg.norm(v)
        return -(stokes + self.DENSITY * speed * (self.BLUNT * area + self.SLENDER * (widest - area))) * v

    def test_along_each_axis(self):
        for axis, area in ((0, 0.2 * 0.1), (1, 0.3 * 0.1), (2, 0.3 * 0.2)):
            velocity = np.zeros(3)
            velocity[axis] = 0.4
            fluid, _, _ = self.wrench(velocity)
            # By hand, without the Stokes term: rho v^2 pi (0.8 bc + 0.25 (ab - bc)).
            by_hand = 1000 * 0.16 * np.pi * (0.8 * area + 0.25 * (0.06 - area))
            self.assertAlmostEqual(fluid[axis], -by_hand, delta=2e-3)
            np.testing.assert_allclose(fluid[:3], self.drag(velocity), atol=1e-5)  # the buoyancy body's own
            np.testing.assert_allclose(np.delete(fluid, axis), 0, atol=1e-9)

    def test_oblique_force_and_munk_torque(self):
        velocity = np.array([0.3, -0.2, 0.4])
        fluid, _, model = self.wrench(velocity)
        np.testing.assert_allclose(fluid[:3], self.drag(velocity), atol=1e-4)
        added = self.DENSITY * model.geom_fluid[0, 6:9]
        np.testing.assert_allclose(fluid[3:], np.cross(added * velocity, velocity), rtol=1e-9)

    def test_tilted_box_is_lifted_upwards(self):
        half = np.pi / 6
        quaternion = np.array([np.cos(half), np.sin(half), 0, 0])
        fluid, buoyancy, _ = self.wrench([0, 0, 0], quaternion)
        lift = 1000 * 9.81 * 0.048
        np.testing.assert_allclose(buoyancy, [0, lift * np.sin(2 * half), lift * np.cos(2 * half), 0, 0, 0], atol=1e-9)
        np.testing.assert_allclose(fluid, 0, atol=1e-12)


class Label(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scene = scene.load()
        plans = [plan.task2(11, plan.Stream.TEST, i, samples=40, joint_range=cls.scene.joint_range) for i in range(4)]
        cls.plans, cls.record = plans, simulation.simulate(cls.scene.system, plans)

    def dynamics(self, i, k, density):
        """Momentum rates at sample k of run i: M, J_com, H_com, qacc, all world frame; no water if density is 0."""
        model = scene.load().model
        if density:
            scene.set_density(model, density)
        else:
            model.opt.density = model.opt.viscosity = 0
            model.body_gravcomp[:] = 0
        data = mujoco.MjData(model)
        data.qpos[:], data.qvel[:] = self.record.qpos[i, k], self.record.qvel[i, k]
        mujoco.mj_forward(model, data)
        com_rows, spin_rows = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        mujoco.mj_jacSubtreeCom(model, data, com_rows, 1)
        mujoco.mj_angmomMat(model, data, spin_rows, 1)
        return model, data, com_rows, spin_rows

    def test_label_is_the_change_of_momentum_that_the_water_makes(self):
        for i in range(4):
            for k in (0, 17, 39):
                density = self.record.x[i, k, 34]
                model, wet, com_rows, spin_rows = self.dynamics(i, k, density)
                _, dry, _, _ = self.dynamics(i, k, 0)
                gain = wet.qacc - dry.qacc
                force = model.body_subtreemass[1] * com_rows @ gain
                torque = spin_rows @ gain + np.cross(wet.subtree_com[1] - wet.xpos[1], force)
                base = wet.xmat[1].reshape(3, 3)
                wanted = np.concatenate((base.T @ force, base.T @ torque))
                np.testing.assert_allclose(self.record.wrench[i, k], wanted, atol=1e-4)

    def test_label_is_not_the_one_that_mj_step_leaves(self):
        i, k = 0, 20
        model = scene.load().model
        data = mujoco.MjData(model)
        run = self.plans[i]
        scene.set_density(model, run.density[run.warm_up + k - 1])
        data.qpos[:], data.qvel[:] = self.record.qpos[i, k - 1], self.record.qvel[i, k - 1]
        data.ctrl[:] = run.ctrl[run.warm_up + k - 1]
        data.xfrc_applied[1] = run.push[run.warm_up + k - 1]
        mujoco.mj_step(model, data, 5)
        np.testing.assert_allclose(data.qpos, self.record.qpos[i, k], atol=1e-8)
        stale = data.qfrc_fluid[:6] + data.qfrc_gravcomp[:6]
        fresh_model = scene.load().model
        scene.set_density(fresh_model, run.density[run.warm_up + k])
        mujoco.mj_forward(fresh_model, data)
        fresh = data.qfrc_fluid[:6] + data.qfrc_gravcomp[:6]
        np.testing.assert_allclose(features.base_wrench(data.qpos[3:7], fresh), self.record.wrench[i, k], atol=1e-6)
        self.assertGreater(np.abs(features.base_wrench(data.qpos[3:7], stale) - self.record.wrench[i, k]).max(), 0.01)

    def test_linear_velocity_is_the_velocimeters(self):
        model = mujoco.MjModel.from_xml_path(str(scene.find(scene.TRUTH)))
        data = mujoco.MjData(model)
        data.qpos[:], data.qvel[:] = self.record.qpos[1, 5], self.record.qvel[1, 5]
        mujoco.mj_forward(model, data)
        x = self.record.x[1, 5]
        np.testing.assert_allclose(data.sensor("base_linear_velocity").data, x[31:34], atol=1e-12)
        np.testing.assert_allclose(data.sensor("imu_gyro").data, x[28:31], atol=1e-12)
        sign = np.sign(x[24:28] @ data.sensor("base_quaternion").data)
        np.testing.assert_allclose(sign * data.sensor("base_quaternion").data, x[24:28], atol=1e-12)
        self.assertEqual(len(self.scene.layout.names()), 35)
        self.assertEqual(x[34], self.plans[1].density[self.plans[1].warm_up + 5])

    def test_quaternion_sign_starts_positive_and_does_not_jump(self):
        angle = np.linspace(0.9 * np.pi, 3.3 * np.pi, 50)
        smooth = np.stack((np.cos(angle / 2), np.sin(angle / 2), 0 * angle, 0 * angle), axis=-1)
        rng = np.random.default_rng(0)
        scrambled = smooth * rng.choice([-1, 1], 50)[:, None]
        np.testing.assert_array_equal(features.continuous(scrambled), smooth)
        np.testing.assert_array_equal(features.continuous(-smooth), smooth)

    def test_neighbours_and_threads_change_no_bit(self):
        alone = simulation.simulate(self.scene.system, self.plans[2:3])
        threaded = simulation.simulate(self.scene.system, self.plans, threads=2)
        np.testing.assert_array_equal(alone.wrench[0], self.record.wrench[2])
        np.testing.assert_array_equal(threaded.x, self.record.x)


if __name__ == "__main__":
    unittest.main()
