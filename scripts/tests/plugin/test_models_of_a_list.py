"""Data stepped with a model other than the one that it was made of: the water is that of the model it is stepped with."""

import unittest

import mujoco
import mujoco.rollout
import numpy as np
from mujoco.batch import Batch
from scene import LIBRARY

assert LIBRARY


def model(current):
    """A float of 4 kg that a current takes along."""
    effects = (
        '{"schema": "hydro-effects/1", "effects": [{"effect": "linear_drag", "target": "float", "parameters": '
        '{"surge": 40, "sway": 40, "heave": 40, "roll": 1, "pitch": 1, "yaw": 1}}]}'
    )
    return mujoco.MjModel.from_xml_string(f"""
<mujoco><option timestep="0.01" gravity="0 0 0"/>
  <extension><plugin plugin="hydro.wrench"><instance name="w">
    <config key="effects" value='{effects}'/><config key="current" value="{current} 0 0"/></instance></plugin></extension>
  <worldbody><body name="float"><freejoint/><plugin plugin="hydro.wrench" instance="w"/><geom size="0.1" mass="4"/></body>
  </worldbody></mujoco>""")


class ModelsOfAList(unittest.TestCase):
    CURRENTS = (0.1, 0.7, 0.4, 0.1)

    def setUp(self):
        """Each alone."""
        self.models = [model(current) for current in self.CURRENTS]
        self.alone = []
        for one in self.models:
            data = mujoco.MjData(one)
            mujoco.mj_step(one, data, 100)
            self.alone.append(data.qpos[0])
        self.assertGreater(self.alone[1], 5 * self.alone[0])

    def test_in_a_batch(self):
        for threads in (1, 2):
            floats = Batch(self.models[0], len(self.models), threads)
            floats.set_models(self.models)
            floats.step(nstep=100)
            np.testing.assert_array_equal(np.array(floats.bind("qpos"))[:, 0], self.alone)

    def test_in_rollouts(self):
        first = mujoco.MjData(self.models[0])
        size = mujoco.mj_stateSize(self.models[0], mujoco.mjtState.mjSTATE_FULLPHYSICS)
        start = np.zeros(size)
        mujoco.mj_getState(self.models[0], first, start, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        for count in (1, 2):
            data = [mujoco.MjData(self.models[0]) for _ in range(count)]
            states, _ = mujoco.rollout.rollout(self.models, data, np.tile(start, (len(self.models), 1)), nstep=100)
            np.testing.assert_array_equal(states[:, -1, 1], self.alone)

    def test_back_and_forth_by_hand(self):
        data = mujoco.MjData(self.models[0])
        for _ in range(3):
            for one in self.models:
                data.qvel[:] = 0
                mujoco.mj_forward(one, data)
                self.assertAlmostEqual(
                    data.qfrc_passive[0], 40 * float(self.CURRENTS[self.models.index(one)]), places=9
                )


if __name__ == "__main__":
    unittest.main()
