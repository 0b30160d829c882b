"""Recording water that `hydro.wrench` makes, and loading a checkpoint in its place. Skipped without the library."""

import json
import unittest

import mujoco
import numpy as np

import hydro_mujoco
import models
from hydro_mujoco import DataError, plugin
from hydro_mujoco.record import record
from test_record import Recorder

LIBRARY = plugin.built_library()


def turn(quaternion):
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)


@unittest.skipUnless(LIBRARY.is_file(), f"{LIBRARY} is not built")
class Effects(Recorder):
    @classmethod
    def setUpClass(cls):
        plugin.load_plugin(LIBRARY)

    def at(self, model, manifest, x):
        """A forwarded state with the features `x`."""
        at = {name: i for i, name in enumerate(manifest["features"])}
        data = mujoco.MjData(model)
        data.joint("fin").qpos, data.joint("fin").qvel = x[at["position.fin"]], x[at["velocity.fin"]]
        data.qpos[3:7] = x[at["quaternion.w"] :][:4]
        data.qvel[:3] = turn(data.qpos[3:7]) @ x[at["linear_velocity.x"] :][:3]
        data.qvel[3:6] = x[at["angular_velocity.x"] :][:3]
        mujoco.mj_forward(model, data)
        return data

    def test_the_label_is_what_the_plugin_adds_to_the_passive_forces(self):
        """On two bodies; the added mass is in the motion and in no label."""
        effects = (models.DRAG, models.FIN_DRAG, models.BUOYANCY, models.ADDED_MASS)
        manifest, tensors, notes = self.record(models.vehicle(*effects))
        self.assertEqual(manifest["water"]["learned"], ["quadratic_drag on hull", "linear_drag on fin"])
        self.assertEqual(manifest["water"]["beside"], ["net_buoyancy on hull", "added_mass on hull"])
        self.assertTrue(any("kept beside the checkpoint: added_mass, net_buoyancy" in note for note in notes))
        model = mujoco.MjModel.from_xml_string(models.vehicle(models.DRAG, models.FIN_DRAG))
        for i, k in ((0, 0), (4, 21), (9, 39)):
            data = self.at(model, manifest, tensors["x"][i, k].astype(float))
            passive = data.qfrc_passive
            wanted = np.concatenate((turn(data.qpos[3:7]).T @ passive[:3], passive[3:6]))
            np.testing.assert_allclose(tensors["wrench"][i, k], wanted, rtol=1e-4, atol=1e-4)

    def test_the_added_mass_is_in_the_motion(self):
        _, with_it, _ = self.record(models.vehicle(models.DRAG, models.ADDED_MASS), "with")
        _, without, _ = self.record(models.vehicle(models.DRAG), "without")
        self.assertFalse(np.array_equal(with_it["x"], without["x"]))

    def test_buoyancy_is_in_the_label_where_it_is_asked_for(self):
        _, without, _ = self.record(models.vehicle(models.DRAG, models.BUOYANCY), "without")
        _, tensors, _ = self.record(models.vehicle(models.DRAG, models.BUOYANCY), "with", buoyancy=True)
        np.testing.assert_array_equal(tensors["x"], without["x"])
        np.testing.assert_allclose(tensors["wrench"] - tensors["hydrostatic"], without["wrench"], atol=1e-4)
        np.testing.assert_allclose(np.linalg.norm(tensors["hydrostatic"][..., :3], axis=-1), 250, rtol=1e-5)

    def test_both_waters_add_up(self):
        fluid = 'density="1000" viscosity="0.001" integrator="implicitfast"'
        manifest, tensors, _ = self.record(models.vehicle(models.DRAG, option=fluid), "both")
        self.assertEqual(manifest["water"]["kind"], "both")
        parts = [
            self.record(models.vehicle(models.DRAG, option=fluid), kind, water=kind)[1] for kind in ("fluid", "effects")
        ]
        for part in parts:
            np.testing.assert_array_equal(part["x"], tensors["x"])
        np.testing.assert_allclose(parts[0]["wrench"] + parts[1]["wrench"], tensors["wrench"], rtol=1e-4, atol=1e-3)
        self.refused(models.vehicle(models.DRAG, option=fluid), "leave density out", density=(990, 1030))

    def test_a_current_is_taken_out_of_the_recording(self):
        _, still, _ = self.record(models.vehicle(models.DRAG), "still")
        attribute = {"current": "0.3 0 0"}
        for name, xml in (
            ("attribute", models.vehicle(models.DRAG, attributes=attribute)),
            ("effect", models.vehicle(models.DRAG, models.CURRENT)),
        ):
            _, tensors, notes = self.record(xml, name)
            np.testing.assert_array_equal(tensors["wrench"], still["wrench"])
            self.assertTrue(any("water at rest" in note and "current" in note for note in notes))

    def test_only_what_stays_beside_a_checkpoint_is_no_water(self):
        self.refused(
            models.vehicle(models.ADDED_MASS), "the model has no water.*Of its effects none is learned.*added_mass"
        )

    def test_a_plugins_refusal_is_one_line(self):
        self.refused(models.vehicle(models.DRAG.replace("hull", "keel")), "model.xml: .*keel")

    def test_two_workers_load_the_library(self):
        path = self.write(models.vehicle(models.DRAG, models.FIN_DRAG))
        options = {"trials": 4, "samples": 4, "splits": (0.5, 0.25, 0.25), "shard_size": 1}
        record(path, self.folder / "two", **options, workers=2)
        self.assertEqual(len(list((self.folder / "two").glob("*.safetensors"))), 4)

    def test_effects_in_a_file_beside_the_model(self):
        (self.folder / "effects.json").write_text(f'{{"schema": "hydro-effects/1", "effects": [{models.DRAG}]}}')
        _, inline, _ = self.record(models.vehicle(models.DRAG), "inline")
        xml = models.vehicle("EFFECTS")
        start, end = xml.index("value='{"), xml.index("}'/>") + 2
        _, from_file, _ = self.record(xml[:start] + 'value="effects.json"' + xml[end:], "file")
        np.testing.assert_array_equal(inline["wrench"], from_file["wrench"])


@unittest.skipUnless(LIBRARY.is_file(), f"{LIBRARY} is not built")
class Checkpoint(Recorder):
    @classmethod
    def setUpClass(cls):
        plugin.load_plugin(LIBRARY)

    def folder_with_card(self, features=(), outputs=("force.x",)):
        folder = self.folder / "checkpoint"
        folder.mkdir()
        (folder / "card.json").write_text(json.dumps({"features": list(features), "outputs": list(outputs)}))
        return folder

    def config(self, xml, **options):
        """The spec, and the attributes of its instance."""
        spec = hydro_mujoco.with_checkpoint(self.write(xml), self.folder_with_card(**options))
        plugins = [one for one in spec.plugins if one.plugin_name == plugin.WRENCH]
        self.assertEqual(len(plugins), 1)
        return spec, {key: value for key, value in dict(plugins[0].config).items() if value}

    def test_outputs_are_chosen_by_name(self):
        joints = self.folder_with_card(outputs=("force.x", "joint_torque.fin"))
        path = self.write(models.vehicle(models.DRAG))
        for outputs in ("wrench", "generalised"):
            spec = hydro_mujoco.with_checkpoint(path, joints, outputs=outputs)
            (instance,) = (one for one in spec.plugins if one.plugin_name == plugin.WRENCH)
            self.assertEqual(instance.config["outputs"], outputs)
        with self.assertRaisesRegex(DataError, "expected 'wrench' or 'generalised'"):
            hydro_mujoco.with_checkpoint(path, joints, outputs="joints")

    def test_joints_are_not_asked_of_a_checkpoint_of_the_base(self):
        base = self.folder_with_card()
        with self.assertRaisesRegex(DataError, r"on the base alone \(force\.x\)") as refused:
            hydro_mujoco.with_checkpoint(self.write(models.vehicle(models.DRAG)), base, outputs="generalised")
        self.assertEqual(len(str(refused.exception).splitlines()), 1)

    def test_learned_effects_go_and_the_others_stay(self):
        effects = (models.DRAG, models.FIN_DRAG, models.BUOYANCY, models.ADDED_MASS, models.CURRENT)
        _, config = self.config(models.vehicle(*effects, attributes={"waterline": "2", "current": "0.1 0 0"}))
        left = [effect["effect"] for effect in json.loads(config["effects"])["effects"]]
        self.assertEqual(left, ["net_buoyancy", "added_mass", "current"])
        self.assertEqual((config["waterline"], config["current"]), ("2", "0.1 0 0"))
        self.assertTrue(config["checkpoint"].endswith("checkpoint"))

    def test_no_effect_is_left_where_all_are_learned(self):
        _, config = self.config(models.vehicle(models.DRAG))
        self.assertEqual(set(config), {"checkpoint"})

    def test_fluid_is_off_and_its_wind_a_current(self):
        spec, config = self.config(models.fish(wind="0.2 0 0"), features=["density"])
        self.assertEqual((spec.option.density, spec.option.viscosity, tuple(spec.option.wind)), (0, 0, (0, 0, 0)))
        self.assertEqual((config["density"], config["current"]), ("1000.0", "0.2 0.0 0.0"))
        self.assertEqual(spec.body("hull").plugin.plugin_name, plugin.WRENCH)

    def test_a_folder_that_is_no_checkpoint(self):
        with self.assertRaisesRegex(DataError, "card.json.*expected a folder that hydro train wrote"):
            hydro_mujoco.with_checkpoint(self.write(models.fish()), self.folder)

    def test_the_released_checkpoint_swims_in_the_truths_scene(self):
        truth, checkpoint = hydro_mujoco.scene("b1_truth"), hydro_mujoco.checkpoint("b1-relaxation")
        spec = hydro_mujoco.with_checkpoint(truth, checkpoint, buoyancy=True)
        model = spec.compile()
        data = mujoco.MjData(model)
        for _ in range(1000):
            mujoco.mj_step(model, data)
        self.assertTrue(np.isfinite(data.qpos).all())
        self.assertLess(np.linalg.norm(data.qvel[:3]), 1.0)


if __name__ == "__main__":
    unittest.main()
