"""The recorder of any robot: its label against MuJoCo, its bytes, its refusals."""

import json
import subprocess
import sys
import tempfile
import unittest
import unittest.mock
import warnings
from pathlib import Path

import mujoco
import numpy as np
from safetensors.numpy import load_file

import hydro_mujoco
import models
from hydro_mujoco import DataError, Notice
from hydro_mujoco.record import record, recorder
from hydro_mujoco.recording import plan, shards, simulation
from hydro_mujoco.recording.files import sha256

SMALL = {"trials": 10, "samples": 40, "shard_size": 4, "seed": 5}


def contents(folder):
    return {path.name: path.read_bytes() for path in sorted(Path(folder).iterdir())}


class Recorder(unittest.TestCase):
    """Writes models and records them in a temporary folder."""

    #: Worker processes do not know of what is patched here.
    warm_up = 0.4

    def setUp(self):
        self.enterContext(unittest.mock.patch.object(plan, "WARM_UP", self.warm_up))
        self.enterContext(unittest.mock.patch.object(recorder, "PILOT", 8))
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))

    def write(self, xml, name="model.xml"):
        path = self.folder / name
        path.write_text(xml)
        return path

    def record(self, xml, name="data", **options):
        """The manifest, all tensors of the three splits one after the other, and what was said."""
        model = xml if isinstance(xml, mujoco.MjSpec) else self.write(xml)
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            manifest = record(model, self.folder / name, **(SMALL | options))
        files = [entry["file"] for part in manifest["splits"].values() for entry in part["shards"]]
        shards = [load_file(self.folder / name / file) for file in files]
        tensors = {key: np.concatenate([shard[key] for shard in shards]) for key in shards[0] if key != "time"}
        notes = [str(warning.message) for warning in said if issubclass(warning.category, Notice)]
        return manifest, tensors, notes

    def refused(self, xml, words, **options):
        path = xml if isinstance(xml, Path) else self.write(xml)
        with self.assertRaisesRegex(DataError, words) as caught:
            record(path, self.folder / "refused", **(SMALL | options))
        self.assertNotIn("\n", str(caught.exception))
        self.assertFalse((self.folder / "refused").exists(), "a refused model left a folder")


class Fluid(Recorder):
    def test_the_label_is_the_fluids_force_at_the_features(self):
        manifest, tensors, _ = self.record(models.fish())
        model = mujoco.MjModel.from_xml_string(models.fish())
        at = {name: i for i, name in enumerate(manifest["features"])}
        data = mujoco.MjData(model)
        for i, k in ((0, 0), (3, 17), (9, 39)):
            x = tensors["x"][i, k].astype(float)
            for name in ("tail", "fin", "nose"):
                data.joint(name).qpos, data.joint(name).qvel = x[at[f"position.{name}"]], x[at[f"velocity.{name}"]]
            quaternion = x[at["quaternion.w"] :][:4]
            turn = np.zeros(9)
            mujoco.mju_quat2Mat(turn, quaternion)
            turn = turn.reshape(3, 3)
            data.qpos[3:7] = quaternion
            data.qvel[:3] = turn @ x[at["linear_velocity.x"] :][:3]
            data.qvel[3:6] = x[at["angular_velocity.x"] :][:3]
            mujoco.mj_forward(model, data)
            wanted = np.concatenate((turn.T @ data.qfrc_fluid[:3], data.qfrc_fluid[3:6]))
            np.testing.assert_allclose(tensors["wrench"][i, k], wanted, rtol=1e-3, atol=1e-4)

    def test_the_manifest_says_what_was_recorded(self):
        manifest, tensors, notes = self.record(models.fish())
        joints = ["tail", "fin", "nose"]
        self.assertEqual(manifest["features"][:6], [f"{what}.{j}" for what in ("position", "velocity") for j in joints])
        self.assertEqual(len(manifest["features"]), 16)
        self.assertEqual(tensors["x"].shape, (10, 40, 16))
        self.assertEqual(manifest["sample_period"], 0.008)
        self.assertEqual(manifest["physics_timestep"], 0.004)
        self.assertEqual(manifest["water"]["kind"], "fluid")
        self.assertEqual([link["name"] for link in manifest["kinematics"]["links"]], ["hull", "tail", "fin", "nose"])
        self.assertEqual(manifest["notes"], notes)
        self.assertTrue(any("contacts are off" in note for note in notes))
        np.testing.assert_array_equal(tensors["wrench"], tensors["wrench_clean"])
        self.assertNotIn("hydrostatic", tensors)
        self.assertEqual(json.loads((self.folder / "data/manifest.json").read_text()), manifest)
        for part in manifest["splits"].values():
            for entry in part["shards"]:
                self.assertEqual(sha256(self.folder / "data" / entry["file"]), entry["sha256"])

    def test_every_actuator_moves_its_joint_within_limits(self):
        manifest, tensors, _ = self.record(models.fish(), trials=20)
        at = {name: i for i, name in enumerate(manifest["features"])}
        for joint, most in (("tail", np.radians(60)), ("nose", np.radians(40))):
            angle = tensors["x"][..., at[f"position.{joint}"]]
            self.assertGreater(angle.std(), 0.1)
            self.assertLess(np.abs(angle).max(), most + 0.2)
        self.assertGreater(tensors["condition"].max(), 0)
        for name in ("angular_velocity.x", "linear_velocity.x", "quaternion.x"):
            self.assertGreater(tensors["x"][..., at[name]].std(), 0.02)

    def test_a_varied_density_is_a_feature(self):
        manifest, tensors, _ = self.record(models.fish(), density=(990, 1030))
        self.assertEqual((manifest["features"][-1], manifest["feature_units"][-1]), ("density", "kg/m^3"))
        density = tensors["x"][..., -1]
        self.assertTrue(((density >= 990) & (density <= 1030)).all())
        np.testing.assert_array_equal(np.diff(density, axis=1) != 0, np.diff(tensors["condition"], axis=1) != 0)

    def test_gravcomp_is_buoyancy_where_it_is_asked_for(self):
        _, without, _ = self.record(models.fish(), "without")
        manifest, tensors, _ = self.record(models.fish(), "with", buoyancy=True)
        self.assertTrue(manifest["water"]["buoyancy"])
        lift = np.linalg.norm(tensors["hydrostatic"][..., :3], axis=-1)
        np.testing.assert_allclose(lift, 2 * 9.81, rtol=1e-5)
        np.testing.assert_allclose(tensors["wrench"] - tensors["hydrostatic"], without["wrench"], atol=2e-5)

    def test_noise_is_a_share_of_the_deviation(self):
        manifest, tensors, _ = self.record(models.fish(), noise=0.1)
        noise = (tensors["wrench"] - tensors["wrench_clean"]).reshape(-1, 6).std(axis=0)
        np.testing.assert_allclose(noise, 0.1 * np.array(manifest["wrench_std"]), rtol=0.3)
        self.assertEqual(manifest["perturbation"], 0.1)

    def test_a_robot_without_actuators_is_pushed(self):
        _, tensors, notes = self.record(models.fish(actuators=""))
        self.assertIn("no actuator moves the robot: it is pushed alone", notes)
        self.assertGreater(tensors["wrench"].std(), 0)

    def test_components_that_never_change_are_no_outputs(self):
        ball = """<mujoco><option density="1000" viscosity="0.01" integrator="implicitfast"/><worldbody><body name="ball">
          <freejoint/><geom size="0.1" mass="4"/></body></worldbody></mujoco>"""
        still = ball.replace('viscosity="0.01"', "").replace(
            "<geom ", '<geom fluidshape="ellipsoid" fluidcoef="0.5 0.5 0 0 0" '
        )
        manifest, tensors, _ = self.record(ball, "all")
        self.assertEqual(len(manifest["outputs"]), 6)
        manifest, tensors, notes = self.record(still, "three")
        self.assertEqual(manifest["outputs"], ["force.x", "force.y", "force.z"])
        self.assertEqual(tensors["wrench"].shape[-1], 3)
        self.assertTrue(any("`torque.x`" in note for note in notes))

    def test_a_carriage_has_the_components_that_its_slides_feel(self):
        slides = '<joint name="x" type="slide" axis="1 0 0"/><joint name="y" type="slide" axis="0 1 0"/>'
        manifest, tensors, _ = self.record(models.fish(joint=slides), body="hull")
        self.assertEqual(manifest["features"][-2:], ["linear_velocity.x", "linear_velocity.y"])
        self.assertNotIn("quaternion.w", manifest["features"])
        self.assertEqual(manifest["outputs"], ["force.x", "force.y"])
        model = mujoco.MjModel.from_xml_string(models.fish(joint=slides))
        data = mujoco.MjData(model)
        x = tensors["x"][3, 20].astype(float)
        for i, name in enumerate(("tail", "fin", "nose")):
            data.joint(name).qpos, data.joint(name).qvel = x[i], x[3 + i]
        data.qvel[:2] = x[6:8]
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(tensors["wrench"][3, 20], data.qfrc_fluid[:2], rtol=1e-3, atol=1e-5)

    def test_ball_joints_are_left_out_and_named(self):
        more = '<body name="b" pos="0 0 0.1"><joint name="socket" type="ball"/><geom size="0.02" mass="0.1"/></body>'
        xml = models.fish().replace('<body name="nose"', more + '<body name="nose"')
        manifest, _, notes = self.record(xml)
        self.assertEqual(len(manifest["features"]), 16)
        self.assertTrue(any("`socket`" in note for note in notes))

    def test_two_hundred_joints(self):
        fins = "".join(
            f'<body pos="{0.01 * n - 1} 0 0"><joint name="j{n}" axis="0 1 0" damping="0.05" armature="0.01"/>'
            '<geom type="capsule" size="0.004" fromto="0 0 0 0 0 -0.1"/></body>'
            for n in range(200)
        )
        xml = f"""<mujoco><option density="1000" viscosity="0.001" timestep="0.005" integrator="implicitfast"/><worldbody>
          <body name="hull" gravcomp="1"><freejoint/><geom type="ellipsoid" size="1 0.2 0.2" mass="100"/>{fins}</body>
        </worldbody></mujoco>"""
        manifest, tensors, notes = self.record(xml, trials=3, samples=4, splits=(0.4, 0.3, 0.3))
        self.assertEqual(len(manifest["features"]), 410)
        self.assertNotIn("kinematics", manifest)
        self.assertTrue(any("64 at most" in note for note in notes))
        self.assertTrue(np.isfinite(tensors["x"]).all())


class Workers(Recorder):
    warm_up = plan.WARM_UP

    def test_two_workers_and_a_resume_give_the_same_bytes(self):
        path = self.write(models.fish())
        few = SMALL | {"trials": 5, "samples": 10, "splits": (0.6, 0.2, 0.2), "shard_size": 2}
        for name, workers in (("data", 1), ("more/data", 2)):
            record(path, self.folder / name, **few, workers=workers)
        one = contents(self.folder / "data")
        self.assertEqual(contents(self.folder / "more/data"), one)
        shard = self.folder / "data" / "train-00001-of-00002.safetensors"
        shard.unlink()
        record(path, self.folder / "data", **few, resume=True)
        self.assertEqual(contents(self.folder / "data"), one)


class Bytes(Recorder):
    def test_another_seed_gives_others(self):
        _, first, _ = self.record(models.fish(), "a")
        _, second, _ = self.record(models.fish(), "b", seed=6)
        self.assertFalse(np.any(first["x"] == second["x"]))

    def test_a_spec_is_recorded_and_left_as_it_was(self):
        spec = mujoco.MjSpec.from_string(models.fish())
        _, from_spec, _ = self.record(spec, "spec")
        _, from_file, _ = self.record(models.fish(), "file")
        np.testing.assert_array_equal(from_spec["wrench"], from_file["wrench"])
        self.assertFalse(spec.option.disableflags)

    def test_resume_with_another_model_is_refused(self):
        path = self.write(models.fish())
        record(path, self.folder / "data", **SMALL)
        self.write(models.fish(viscosity=0.002))
        with self.assertRaisesRegex(DataError, "made with other settings"):
            record(path, self.folder / "data", **SMALL, resume=True)

    def test_an_output_that_exists_is_refused(self):
        (self.folder / "mine").mkdir()
        (self.folder / "mine/notes.txt").write_text("mine")
        with self.assertRaisesRegex(DataError, r"not empty \(notes.txt\)"):
            record(self.write(models.fish()), self.folder / "mine", **SMALL)
        (self.folder / "file").write_text("mine")
        with self.assertRaisesRegex(DataError, "is a file"):
            record(self.write(models.fish()), self.folder / "file", **SMALL)


class Unstable(Recorder):
    #: Explicit drag on a sheet that is light for its step.
    SHEET = """<mujoco><option density="1000" viscosity="{viscosity}" timestep="0.01" integrator="Euler"/><worldbody>
      <body name="sheet"><freejoint/><geom type="box" size="0.2 0.2 0.002" mass="{mass}"/></body></worldbody></mujoco>"""

    def test_a_robot_that_is_always_unstable_is_refused(self):
        xml = self.SHEET.format(viscosity=1.0, mass=0.01)
        self.refused(xml, r"8 of 8 trial trajectories are unstable .*implicitfast.*--effort")

    def test_now_and_then_it_is_drawn_again_counted_and_said_once(self):
        original, calls = simulation._faults, [0]

        def sometimes(system, batch, made):
            fault = original(system, batch, made)
            calls[0] += 1
            # The pilot and the probe of the drag come first; then every second call loses its first simulation.
            if len(fault) not in (7, recorder.PILOT) and calls[0] % 2:
                fault[0] = "as the test wants it"
            return fault

        with unittest.mock.patch.object(simulation, "_faults", sometimes):
            manifest, tensors, notes = self.record(models.fish())
        self.assertGreater(manifest["drawn_again"], 0)
        self.assertEqual(len([note for note in notes if "drawn again" in note]), 1)
        self.assertTrue(np.isfinite(tensors["wrench"]).all())

    def test_too_many_end_the_recording(self):
        original = simulation._faults
        turn = [0]

        def often(system, batch, made):
            fault = original(system, batch, made)
            turn[0] += 1
            if len(fault) in (1, 2, 3, 4) and turn[0] % 4:
                fault[:] = "as the test wants it"
            return fault

        self.assertLess(shards.TOO_OFTEN, 1)
        with (
            unittest.mock.patch.object(simulation, "_faults", often),
            self.assertRaisesRegex(DataError, "are unstable"),
        ):
            record(self.write(models.fish()), self.folder / "data", **SMALL)


class Refusals(Recorder):
    def test_no_such_file(self):
        self.refused(self.folder / "none.xml", "none.xml: no such file")

    def test_no_xml(self):
        self.refused("<mujoco><worldbody></mujoco>", "model.xml: XML")
        self.refused(models.fish(joint="<fleejoint/>"), "model.xml: XML Error.*fleejoint")

    def test_no_free_body(self):
        self.refused(models.fish(joint='<joint name="root"/>'), "no body of the model has a free joint.*<freejoint/>")
        slide = '<joint name="rail" type="slide"/>'
        self.refused(models.fish(joint=slide), "or name a body that slides alone hold: `hull`")

    def test_a_body_that_does_not_exist(self):
        self.refused(models.fish(), "no body is called `trunk`; there are: `hull`, `tail`, `fin`, `nose`", body="trunk")

    def test_a_body_without_a_free_joint(self):
        self.refused(models.fish(), "body `tail` has no free joint.*with a free joint: `hull`", body="tail")

    def test_no_water(self):
        self.refused(
            models.fish(density=0, viscosity=0), "the model has no water: give it MuJoCo's fluid .*hydro.wrench"
        )

    def test_water_that_the_model_does_not_have(self):
        self.refused(models.fish(), "water `effects` is asked for; the model has fluid alone", water="effects")
        self.refused(models.fish(), "water is `sea`; expected one of fluid, effects, both", water="sea")

    def test_water_that_does_not_act_on_the_body(self):
        xml = """<mujoco><option density="1e-20" gravity="0 0 0"/><worldbody><body name="b"><freejoint/>
          <geom size="0.1" mass="1"/></body></worldbody></mujoco>"""
        self.refused(xml, "zero or constant in every trial trajectory: no water acts on it")

    def test_a_joint_without_a_name(self):
        self.refused(models.fish(fin=""), "a joint of body `fin` has no name, and hydro.wrench finds joints by name")

    def test_timesteps(self):
        for step in ("0", "-0.01"):
            xml = models.fish().replace('timestep="0.004"', f'timestep="{step}"')
            self.refused(xml, f"timestep is {step} s; expected a positive time")
        self.refused(
            models.fish(), r"0.01 s is no multiple .* 0.004 s; nearest: 0.008 s and 0.012 s", sample_period=0.01
        )

    def test_too_few_trajectories_for_the_splits(self):
        self.refused(models.fish(), r"split val of 6 trajectories is empty: .*record at least 8", trials=6)
        self.refused(models.fish(), "split val and test of 2 trajectories is empty", trials=2)
        _, tensors, _ = self.record(models.fish(), trials=2, splits=(0, 0, 1))
        self.assertEqual(len(tensors["x"]), 2)

    def test_numbers_that_are_none(self):
        nan = float("nan")
        for options, words in (
            ({"sample_period": nan}, "sample period is nan"),
            ({"noise": nan}, "noise is nan"),
            ({"noise": -1}, "noise is -1"),
            ({"effort": 0}, "effort is 0"),
            ({"density": (nan, 1000)}, "density is nan"),
            ({"density": (1030, 990)}, "density is 1030 to 990"),
            ({"frequency": (0, 1)}, "frequency is 0 to 1"),
            ({"samples": 1}, "samples is 1"),
            ({"seed": -1}, "seed is -1"),
            ({"trials": 0}, "trials is 0"),
            ({"workers": 0}, "workers is 0"),
            ({"splits": (0.5, 0.1, 0.1)}, "splits are .* sum to 1"),
        ):
            with self.subTest(words):
                self.refused(models.fish(), words, **options)
        xml = models.fish().replace('name="tail" axis="0 0 1"', 'name="tail" axis="0 0 1" armature="nan"')
        self.refused(xml, "dof_armature holds a number that is not finite")

    def test_density_and_buoyancy_need_something_to_change(self):
        self.refused(models.fish(density=0), "density is 0 in the model", density=(990, 1030))
        self.refused(models.fish(gravcomp=0), "neither gravcomp nor effects", buoyancy=True)


class CommandLine(Recorder):
    def run_it(self, *words):
        return subprocess.run(
            [sys.executable, "-m", "hydro_mujoco.record", *map(str, words)], capture_output=True, text=True
        )

    def test_ten_lines(self):
        path = self.write(models.fish())
        run = self.run_it(
            "--model", path, "--out", self.folder / "mine", "--trials", 8, "--samples", 20, "--workers", 1
        )
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertIn("train 6, val 1, test 1 trajectories of 20 samples, 0.008 s apart", run.stdout)
        self.assertIn("body hull, water fluid, 16 features", run.stdout)
        self.assertIn("record: note: contacts are off", run.stderr)
        self.assertNotIn("Warning", run.stderr)

    def test_refusals(self):
        run = self.run_it("--model", self.folder / "none.xml", "--out", self.folder / "mine")
        self.assertEqual((run.returncode, run.stdout), (1, ""))
        self.assertEqual(run.stderr.strip(), f"record: model {self.folder / 'none.xml'}: no such file")
        run = self.run_it("--model", "x.xml", "--out", "y", "--trials", "0")
        self.assertEqual(run.returncode, 2)


class Package(Recorder):
    def test_the_function_has_the_name_of_its_module(self):
        manifest = hydro_mujoco.record(self.write(models.fish()), self.folder / "data", **SMALL)
        self.assertEqual(manifest["body"], "hull")
        self.assertEqual(hydro_mujoco.__version__, "0.2.0")

    def test_mujoco_is_imported_where_it_is_needed(self):
        code = "import sys, hydro_mujoco.recording.folder; sys.exit('mujoco' in sys.modules)"
        self.assertEqual(subprocess.run([sys.executable, "-c", code], check=False).returncode, 0)


if __name__ == "__main__":
    unittest.main()
