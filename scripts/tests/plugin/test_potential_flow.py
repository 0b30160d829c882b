"""The attribute `potential_flow`: a hull that makes and meets waves, against the frequency response of its own file."""

import json
import math
import unittest

import mujoco
import numpy as np
from mujoco.batch import Batch
from scene import LIBRARY

assert LIBRARY

RHO, G = 1000.0, 9.81
MASS, VOLUME = 400.0, 0.4
#: Heave: infinite added mass [kg], memory x' = a x + b w, F = -c x.
ADDED = 700.0
A = np.array([[-2.0, -4.0], [4.0, 0.0]])
B = np.array([60.0, 0.0])
C = np.array([50.0, 0.0])
AREA = 2.0


def memory(omega):
    """Frequency response of the memory, K(i w)."""
    return C @ np.linalg.solve(1j * omega * np.eye(2) - A, B)


def flow(excitation=True, **changed):
    """A file of heave alone."""
    mass = np.zeros((6, 6))
    mass[2, 2] = ADDED
    b, c = np.zeros((2, 6)), np.zeros((6, 2))
    b[:, 2], c[2] = B, C
    file = {
        "schema": "hydro-potential-flow/1",
        "volume": VOLUME,
        "added_mass": mass.tolist(),
        "radiation": {"a": A.tolist(), "b": b.tolist(), "c": c.tolist()},
    }
    if excitation:
        rows = [[0, 0, 9000 - 600 * w, 0, 0, 0] for w in (1, 3, 5)]
        turned = [[0, 0, -300 * w, 0, 0, 0] for w in (1, 3, 5)]
        file["excitation"] = {"frequency": [1, 3, 5], "direction": [0], "real": rows, "imaginary": turned}
    return {**file, **changed}


def load(file, joint='<joint name="heave" type="slide" axis="0 0 1"/>', effects=(), child="", **attributes):
    """A box of 2 x 1 x 0.5 m at its draught of 0.2 m."""
    listed = [{"effect": "hydrostatics", "target": "box", "parameters": {}}, *effects]
    given = {
        "waterline": "0",
        "effects": json.dumps({"schema": "hydro-effects/1", "effects": listed}),
        "potential_flow": json.dumps(file),
        **attributes,
    }
    config = "".join(f"<config key=\"{key}\" value='{value}'/>" for key, value in given.items() if value)
    model = mujoco.MjModel.from_xml_string(f"""
<mujoco><option timestep="0.005" gravity="0 0 {-G}" integrator="implicitfast"/>
  <extension><plugin plugin="hydro.wrench"><instance name="w">{config}</instance></plugin></extension>
  <worldbody><body name="box" pos="0 0 0.05">{joint}<plugin plugin="hydro.wrench" instance="w"/>
    <geom type="box" size="1 0.5 0.25" mass="{MASS}"/>{child}</body></worldbody></mujoco>""")
    return model, mujoco.MjData(model)


def waves(omega, amplitude=0.01):
    """One wave along x."""
    component = {"amplitude": amplitude, "period": 2 * math.pi / omega}
    return json.dumps({"schema": "hydro-waves/1", "components": [component]})


def amplitude_and_phase(times, values, omega):
    """Complex z of values = Re z exp(-i w t)."""
    columns = np.stack([np.cos(omega * times), np.sin(omega * times), np.ones(len(times))], 1)
    fit, *_ = np.linalg.lstsq(columns, values, rcond=None)
    return complex(fit[0], fit[1])


class Heave(unittest.TestCase):
    def test_its_response_to_waves_is_that_of_its_file(self):
        for omega in (1.0, 2.0, 3.0, 3.7, 5.0):
            model, data = load(flow(), waves=waves(omega))
            for _ in range(round(60 / model.opt.timestep)):
                mujoco.mj_step(model, data)
            times, heights = [], []
            for _ in range(round(8 * math.pi / omega / model.opt.timestep)):
                mujoco.mj_step(model, data)
                times.append(data.time)
                heights.append(data.qpos[0])
            found = amplitude_and_phase(np.array(times), np.array(heights), omega) / 0.01
            # Forces are Re X exp(-i w t): velocity is -i w z, and the memory answers with the conjugate of K(i w).
            force = (9000 - 600 * omega) - 300j * omega
            stiffness = RHO * G * AREA
            whole = stiffness - omega**2 * (MASS + ADDED) - 1j * omega * np.conj(memory(omega))
            self.assertLess(abs(found - force / whole), 0.015 * abs(force / whole), omega)

    def test_a_decay_without_waves_is_that_of_its_memory(self):
        model, data = load(flow(excitation=False))
        data.qpos[0] = 0.02
        heights = []
        for _ in range(2000):
            mujoco.mj_step(model, data)
            heights.append(data.qpos[0])
        # The same equations in one matrix, exactly over each step.
        system = np.zeros((4, 4))
        system[0, 1] = 1
        system[1, 0] = -RHO * G * AREA / (MASS + ADDED)
        system[1, 2:] = -C / (MASS + ADDED)
        system[2:, 1], system[2:, 2:] = B, A
        values, vectors = np.linalg.eig(system)
        start = np.linalg.solve(vectors, np.array([0.02, 0, 0, 0], complex))
        times = 0.005 * np.arange(1, 2001)
        expected = (vectors @ (start[:, None] * np.exp(values[:, None] * times))).real[0]
        self.assertLess(np.abs(heights - expected).max(), 0.015 * 0.02)

    def test_copies_and_threads_go_on_with_the_same_bits(self):
        model, data = load(flow(), joint="<freejoint/>", child='<body name="room"/>', waves=waves(2.5))
        for _ in range(300):
            mujoco.mj_step(model, data)
        size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_INTEGRATION)
        state = np.zeros(size)
        mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
        other = mujoco.MjData(model)
        mujoco.mj_setState(model, other, state, mujoco.mjtState.mjSTATE_INTEGRATION)
        for _ in range(200):
            mujoco.mj_step(model, data)
            mujoco.mj_step(model, other)
        np.testing.assert_array_equal(data.qpos, other.qpos)
        ends = []
        for threads in (1, 2):
            boats = Batch(model, 8, threads)
            boats.reset(stage=mujoco.mjtStage.mjSTAGE_NONE.value)
            boats.bind("qpos")[:, 2] += np.linspace(-0.05, 0.05, 8)
            boats.step(nstep=100)
            ends.append(np.array(boats.bind("qpos")))
        np.testing.assert_array_equal(*ends)

    def test_out_of_the_water_it_has_no_load(self):
        model, data = load(flow(), waves=waves(2.0))
        data.qpos[0] = 3
        mujoco.mj_forward(model, data)
        self.assertAlmostEqual(data.qfrc_passive[0], 0, places=9)
        self.assertAlmostEqual(data.qacc[0], -G, places=9)

    def test_a_turned_hull_meets_the_waves_from_its_own_side(self):
        file = flow()
        for rows in (file["excitation"]["real"], file["excitation"]["imaginary"]):
            for row in rows:
                row[0] = row[2]
        file["excitation"] = {
            "frequency": [1, 3, 5],
            "direction": [0, 180],
            "real": [row for one in file["excitation"]["real"] for row in (one, [0] * 6)],
            "imaginary": [row for one in file["excitation"]["imaginary"] for row in (one, [0] * 6)],
        }
        model, data = load(file, joint="<freejoint/>", child='<body name="room"/>', waves=waves(3.0))
        calm = np.array([0, 0, MASS * G])
        for turn, scale, sign in ((0, 1, 1), (math.pi / 2, 0.5, 1), (math.pi, 0, 1)):
            mujoco.mj_resetData(model, data)
            mujoco.mju_euler2Quat(data.qpos[3:7], [0, 0, turn], "xyz")
            mujoco.mj_forward(model, data)
            pushed = (data.qfrc_passive[:3] - calm) / 0.01
            ahead = np.array([math.cos(turn), math.sin(turn), 1]) * 7200 * scale * sign
            np.testing.assert_allclose(pushed, ahead, atol=1e-6)


class Refusals(unittest.TestCase):
    def refused(self, *expected, **kwargs):
        """The scene does not load, and the message has these words."""
        with self.assertRaises(ValueError) as caught:
            load(**kwargs)
        for words in expected:
            self.assertIn(words, str(caught.exception))

    def test_each_says_what_and_where(self):
        self.refused("attribute `potential_flow` needs `waterline`", file=flow(), waterline="")
        self.refused("attribute `potential_flow`", "volume: found -1 m^3", file=flow(volume=-1))
        self.refused("no such file", file=flow(), potential_flow="missing.json")
        six = dict.fromkeys(("surge", "sway", "heave", "roll", "pitch", "yaw"), 1.0)
        added = {"effect": "added_mass", "target": "box", "parameters": six}
        self.refused("has the effect `added_mass` too", file=flow(), effects=[added])
        self.refused('<body name="box_water"/>', file=flow(), joint="<freejoint/>")


if __name__ == "__main__":
    unittest.main()
