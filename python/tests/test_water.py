"""`add_water`, `wrench`, what comes with the package. Skipped without the library."""

import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from unittest import mock

import mujoco
import numpy as np

import hydro_mujoco
from hydro_mujoco import plugin, requirement
from hydro_mujoco.errors import DataError

HULL = """<mujoco><option timestep="0.005"/><worldbody>
  <body name="hull"><freejoint/><geom name="keel" type="ellipsoid" size="0.33 0.18 0.1" mass="25"/></body>
  <body name="buoy" pos="2 0 0"><freejoint/><geom size="0.1" mass="2"/><body name="mast"><geom size="0.01" mass="0.1"/></body></body>
</worldbody></mujoco>"""
DRAG = {"surge": 18.0, "sway": 30.0, "heave": 40.0, "roll": 0.5, "pitch": 0.7, "yaw": 0.8}


def hull() -> mujoco.MjSpec:
    return mujoco.MjSpec.from_string(HULL)


def still(spec: mujoco.MjSpec) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


@unittest.skipUnless(plugin.built_library().is_file(), "no plugin library: cargo build --release")
class AddWater(unittest.TestCase):
    def test_effects_by_name_act_on_the_body(self):
        spec = hull()
        self.assertIs(hydro_mujoco.add_water(spec, body="hull", effects={"quadratic_drag": DRAG}), spec)
        model = spec.compile()
        data = mujoco.MjData(model)
        data.qvel[:3] = 2, 0, 0
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(hydro_mujoco.wrench(model, data, "hull"), [-72, 0, 0, 0, 0, 0], atol=1e-9)
        self.assertEqual(data.qfrc_passive[0], -72)

    def test_every_form_of_effects_is_the_same(self):
        one = [{"effect": "quadratic_drag", "parameters": DRAG}]
        whole = {"schema": "hydro-effects/1", "effects": [{"target": "hull", **one[0]}]}
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "effects.json")
            path.write_text(json.dumps(whole))
            forms = [{"quadratic_drag": DRAG}, one, whole, json.dumps(whole), path, str(path)]
            for form in forms:
                model, data = still(hydro_mujoco.add_water(hull(), body="hull", effects=form, current=(1, 0, 0)))
                np.testing.assert_allclose(hydro_mujoco.wrench(model, data, "hull")[:3], [18, 0, 0], atol=1e-9)

    def test_two_bodies_a_surface_waves_and_added_mass(self):
        spec = hull()
        waves = [{"height": 0.3, "period": 4.5, "direction": 20}]
        sea = {"waterline": 0, "waves": waves, "current": np.array([0.2, 0, 0])}
        added = {"surge": 6, "sway": 12, "heave": 18, "roll": 0.12, "pitch": 0.35, "yaw": 0.35}
        hydro_mujoco.add_water(
            spec, body="hull", effects={"hydrostatics": {}, "added_mass": added}, hull=["keel"], **sea
        )
        hydro_mujoco.add_water(spec, body="buoy", effects={"hydrostatics": {}}, **sea)
        model, data = still(spec)
        self.assertEqual(model.nbody, 5)  # the child that holds the added mass
        for _ in range(400):
            mujoco.mj_step(model, data)
        self.assertTrue(np.isfinite(data.qpos).all())
        self.assertGreater(hydro_mujoco.wrench(model, data, "hull")[2], 50)
        self.assertGreater(hydro_mujoco.wrench(model, data, "buoy")[2], 5)

    def test_a_checkpoint_by_its_name_from_any_directory(self):
        spec = mujoco.MjSpec.from_file(hydro_mujoco.scene("b1_truth"))
        spec.option.density = spec.option.viscosity = 0
        model, data = still(
            hydro_mujoco.add_water(spec, body="trunk", checkpoint=hydro_mujoco.checkpoint("b1-relaxation"))
        )
        self.assertGreater(np.abs(hydro_mujoco.wrench(model, data, "trunk")).max(), 1)

    def test_refusals(self):
        drag = {"quadratic_drag": DRAG}
        with self.assertRaisesRegex(DataError, "no body is called `hul`; there are: `hull`, `buoy`, `mast`"):
            hydro_mujoco.add_water(hull(), body="hul", effects=drag)
        with self.assertRaisesRegex(DataError, "nothing acts"):
            hydro_mujoco.add_water(hull(), body="hull")
        with self.assertRaisesRegex(DataError, "current is .1, 2.; expected three numbers"):
            hydro_mujoco.add_water(hull(), body="hull", effects=drag, current=[1, 2])
        spec = hydro_mujoco.add_water(hull(), body="hull", effects=drag)
        with self.assertRaisesRegex(DataError, "`hull` carries the plugin hydro.wrench already"):
            hydro_mujoco.add_water(spec, body="hull", effects=drag)
        wrong = hydro_mujoco.add_water(hull(), body="hull", effects={"quadratic_drags": DRAG})
        with self.assertRaisesRegex(ValueError, "quadratic_drags"):
            wrong.compile()

    def test_wrench_refuses(self):
        model, data = still(hydro_mujoco.add_water(hull(), body="hull", effects={"quadratic_drag": DRAG}))
        with self.assertRaisesRegex(DataError, "no body is called `fin`; there are: `hull`, `buoy`, `mast`"):
            hydro_mujoco.wrench(model, data, "fin")
        with self.assertRaisesRegex(DataError, "`buoy` carries no hydro.wrench"):
            hydro_mujoco.wrench(model, data, "buoy")
        spec = hydro_mujoco.add_water(hull(), body="hull", effects={"quadratic_drag": DRAG})
        spec.delete(spec.sensors[0])
        model, data = still(spec)
        with self.assertRaisesRegex(DataError, 'no sensor reads the water of body `hull`.*instance="hull_water"'):
            hydro_mujoco.wrench(model, data, "hull")

    def test_a_second_copy_says_that_it_does_not_act(self):
        library = plugin.built_library()
        with tempfile.TemporaryDirectory() as folder:
            other = Path(folder, library.name)
            other.write_bytes(library.read_bytes())
            code = f"""
import mujoco
for path in ({str(library)!r}, {str(other)!r}, {str(other)!r}): mujoco.mj_loadPluginLibrary(path)
import hydro_mujoco.doctor
print(hydro_mujoco.doctor.examine()[0])
"""
            run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=folder)
        self.assertEqual((run.returncode, run.stdout.splitlines()[-1]), (0, "True"), run.stderr)
        said = run.stdout + run.stderr
        self.assertEqual(said.count("that copy acts, and this one does not"), 1, said)
        self.assertIn(str(library.resolve()), said)


class Packaged(unittest.TestCase):
    def test_by_name(self):
        for name in ("b1_swim", "boat", "rov", "fish", "gap/vehicle"):
            self.assertTrue(Path(hydro_mujoco.scene(name)).is_file())
        self.assertTrue(Path(hydro_mujoco.checkpoint("b1-relaxation"), "weights.safetensors").is_file())
        self.assertTrue(Path(hydro_mujoco.examples(), "water", "boat.py").is_file())

    def test_refusals_list_what_there_is(self):
        with self.assertRaisesRegex(DataError, "no scene is called `b2`; there are: .*b1_swim.*boat.*gap/vehicle"):
            hydro_mujoco.scene("b2")
        there = (
            "b1-relaxation, b1-strip, b1-strip-attention-ode, b1-strip-cnode, b1-strip-lstm, b1-strip-mlp-ode, b1-task2"
        )
        with self.assertRaisesRegex(DataError, f"no checkpoint is called `b2`; there are: {there}"):
            hydro_mujoco.checkpoint("b2")

    def test_a_mujoco_that_is_too_old(self):
        with self.assertRaisesRegex(ImportError, "needs MuJoCo 4.0.0, and mujoco 3.17.0 is installed: pip install"):
            requirement.check("3.17.0")
        for version in ("4.0.0", "4.0.1", "4.1.0", "5.0.0"):
            requirement.check(version)

    def test_the_library_is_that_of_the_environment(self):
        with mock.patch.dict("os.environ", {"HYDRO_PLUGIN": "/some/libhydro_plugin.so"}):
            self.assertEqual(hydro_mujoco.library(), "/some/libhydro_plugin.so")


if __name__ == "__main__":
    unittest.main()
