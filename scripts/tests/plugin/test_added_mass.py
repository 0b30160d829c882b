"""The added mass that a data set of strips leaves to the inertia, in the plugin: the truth's own, to rounding."""

import json
import unittest

import mujoco
import numpy as np
import scene

from hydro_tools.datasets import scene as scenes
from hydro_tools.strip_water import added_mass, forces, simulation, strips

DENSITY = 1013.0
#: Importing it has loaded the library.
assert scene.LIBRARY


def in_plugin():
    """B1 without gravity in water that is added mass alone, by the effect of `hydro.wrench`."""
    spec = mujoco.MjSpec.from_file(str(scenes.find("mjcf/b1_swim.xml")))
    entries = [
        {"effect": "added_mass", "target": body, "parameters": {"matrix": (DENSITY * m).tolist(), "point": [0, 0, 0]}}
        for body, m in added_mass.by_body(strips.b1()).items()
    ]
    (plugin,) = spec.plugins
    plugin.config = {"effects": json.dumps({"schema": "hydro-effects/1", "effects": entries})}
    spec.option.gravity = [0, 0, 0]
    return spec.compile()


class AddedMass(unittest.TestCase):
    def test_accelerations_are_those_of_the_strips(self):
        loaded = scenes.load()
        water = forces.water(loaded.model, strips.b1())
        run = simulation.Simulation(simulation.dry(loaded.model), water, 1)
        run.model.opt.gravity[:] = 0.0
        run.density[:] = DENSITY
        model = in_plugin()
        data, truth = mujoco.MjData(model), run.datas[0]
        rng = np.random.default_rng(4)
        for _ in range(5):
            truth.qpos[3:7] = rng.normal(size=4)
            truth.qpos[3:7] /= np.linalg.norm(truth.qpos[3:7])
            truth.qpos[7:] = 0.5 * model.jnt_range[1:].sum(axis=1) + 0.2 * rng.normal(size=12)
            truth.qvel[:] = rng.normal(0, 1.0, model.nv)
            truth.ctrl[:] = truth.qpos[7:]
            told = run.evaluate([0])
            data.qpos[:], data.qvel[:], data.ctrl[:] = truth.qpos, truth.qvel, truth.ctrl
            # All the water's force but the added mass's.
            data.qfrc_applied[:] = told.drag[0] + told.lift[0]
            mujoco.mj_forward(model, data)
            # The truth's scene also has seventeen bodies of a milligram, which carry its buoyancy.
            np.testing.assert_allclose(data.qacc, truth.qacc, rtol=1e-5, atol=1e-3)
            self.assertGreater(np.abs(told.drift).max(), 1.0)
            # What the passive stage holds on the base: the gyroscopic part of the added mass.
            np.testing.assert_allclose(data.qfrc_passive[:6], told.drift[0, :6], rtol=1e-7, atol=1e-7)


if __name__ == "__main__":
    unittest.main()
