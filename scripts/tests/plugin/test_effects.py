"""Named effects in a plain MJCF, in the MuJoCo wheel."""

import copy
import functools
import json
import pathlib
import pickle
import subprocess
import sys
import tempfile
import unittest

import mujoco
import mujoco.rollout
import numpy as np
import scene
from scene import CHECKPOINTS, LIBRARY, steps

SCENE = """
<mujoco>
  <option timestep="0.002" gravity="0 0 {gravity}" integrator="{integrator}"/>
  <extension>
    <plugin plugin="hydro.wrench"><instance name="water">{config}</instance></plugin>
    <plugin plugin="hydro.load_cell"/>
  </extension>
  <worldbody>
    <body name="hull"><freejoint/>
      <plugin plugin="hydro.wrench" instance="water"/>
      <geom type="box" size="0.3 0.2 0.1" mass="2"/><site name="thruster"/>
      <body name="fin" pos="-0.3 0 0">
        <joint name="fin" axis="0 0 1" damping="0.1"/>
        <geom type="capsule" size="0.02" fromto="0 0 0 -0.2 0 0" mass="1"/><site name="cell"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="fin" joint="fin"/><motor name="thruster" site="thruster" gear="1 0 0 0 0 0" ctrlrange="-5 5"/>
  </actuator>
  <sensor>
    <plugin name="water" plugin="hydro.wrench" instance="water"/>
    <plugin name="cell" plugin="hydro.load_cell"><config key="site" value="cell"/></plugin>
  </sensor>
</mujoco>
"""

# The fin gently, the thruster too.
start = functools.partial(scene.start, control=(0.2, 1.0))

AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")


def effect(name, target, **parameters):
    """One entry of an effects.json."""
    return {"effect": name, "target": target, "parameters": parameters}


def on_axes(name, target, values):
    """An entry with one value an axis."""
    return effect(name, target, **dict(zip(AXES, values)))


def document(*entries):
    """The text of an effects.json."""
    return json.dumps({"schema": "hydro-effects/1", "effects": list(entries)})


MANY = document(
    on_axes("added_mass", "hull", [3.0, 6.0, 9.0, 0.1, 0.2, 0.3]),
    on_axes("quadratic_drag", "hull", [5.0, 9.0, 9.0, 0.5, 0.5, 0.5]),
    on_axes("linear_drag", "fin", [1.0, 2.0, 3.0, 0.01, 0.01, 0.01]),
    effect("current", "hull", x=0.1, y=-0.05, z=0.0),
    effect("actuator_deadband", "thruster", width=0.2),
    effect("joint_damping", "fin", damping=0.3),
)


def scene_xml(effects=MANY, gravity=0.0, integrator="Euler", **attributes):
    """The MJCF with these effects and other attributes in its instance."""
    given = {"effects": effects, **attributes}
    quoted = {key: value.replace("&", "&amp;").replace('"', "&quot;") for key, value in given.items() if value}
    config = "".join(f'<config key="{key}" value="{value}"/>' for key, value in quoted.items())
    return SCENE.format(config=config, gravity=gravity, integrator=integrator)


def load(*args, **kwargs):
    """The compiled scene."""
    return mujoco.MjModel.from_xml_string(scene_xml(*args, **kwargs))


class Physics(unittest.TestCase):
    def test_added_mass_of_five_bodies(self):
        for integrator in ("Euler", "implicit", "implicitfast", "RK4"):
            with self.subTest(integrator):
                # All of 3 kg, pushed through the common centre of mass.
                model = load(document(on_axes("added_mass", "hull", [15.0] * 3 + [0.0] * 3)), integrator=integrator)
                data = mujoco.MjData(model)
                hull = model.body("hull").id
                data.xfrc_applied[hull, 2] = 9.0
                mujoco.mj_forward(model, data)
                # The hull's own centre carries the water, the fin hangs on it: force balance along z.
                momentum = sum(model.body_mass[body] * acceleration(model, data, body)[2] for body in (hull, hull + 1))
                self.assertAlmostEqual(momentum + 15.0 * acceleration(model, data, hull)[2], 9.0, places=12)

    def test_a_stiff_drag_stays_stable(self):
        model = load(document(on_axes("linear_drag", "hull", [2000.0] * 3 + [25.0] * 3)))
        data = start(model)
        steps(model, data, 2000)
        self.assertLess(np.abs(data.qvel[:6]).max(), 0.1)

    def test_dry_friction_stops_a_joint_without_trembling(self):
        friction = document(effect("joint_friction", "fin", coulomb=5.0, stribeck=0.5, stribeck_speed=0.01))
        for integrator in ("Euler", "implicit", "implicitfast", "RK4"):
            with self.subTest(integrator):
                model = load(friction, integrator=integrator)
                data = mujoco.MjData(model)
                data.qvel[6] = 3.0
                speeds = []
                for _ in range(200):
                    mujoco.mj_step(model, data)
                    speeds.append(data.qvel[6])
                self.assertGreater(min(speeds), -1e-4)
                self.assertLess(abs(speeds[-1]), 1e-4)

    def test_armature_is_that_of_mujoco(self):
        for integrator in ("Euler", "implicit", "implicitfast", "RK4"):
            with self.subTest(integrator):
                ends = []
                for armature, own in ((0.4, 0.0), (0.0, 0.4)):
                    given = document(effect("joint_armature", "fin", armature=armature))
                    model = load(given, gravity=-9.81, integrator=integrator)
                    model.dof_armature[model.joint("fin").dofadr] += own
                    data = start(model)
                    steps(model, data, 300)
                    ends.append(np.append(data.qpos, data.qvel))
                np.testing.assert_allclose(ends[0], ends[1], rtol=1e-9, atol=1e-9)

    def test_forward_does_not_pile_up(self):
        model = load()
        data = start(model)
        mujoco.mj_forward(model, data)
        once = data.qacc.copy()
        for _ in range(5):
            mujoco.mj_forward(model, data)
        np.testing.assert_allclose(data.qacc, once, rtol=0, atol=1e-12)

    def test_the_sensor_shows_drag_on_its_body(self):
        model = load(document(on_axes("linear_drag", "hull", [10.0] * 6)))
        data = mujoco.MjData(model)
        data.qvel[:3] = 0.5, -0.2, 0.1
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(data.sensor("water").data[:3], [-5.0, 2.0, -1.0], atol=1e-12)

    def test_beside_a_checkpoint(self):
        checkpoint = str(CHECKPOINTS / "lively")
        drag = document(on_axes("linear_drag", "hull", [10.0] * 6))
        readings = []
        for effects in (None, drag):
            model = load(effects, checkpoint=checkpoint)
            data = mujoco.MjData(model)
            data.qvel[:3] = 0.5, 0.0, 0.0
            mujoco.mj_forward(model, data)
            readings.append(data.sensor("water").data.copy())
        np.testing.assert_allclose(readings[1] - readings[0], [-5.0, 0, 0, 0, 0, 0], atol=1e-12)

    def test_a_current_moves_the_water_of_a_checkpoint(self):
        checkpoint = str(CHECKPOINTS / "lively")
        by_effect = load(document(effect("current", "hull", x=0.3, y=0.1, z=0.0)), checkpoint=checkpoint)
        by_attribute = load(None, checkpoint=checkpoint, current="0.3 0.1 0")
        one, other = start(by_effect), start(by_attribute)
        for _ in range(200):
            mujoco.mj_step(by_effect, one)
            mujoco.mj_step(by_attribute, other)
        np.testing.assert_allclose(one.qpos, other.qpos, rtol=0, atol=1e-12)


def acceleration(model, data, body):
    """Acceleration of a body's centre of mass in the world [m/s^2]."""
    mujoco.mj_rnePostConstraint(model, data)
    result = np.zeros(6)
    mujoco.mj_objectAcceleration(model, data, mujoco.mjtObj.mjOBJ_BODY, body, result, 0)
    return result[3:] + model.opt.gravity


class Repeats(unittest.TestCase):
    def check(self, model):
        data = start(model)
        steps(model, data, 30)
        spec = mujoco.mjtState.mjSTATE_INTEGRATION
        state = np.empty(mujoco.mj_stateSize(model, spec))
        mujoco.mj_getState(model, data, state, spec)
        twin, pickled = copy.copy(data), pickle.loads(pickle.dumps(data))
        restored = mujoco.MjData(model)
        mujoco.mj_setState(model, restored, state, spec)
        expected = steps(model, data, 50)
        for other in (twin, pickled, restored):
            np.testing.assert_array_equal(steps(model, other, 50), expected)

    def test_copies_and_states_repeat(self):
        for integrator in ("Euler", "implicitfast", "RK4"):
            with self.subTest(integrator):
                self.check(load(integrator=integrator, gravity=-9.81))

    def test_rollouts_repeat_at_any_number_of_threads(self):
        model = load()
        kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
        states = []
        for seed in range(6):
            data = start(model, seed)
            state = np.empty(mujoco.mj_stateSize(model, kind))
            mujoco.mj_getState(model, data, state, kind)
            states.append(state)
        results = []
        for threads in (1, 4):
            data = [mujoco.MjData(model) for _ in range(threads)]
            results.append(mujoco.rollout.rollout(model, data, np.array(states), nstep=100))
        for one, other in zip(*results):
            np.testing.assert_array_equal(one, other)

    def test_a_model_pickles(self):
        model = load()
        twin = pickle.loads(pickle.dumps(model))
        np.testing.assert_array_equal(steps(model, start(model), 20), steps(twin, start(twin), 20))

    def test_a_pickle_works_in_another_process(self):
        model = load()
        data = start(model)
        steps(model, data, 10)
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "pair.pickle"
            path.write_bytes(pickle.dumps((model, data)))
            code = (
                f"import mujoco, pickle; mujoco.mj_loadPluginLibrary({LIBRARY!r});"
                f'm, d = pickle.load(open({str(path)!r}, "rb")); mujoco.mj_step(m, d); print(repr(d.qpos[0]))'
            )
            out = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
        mujoco.mj_step(model, data)
        self.assertEqual(out.strip(), repr(data.qpos[0]))


class Files(unittest.TestCase):
    def test_a_file_does_what_the_text_does(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "effects.json"
            path.write_text(MANY)
            model = load(str(path))
            np.testing.assert_array_equal(steps(model, start(model), 20), steps(load(), start(load()), 20))


class Refusals(unittest.TestCase):
    def refused(self, *wanted, **kwargs):
        with self.assertRaises(ValueError) as caught:
            load(**kwargs)
        for text in wanted:
            self.assertIn(text, str(caught.exception))

    def test_everything_wrong_is_named(self):
        self.refused("not JSON", "line 1", effects='{"schema"')
        self.refused("schema", effects='{"schema": "other/1", "effects": []}')
        self.refused("no effect `added_mas`", "added_mass", effects=document(effect("added_mas", "hull")))
        self.refused("`keel`", "hull, fin", effects=document(on_axes("linear_drag", "keel", [1.0] * 6)))
        self.refused("missing", "damping", effects=document(effect("joint_damping", "fin")))
        self.refused(
            "armature is -0.4 [kg m^2], expected 0 to", effects=document(effect("joint_armature", "fin", armature=-0.4))
        )
        self.refused("`speed`", effects=document(effect("joint_damping", "fin", damping=1.0, speed=2.0)))
        self.refused("effects.json", "HYDRO_PATH", effects="no/effects.json")
        self.refused("sensor", effects=document(effect("sensor_bias", "water", bias_0=1.0)))
        self.refused(
            "effect `joint_backlash`", "a second joint", effects=document(effect("joint_backlash", "fin", play=0.1))
        )
        self.refused("`checkpoint` and `effects` are missing", effects=None)

    def test_a_body_without_room_is_told_what_to_add(self):
        text = scene_xml(document(on_axes("added_mass", "hull", [1.0] * 6)))
        begin, end = text.index('<body name="fin"'), text.index("</body>") + len("</body>")
        text = text[:begin] + text[end:]
        text = text.replace('<motor name="fin" joint="fin"/>', "")
        text = text.replace(
            '<plugin name="cell" plugin="hydro.load_cell"><config key="site" value="cell"/></plugin>', ""
        )
        with self.assertRaises(ValueError) as caught:
            mujoco.MjModel.from_xml_string(text)
        self.assertIn('<body name="hull_water"/>', str(caught.exception))
        mended = text.replace('<site name="thruster"/>', '<site name="thruster"/><body name="hull_water"/>')
        model = mujoco.MjModel.from_xml_string(mended)
        mujoco.mj_step(model, mujoco.MjData(model))


if __name__ == "__main__":
    unittest.main()
