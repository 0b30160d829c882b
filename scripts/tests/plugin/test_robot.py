"""The B1's own models with the plugin."""

import pathlib
import unittest

import mujoco
import numpy as np
from scene import CHECKPOINTS, Warnings, steps

MJCF = pathlib.Path(__file__).resolve().parents[3] / "mjcf"


class Robot(unittest.TestCase):
    """The B1's own models."""

    def spec(self, name, **attributes):
        spec = mujoco.MjSpec.from_file(str(MJCF / name))
        for plugin in spec.plugins:
            if plugin.plugin_name == "hydro.wrench":
                plugin.config = {"checkpoint": str(CHECKPOINTS / "b1"), **attributes}
        return spec

    def home(self, model):
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
        return data

    def hull(self, model, data):
        """Half heights as they are turned, heights and volumes of the hull's ellipsoids."""
        hull = [g for g in range(model.ngeom) if model.geom(g).name.endswith("_hull")]
        self.assertEqual(len(hull), 17)
        upright = data.geom_xmat[hull][:, 6:] * model.geom_size[hull]
        volumes = 4 / 3 * np.pi * model.geom_size[hull].prod(axis=1)
        return np.linalg.norm(upright, axis=1), data.geom_xpos[hull, 2], volumes

    def test_the_swimming_robot_is_driven(self):
        with Warnings() as texts:
            model = self.spec("b1_swim.xml").compile()
            data = self.home(model)
            rows = steps(model, data, 200)
        self.assertEqual(texts, [])
        self.assertTrue(np.isfinite(rows).all())
        self.assertGreater(np.abs(data.sensor("water_wrench").data).max(), 0.1)
        still = self.spec("b1_swim.xml", initial_force="0 0 0 0 0 0").compile()
        other = self.home(still)
        mujoco.mj_forward(still, other)
        np.testing.assert_array_equal(other.sensor("water_wrench").data, 0)

    def test_the_waterline_weighs_the_hull_alone(self):
        swim = self.spec("b1_swim.xml", waterline="0.05", initial_force="0 0 100 0 0 0")
        truth = self.spec("b1_truth.xml")
        truth.option.density = truth.option.viscosity = 0
        truth.activate_plugin("hydro.wrench")
        water = truth.add_plugin(name="water", plugin_name="hydro.wrench", active=True)
        water.config = {"checkpoint": str(CHECKPOINTS / "b1"), "waterline": "0.05", "initial_force": "0 0 100 0 0 0"}
        sensor = truth.add_sensor(name="water_wrench", type=mujoco.mjtSensor.mjSENS_PLUGIN)
        for user in (truth.body("trunk").plugin, sensor.plugin):
            user.plugin_name, user.name, user.active = "hydro.wrench", "water", True
        for spec, fluid in ((swim, False), (truth, True)):
            model = spec.compile()
            self.assertEqual(bool((model.geom_fluid[:, 0] > 0).any()), fluid)
            data = self.home(model)
            mujoco.mj_forward(model, data)
            radius, height, volume = self.hull(model, data)
            u = np.clip((0.05 - height + radius) / (2 * radius), 0, 1)
            part = (volume * u**2 * (3 - 2 * u)).sum() / volume.sum()
            self.assertTrue(0.3 < part < 0.9, part)
            # The geoms of a foot and a shank share a little, which counts once.
            np.testing.assert_allclose(data.sensor("water_wrench").data, [0, 0, 100 * part, 0, 0, 0], rtol=3e-3)

    def test_the_towed_robot_hangs_with_its_wet_weight(self):
        model = self.spec("b1_tow.xml").compile()
        data = self.home(model)
        rows = steps(model, data, 2500)  # until the legs hang still
        self.assertTrue(np.isfinite(rows).all())
        self.assertLess(np.abs(data.qvel).max(), 1e-5)
        mujoco.mj_forward(model, data)
        below = model.body_subtreemass[model.site("gantry").bodyid[0]]
        wet = 9.81 * (below - 1000 * self.hull(model, data)[2].sum())
        self.assertGreater(wet, 20)
        force = data.site("gantry").xmat.reshape(3, 3) @ data.sensor("gantry_force").data
        np.testing.assert_allclose(force[2], wet, rtol=1e-3)


if __name__ == "__main__":
    unittest.main(verbosity=2)
