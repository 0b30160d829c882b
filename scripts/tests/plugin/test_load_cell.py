"""Load cells: what is added shows in them."""

import unittest

import mujoco
import numpy as np
from scene import CHECKPOINTS, TANK, Warnings


class LoadCell(unittest.TestCase):
    def tank(self, with_wrench, include="plugin", fluid="", coefficients="", gravcomp=""):
        wrench = carried = water = ""
        if with_wrench:
            wrench = (
                '<plugin plugin="hydro.wrench"><instance name="w"><config key="checkpoint" value="'
                f'{CHECKPOINTS / "towing"}"/></instance></plugin>'
            )
            carried = '<plugin plugin="hydro.wrench" instance="w"/>'
            water = '<plugin name="water" plugin="hydro.wrench" instance="w"/>'
        return mujoco.MjModel.from_xml_string(
            TANK.format(
                wrench=wrench,
                carried=carried,
                water=water,
                fluid=fluid,
                coefficients=coefficients,
                gravcomp=gravcomp,
                include=f'<config key="include" value="{include}"/>',
            )
        )

    def set_moving(self, data):
        data.qvel[:] = [0.4, -0.2, 0.7, -1.1]
        data.qpos[:] = [0.1, 0.2, 0.3, -0.6]

    def test_it_feels_the_plugin_as_an_applied_force(self):
        model, plain = self.tank(True), self.tank(False)
        data, twin = mujoco.MjData(model), mujoco.MjData(plain)
        self.set_moving(data)
        for _ in range(17):
            mujoco.mj_step(model, data)
        mujoco.mj_forward(model, data)
        wrench = data.sensor("water").data
        self.assertGreater(np.linalg.norm(wrench[:3]), 0.5)
        twin.qpos[:], twin.qvel[:] = data.qpos, data.qvel
        mujoco.mj_kinematics(plain, twin)
        rotation, position = twin.body("trunk").xmat.reshape(3, 3), twin.body("trunk").xpos
        force, torque = rotation @ wrench[:3], rotation @ wrench[3:]
        twin.xfrc_applied[plain.body("trunk").id, :3] = force
        arm = position - twin.body("trunk").xipos
        twin.xfrc_applied[plain.body("trunk").id, 3:] = torque + np.cross(arm, force)
        mujoco.mj_forward(plain, twin)
        # The gantry's slides feel the force through the chain.
        np.testing.assert_allclose(data.qacc, twin.qacc, rtol=0, atol=1e-9)
        for quantity in ("force", "torque"):
            expected = twin.sensor(f"plain {quantity}").data
            np.testing.assert_allclose(data.sensor(quantity).data, expected, rtol=0, atol=1e-9)
            self.assertGreater(np.abs(data.sensor(f"plain {quantity}").data - expected).max(), 0.01)

    def test_a_weight_hung_on_it(self):
        """At rest, held still: the cell reads the weight below it, upwards, from child to parent."""
        model = self.tank(False)
        data = mujoco.MjData(model)

        model.dof_armature[:] = 1e12  # nothing moves
        mujoco.mj_setConst(model, data)
        mujoco.mj_forward(model, data)
        rotation = data.site("cell").xmat.reshape(3, 3)
        weight = 9.81 * (1 + 20 + 2 + 1)
        np.testing.assert_allclose(rotation @ data.sensor("force").data, [0, 0, weight], rtol=0, atol=1e-6)
        data.xfrc_applied[model.body("shin").id, 2] = -9.81 * 3  # three kilograms more
        mujoco.mj_forward(model, data)
        weight += 9.81 * 3
        np.testing.assert_allclose(rotation @ data.sensor("force").data, [0, 0, weight], rtol=0, atol=1e-6)

    def check_all(self, **parts):
        """Force by force: inverse dynamics of the rails see the same sum as the cell does."""
        model = self.tank(True, include="all", **parts)
        data = mujoco.MjData(model)
        self.set_moving(data)
        mujoco.mj_forward(model, data)
        # Momentum balance of everything below the cell, from accelerations alone.
        mujoco.mj_rnePostConstraint(model, data)
        below = [model.body(name).id for name in ("beam", "trunk", "leg", "shin")]
        water = np.zeros(3)
        # Forces of joint space along the rails: passive force on the slides is that of the whole tree.
        water[:2] = data.qfrc_passive[:2]
        # The carriage above the cell is not below it.
        carriage = mujoco.MjModel.from_xml_string(
            f'<mujoco><option {parts.get("fluid", "")}/><worldbody><body><joint type="slide" axis="1 0 0"/>'
            '<joint type="slide" axis="0 1 0"/><geom size="0.1" mass="5"/></body></worldbody></mujoco>'
        )
        alone = mujoco.MjData(carriage)
        alone.qvel[:] = data.qvel[:2]
        mujoco.mj_forward(carriage, alone)
        water[:2] -= alone.qfrc_passive[:2]
        self.assertEqual(len(below), 4)
        rotation = data.site("cell").xmat.reshape(3, 3)
        missing = rotation @ (data.sensor("plain force").data - data.sensor("force").data)
        np.testing.assert_allclose(missing[:2], water[:2], rtol=0, atol=1e-9)
        return missing

    def test_all_adds_the_engines_box_fluid(self):
        with Warnings():
            missing = self.check_all(fluid='density="1000" viscosity="0.5" wind="0.1 0.3 -0.2"')
        self.assertGreater(np.abs(missing).max(), 5)

    def test_all_adds_the_engines_ellipsoid_fluid(self):
        with Warnings():
            missing = self.check_all(
                fluid='density="1000" viscosity="0.5" wind="0.1 0.3 -0.2"',
                coefficients='fluidshape="ellipsoid" fluidcoef="0.6 0.3 1.2 0.8 0.9"',
            )
        self.assertGreater(np.abs(missing).max(), 5)

    def test_all_adds_gravity_compensation(self):
        with_it, without = (self.tank(False, include=include, gravcomp='gravcomp="1"') for include in ("all", "plugin"))
        readings = []
        for model in (with_it, without):
            data = mujoco.MjData(model)
            mujoco.mj_forward(model, data)
            readings.append(data.site("cell").xmat.reshape(3, 3) @ data.sensor("force").data)
        np.testing.assert_allclose(readings[1] - readings[0], [0, 0, 20 * 9.81], atol=1e-9)

    def test_refusals(self):
        for config, words in {
            "": ["`site` is missing", "cell"],
            '<config key="site" value="sell"/>': ["`site` is `sell`", "cell"],
            '<config key="site" value="cell"/><config key="quantity" value="power"/>': [
                "`quantity` is `power`",
                "`torque`",
            ],
            '<config key="site" value="cell"/><config key="include" value="some"/>': ["`include` is `some`", "`all`"],
            '<config key="site" value="ground"/>': ["on the world"],
        }.items():
            xml = f"""<mujoco><extension><plugin plugin="hydro.load_cell"/></extension>
        <worldbody><site name="ground"/><body><joint/><geom size="0.1"/><site name="cell"/></body></worldbody>
        <sensor><plugin name="s" plugin="hydro.load_cell">{config}</plugin></sensor></mujoco>"""
            with self.assertRaises(ValueError) as refusal:
                mujoco.MjModel.from_xml_string(xml)
            for word in words:
                self.assertIn(word, str(refusal.exception))


if __name__ == "__main__":
    unittest.main(verbosity=2)
