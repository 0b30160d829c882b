"""The robot's files against its table, and buoyancy against Archimedes."""

import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np

from hydro_tools.datasets import scene
from hydro_tools.repository import ROOT, SCRIPTS
from hydro_tools.robot import hull, table
from hydro_tools.robot.composition import fused


class Files(unittest.TestCase):
    def test_committed_files_are_what_the_table_gives(self):
        run = subprocess.run([sys.executable, SCRIPTS / "make_b1.py", "--check"], capture_output=True, text=True)
        self.assertEqual(run.returncode, 0, run.stderr)

    def test_check_notices_a_difference(self):
        with tempfile.TemporaryDirectory() as folder:
            base = [sys.executable, str(SCRIPTS / "make_b1.py"), "--root", folder]
            subprocess.run(base, check=True, capture_output=True)
            self.assertEqual(subprocess.run([*base, "--check"], capture_output=True).returncode, 0)
            stale = Path(folder, "mjcf/b1.xml")
            stale.write_text(stale.read_text().replace("62.58", "62.59") + " ")
            run = subprocess.run([*base, "--check"], capture_output=True, text=True)
            self.assertEqual(run.returncode, 1)
            self.assertIn("mjcf/b1.xml", run.stderr)

    def test_displaced_volume_out_of_range_is_refused(self):
        run = subprocess.run(
            [sys.executable, SCRIPTS / "make_b1.py", "--displaced-volume", "70"], capture_output=True, text=True
        )
        self.assertEqual(run.returncode, 2)
        self.assertIn("46.0 to 60.0 L", run.stderr)


class Masses(unittest.TestCase):
    def test_urdf_weighs_what_the_description_weighs(self):
        links = ET.parse(ROOT / "models/robots/b1.urdf").getroot().findall("link/inertial/mass")
        # b1_description: trunk, 4 legs of 8.281 kg, 6 sensors of 1 g.
        self.assertAlmostEqual(sum(float(mass.get("value")) for mass in links), 62.580, places=9)

    def test_mjcf_bodies_carry_the_fused_links(self):
        model = mujoco.MjModel.from_xml_path(str(ROOT / "mjcf/b1.xml"))
        self.assertEqual(model.nbody, 14)
        self.assertAlmostEqual(model.body_subtreemass[1], 62.580, places=9)
        for name, inertial in fused().items():
            body = model.body(name)
            self.assertAlmostEqual(body.mass[0], inertial.mass, places=9)
            np.testing.assert_allclose(body.ipos, inertial.com, atol=1e-12)
            turn = np.zeros(9)
            mujoco.mju_quat2Mat(turn, body.iquat)
            turn = turn.reshape(3, 3)
            xx, yy, zz, xy, xz, yz = inertial.inertia
            np.testing.assert_allclose(
                turn @ np.diag(body.inertia) @ turn.T, [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], atol=1e-10
            )

    def test_fused_hip_by_hand(self):
        # Hip 2.15 kg at (-0.020298, -0.009758, 0.000109), rotor 0.266 kg at (0, -0.00935, 0).
        hip = fused()["FR_hip"]
        self.assertAlmostEqual(hip.mass, 2.416)
        self.assertAlmostEqual(hip.com[0], -0.020298 * 2.15 / 2.416)
        reduced = 2.15 * 0.266 / 2.416
        self.assertAlmostEqual(hip.inertia[1], 0.008775259 + 0.00091885 + reduced * (0.020298**2 + 0.000109**2))

    def test_joints_in_the_description_order_with_its_limits(self):
        model = mujoco.MjModel.from_xml_path(str(ROOT / "mjcf/b1.xml"))
        for i, link in enumerate(table.moving_links()):
            self.assertEqual(model.joint(i + 1).name, link.joint)
            self.assertEqual(model.actuator(i).name, link.joint)
            np.testing.assert_allclose(model.jnt_range[i + 1], (link.lower, link.upper))
            np.testing.assert_allclose(model.actuator_forcerange[i], (-link.effort, link.effort))


class Buoyancy(unittest.TestCase):
    def setUp(self):
        self.model = scene.load().model
        self.data = mujoco.MjData(self.model)
        rng = np.random.default_rng(3)
        self.data.qpos[3:7] = rng.normal(size=4)
        self.data.qpos[:3] = rng.normal(size=3)
        self.data.qpos[7:] += rng.normal(0, 0.5, 12) + np.tile([0, 0.7, -1.4], 4)

    def archimedes(self, density):
        """Force (world) and torque about the base origin (base frame), from volumes and places alone."""
        hulls = hull.hulls()
        places = np.array([self.data.geom(h.name).xpos for h in hulls])
        lift = np.array([[0, 0, density * 9.81 * h.volume] for h in hulls])
        torque = np.cross(places - self.data.body("trunk").xpos, lift).sum(0)
        return np.concatenate((lift.sum(0), self.data.body("trunk").xmat.reshape(3, 3).T @ torque))

    def test_gravcomp_is_archimedes(self):
        for density in (1000.0, 990.0, 1030.0):
            scene.set_density(self.model, density)
            mujoco.mj_forward(self.model, self.data)
            np.testing.assert_allclose(self.data.qfrc_gravcomp[:6], self.archimedes(density), atol=1e-9)
        self.assertAlmostEqual(self.data.qfrc_gravcomp[2], 1030 * 9.81 * 0.058, places=9)

    def test_volumes_sum_to_the_parameter(self):
        for litres in (46.0, 58.0, 60.0):
            self.assertAlmostEqual(1e3 * sum(h.volume for h in hull.hulls(litres)), litres, places=9)
        legs = 1e3 * sum(h.volume for h in hull.hulls() if h.body != "trunk")
        self.assertAlmostEqual(legs, 4 * (1.014 + 2.487 + 0.470 + 0.268), places=2)

    def test_buoyancy_bodies_feel_no_water(self):
        text = (ROOT / scene.TRUTH).read_text()
        bare = mujoco.MjModel.from_xml_string(re.sub(r'<body name="\w+_buoyancy".*?</body>', "", text))
        self.assertEqual(bare.nbody, 14)
        other = mujoco.MjData(bare)
        self.data.qvel[:] = np.random.default_rng(4).normal(size=18)
        other.qpos[:], other.qvel[:] = self.data.qpos, self.data.qvel
        mujoco.mj_forward(self.model, self.data)
        mujoco.mj_forward(bare, other)
        self.assertGreater(np.abs(other.qfrc_fluid[:3]).max(), 10.0)
        # 17 cubes of 0.24 mm at metres a second: millinewtons.
        np.testing.assert_allclose(self.data.qfrc_fluid, other.qfrc_fluid, atol=5e-3)

    def test_robot_is_righted(self):
        self.data.qpos[3:7] = 1, 0, 0, 0
        mujoco.mj_forward(self.model, self.data)
        lift = self.archimedes(1000.0)
        arm = np.array([h.volume * self.data.geom(h.name).xpos[2] for h in hull.hulls()]).sum() / 0.058
        self.assertGreater(arm, self.data.subtree_com[1][2] + 0.01)
        self.assertLess(lift[2], 62.58 * 9.81)


if __name__ == "__main__":
    unittest.main()
