"""Effects of the user's own in a plain MJCF, in the MuJoCo wheel: the definition stands in the file of effects."""

import copy
import json
import unittest

import mujoco
import numpy as np
from scene import Warnings, state_of, steps

SCENE = """
<mujoco>
  <option timestep="0.002" gravity="0 0 0"/>
  <extension>
    <plugin plugin="hydro.wrench"><instance name="water">
      <config key="effects" value="{effects}"/></instance></plugin>
  </extension>
  <worldbody>
    <body name="hull"><freejoint/>
      <plugin plugin="hydro.wrench" instance="water"/>
      <geom type="box" size="0.3 0.2 0.1" mass="2"/>
      <body name="fin" pos="-0.3 0 0">
        <joint name="fin" axis="0 0 1"/>
        <geom type="capsule" size="0.02" fromto="0 0 0 -0.2 0 0" mass="1"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="port" joint="fin"/></actuator>
  <sensor><plugin name="water" plugin="hydro.wrench" instance="water"/></sensor>
</mujoco>
"""

POINT, ANCHOR = (-0.3, 0.0, 0.05), (0.0, 0.0, -3.0)


def parameter(unit, lower, upper, null=0.0):
    return {"unit": unit, "lower": lower, "upper": upper, "null": null, "prior_sd": 1.0}


TETHER = {
    "summary": "a spring to an anchor, and drag",
    "target": "body",
    "point": POINT,
    "parameters": {
        "stiffness": parameter("N/m", 0, 500),
        "length": parameter("m", 0.5, 10, 2.0),
        "drag": parameter("N s^2/m^2", 0, 50),
    },
    "constants": {"anchor": {"value": ANCHOR[2], "unit": "m"}, "shortest": {"value": 0.05, "unit": "m"}},
    "let": {
        "above": "z - anchor",
        "distance": "max(norm(x, y, above), shortest)",
        "pull": "stiffness * max(distance - length, 0) / distance",
        "slow": "drag * norm(v_x, v_y, v_z)",
    },
    "world_force": {
        "x": "-pull * x - slow * v_x",
        "y": "-pull * y - slow * v_y",
        "z": "-pull * above - slow * v_z",
    },
}
VALUES = {"stiffness": 30.0, "length": 2.0, "drag": 4.0}

LAGGING = {
    "summary": "drag that lags, and a push with the command",
    "target": "hinge",
    "force": "-amount * memory + push * command",
    "memory": {"input": "qdot", "time_constant": "time"},
    "commands": {"command": "port"},
    "parameters": {
        "amount": parameter("N m s/rad", 0, 10),
        "push": parameter("N m", -1, 1),
        "time": parameter("s", 0.01, 5, 0.5),
    },
}
LAGGING_VALUES = {"amount": 0.2, "push": 0.1, "time": 0.3}


def entry(name, target, definition, values):
    return {"effect": f"user.{name}", "target": target, "parameters": values, "definition": definition}


def document(*entries):
    return json.dumps({"schema": "hydro-effects/1", "effects": list(entries)})


def xml(effects):
    return SCENE.format(effects=effects.replace("&", "&amp;").replace('"', "&quot;"))


def loaded(*entries):
    return mujoco.MjModel.from_xml_string(xml(document(*entries)))


def moving(model, seed=0):
    data = mujoco.MjData(model)
    random = np.random.default_rng(seed)
    data.qpos[:3] = (0.5, -0.3, 0.2)
    quaternion = random.standard_normal(4)
    data.qpos[3:7] = quaternion / np.linalg.norm(quaternion)
    data.qvel[:] = 0.4 * random.standard_normal(model.nv)
    data.ctrl[:] = 0.7
    return data


class OwnEffects(unittest.TestCase):
    def test_a_tether_is_its_formula(self):
        model = loaded(entry("tether", "hull", TETHER, VALUES))
        for seed in range(5):
            data = moving(model, seed)
            mujoco.mj_forward(model, data)
            rotation = data.xmat[1].reshape(3, 3)
            arm = rotation @ POINT
            place, velocity = data.xpos[1] + arm, data.qvel[:3] + np.cross(rotation @ data.qvel[3:6], arm)
            away = place - ANCHOR
            distance = np.linalg.norm(away)
            force = -VALUES["stiffness"] * max(distance - VALUES["length"], 0) * away / distance
            force -= VALUES["drag"] * np.linalg.norm(velocity) * velocity
            expected = np.concatenate([rotation.T @ force, rotation.T @ np.cross(arm, force)])
            np.testing.assert_allclose(data.sensordata, expected, rtol=1e-10, atol=1e-10)

    def test_energy_goes_into_the_drag_alone(self):
        model = loaded(entry("tether", "hull", TETHER, {**VALUES, "drag": 0.0}))
        data = moving(model)
        data.ctrl[:] = 0.0

        def energy():
            mujoco.mj_forward(model, data)
            mujoco.mj_energyVel(model, data)
            place = data.xpos[1] + data.xmat[1].reshape(3, 3) @ POINT
            stretched = max(np.linalg.norm(place - ANCHOR) - VALUES["length"], 0)
            return data.energy[1] + 0.5 * VALUES["stiffness"] * stretched**2

        before = energy()
        mujoco.mj_step(model, data, 1000)
        self.assertLess(abs(energy() - before), 1e-2 * before)

    def test_memory_and_command_of_a_hinge(self):
        model = loaded(entry("lagging", "fin", LAGGING, LAGGING_VALUES))
        data = moving(model)
        self.assertEqual(data.plugin_state.size, 1)
        remembered = 0.0
        for _ in range(200):
            mujoco.mj_forward(model, data)
            expected = -0.2 * remembered + 0.1 * 0.7
            self.assertAlmostEqual(data.qfrc_passive[6], expected, places=10)
            mujoco.mj_step(model, data)
            # Exact for a velocity that is constant over the step.
            remembered += -np.expm1(-0.002 / 0.3) * (data.qvel[6] - remembered)
            self.assertAlmostEqual(data.plugin_state[0], remembered, places=12)

    def test_copies_repeat_bit_for_bit(self):
        model = loaded(
            entry("tether", "hull", TETHER, VALUES),
            entry("lagging", "fin", LAGGING, LAGGING_VALUES),
        )
        data = moving(model)
        steps(model, data, 50)
        other = copy.copy(data)
        for one, two in zip(steps(model, data, 100), steps(model, other, 100)):
            np.testing.assert_array_equal(one, two)

    def test_inertia_moves_with_the_body(self):
        # Twice the mass of hull and fin together, in every direction.
        definition = {
            "summary": "water that moves along",
            "target": "body",
            "parameters": {"mass": parameter("kg", 0, 50)},
            "inertia": dict.fromkeys(("surge", "sway", "heave"), "mass"),
        }
        accelerations = []
        for mass in (0.0, 6.0):
            model = loaded(entry("water", "hull", definition, {"mass": mass}))
            data = mujoco.MjData(model)
            data.xfrc_applied[1, 0] = 3.0
            mujoco.mj_forward(model, data)
            accelerations.append(data.qacc[0])
        self.assertAlmostEqual(accelerations[0], 1.0, places=9)
        self.assertAlmostEqual(accelerations[1], 1.0 / 3.0, places=9)

    def test_a_memory_that_is_no_number_is_no_force_and_one_warning(self):
        model = loaded(entry("lagging", "fin", LAGGING, LAGGING_VALUES))
        data = moving(model)
        data.ctrl[:] = 0.0
        spoilt = mujoco.mjtState.mjSTATE_PLUGIN
        with Warnings() as warned:
            mujoco.mj_setState(model, data, np.array([np.nan]), spoilt)
            for _ in range(20):
                mujoco.mj_step(model, data)
                self.assertTrue(np.isfinite(data.qpos).all() and np.isfinite(data.qvel).all())
                self.assertEqual(data.qfrc_passive[6], 0.0)
        own = [text for text in warned if "user.lagging" in text]
        self.assertEqual(len(own), 1, warned)
        self.assertIn("is not a finite number", own[0])
        mujoco.mj_resetData(model, data)
        data.qvel[6] = 1.0
        mujoco.mj_step(model, data, 20)
        self.assertLess(data.qfrc_passive[6], 0.0)
        self.assertTrue(np.isfinite(state_of(model, data)).all())

    def refused(self, change, *words):
        definition = copy.deepcopy(TETHER)
        listed = entry("tether", "hull", definition, dict(VALUES))
        change(definition, listed)
        with self.assertRaises(ValueError) as refusal:
            loaded(listed)
        for word in ("attribute `effects`", *words):
            self.assertIn(word, str(refusal.exception))

    def test_refusals(self):
        def put(table, key, value):
            return lambda definition, _: definition[table].update({key: value})

        self.refused(put("world_force", "x", "-pul * x"), "[world_force] x", "did you mean `pull`?")
        self.refused(put("world_force", "x", "-pull"), "expected [N]")
        self.refused(put("world_force", "x", "-pull * x / (above / shortest)"), "may be zero")
        self.refused(put("parameters", "drag", {"unit": "N s^2/m^2", "prior_sd": 1}), "needs `lower` and `upper`")
        self.refused(put("let", "slow", "exp(z / shortest) * drag"), "may be infinite within the bounds")
        self.refused(put("let", "slow", "(" * 40 + "1" + ")" * 40), "parentheses within each other")
        self.refused(put("let", "slow", "slow"), "depends on itself")
        self.refused(lambda _, listed: listed.pop("definition"), "needs its `definition`")
        self.refused(lambda _, listed: listed["parameters"].update(drag=51.0), "drag is 51", "expected 0 to 50")
        self.refused(lambda _, listed: listed["parameters"].pop("drag"), "missing drag")
        self.refused(lambda _, listed: listed.update(effect="user.lift"), "is the name of a built-in effect")
        self.refused(lambda _, listed: listed.update(target="hul"), "did you mean `hull`?")


if __name__ == "__main__":
    unittest.main()
