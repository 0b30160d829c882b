"""Refused scenes and their messages."""

import json
import os
import pathlib
import shutil
import tempfile
import unittest

import mujoco
import numpy as np
from scene import CHECKPOINTS, KINDS, Warnings, fish, fish_xml, start, steps


class Refusals(unittest.TestCase):
    def refused(self, *words, xml=None, **parts):
        with self.assertRaises(ValueError) as refusal:
            mujoco.MjModel.from_xml_string(xml or fish_xml(**parts))
        for word in words:
            self.assertIn(word, str(refusal.exception))

    def damaged(self, change):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        copied = pathlib.Path(folder.name) / "model"
        shutil.copytree(CHECKPOINTS / "lively", copied)
        change(copied)
        return {"checkpoint": str(copied)}

    def test_attributes(self):
        self.refused("`checkpoint` and `effects` are missing", attributes={"checkpoint": None})
        self.refused(
            "`checkpoint` is `models/none`", os.getcwd(), "HYDRO_PATH", attributes={"checkpoint": "models/none"}
        )
        self.refused("`density` is `-3`", "kg/m^3", attributes={"density": "-3"})
        self.refused("`density` is `wet`", attributes={"density": "wet"})
        self.refused("`current` is `1 2`", "m/s", attributes={"current": "1 2"})
        self.refused("`waterline` is `high`", attributes={"waterline": "high"})
        self.refused("`solver` is `heun`", "`rk4`", attributes={"solver": "heun"})
        self.refused("`engine` is `gpu`", "`candle`", attributes={"engine": "gpu"})
        self.refused("`initial_force` is `some`", attributes={"initial_force": "some"})
        self.refused("has 2 numbers", "has 6 outputs", attributes={"initial_force": "1 2"})
        self.refused("lists 2 names", "fin", attributes={"joints": "fin tail"})
        self.refused("densty", attributes={"densty": "1000"})
        self.refused("timestep of <option> is 1e-300 s", "expected from 1e-9", timestep="1e-300")
        self.refused("`effects` is `a b`", attributes={"checkpoint": None, "effects": "a&#10;b"})

    def test_a_delay_that_would_take_the_memory(self):
        """A delay's commands are kept, one a step: as many as half a second has steps at least, or as the delay has."""

        def delayed(delay):
            entry = {"effect": "actuator_delay", "target": "fin", "parameters": {"delay": delay}}
            effects = json.dumps({"schema": "hydro-effects/1", "effects": [entry]}).replace('"', "&quot;")
            return {"checkpoint": None, "effects": effects}

        self.refused("delay is 1000000 [s], expected 0 to 60", attributes=delayed(1e6))
        for delay, taken in ((0.0, "500000003"), (0.5, "500000003"), (60.0, "60000000003")):
            self.refused(
                f"memory takes {taken} numbers",
                "timestep of 1e-9 s",
                "at most 16777216",
                timestep="1e-9",
                attributes=delayed(delay),
            )
        # What fits is taken: 600,000 commands.
        fish(delayed(60.0), timestep="0.0001")

    def test_joints(self):
        self.refused("card's joint `fin`", "joints are: tail", fin="tail")
        mujoco.MjModel.from_xml_string(fish_xml({"joints": "tail"}, fin="tail"))
        self.refused("`root`", "Free joint", attributes={"joints": "root"}, joint='<freejoint name="root"/>')

    def test_bases(self):
        self.refused("free joint on body `hull`", "no joint lies between", joint="")
        self.refused("free joint on body `hull`", "joint `pivot` (Ball)", joint='<joint name="pivot" type="ball"/>')

    def test_bodies(self):
        self.refused(
            "bodies hull, other share it",
            bodies="""<body name="other"><freejoint/><geom size="0.1"/>
      <plugin plugin="hydro.wrench" instance="water"/></body>""",
        )
        carried = '<plugin plugin="hydro.wrench" instance="water"/>'
        self.refused("no body carries it", xml=fish_xml().replace(carried, ""))
        two = (
            fish_xml()
            .replace(
                "</plugin>\n  </extension>",
                f'<instance name="more"><config key="checkpoint" value="{CHECKPOINTS / "lively"}"/></instance></plugin>\n  </extension>',
            )
            .replace(carried, carried + '<plugin plugin="hydro.wrench" instance="more"/>')
        )
        self.refused("no body carries it", "takes the first one's place", xml=two)

    def test_checkpoints(self):
        def truncate(folder):
            weights = folder / "weights.safetensors"
            weights.write_bytes(weights.read_bytes()[:-100])

        def flip(folder):
            weights = folder / "weights.safetensors"
            content = bytearray(weights.read_bytes())
            content[-7] ^= 0x40
            weights.write_bytes(content)

        self.refused("is damaged", attributes=self.damaged(truncate))
        self.refused("is damaged", attributes=self.damaged(flip))
        self.refused(
            "weights.safetensors is missing", attributes=self.damaged(lambda f: (f / "weights.safetensors").unlink())
        )
        self.refused("card.json", attributes=self.damaged(lambda f: (f / "card.json").write_text("{")))

    def test_a_checkpoint_replaced_under_a_living_model(self):
        def memory(checkpoint):
            return fish({"checkpoint": str(checkpoint)}).npluginstate

        one, other = KINDS[0], next(kind for kind in KINDS if memory(kind) != memory(KINDS[0]))
        attributes = self.damaged(lambda folder: (shutil.rmtree(folder), shutil.copytree(one, folder)))
        folder = pathlib.Path(attributes["checkpoint"])
        model = fish(attributes)
        data, twin = start(model), start(fish({"checkpoint": str(one)}))
        shutil.rmtree(folder)
        shutil.copytree(other, folder)
        with Warnings() as texts:
            # Data made before go on with the old weights.
            np.testing.assert_array_equal(steps(model, data, 30), steps(fish({"checkpoint": str(one)}), twin, 30))
            self.assertEqual(texts, [])
        with self.assertRaises((ValueError, mujoco.FatalError)) as refusal, Warnings() as texts:
            mujoco.MjData(model)
        self.assertIn("compile the model again", str(refusal.exception) + " ".join(texts))
        # Compiled again it is sound.
        self.assertTrue(np.isfinite(steps(fish(attributes), start(fish(attributes)), 10)).all())

    def test_a_robot_of_another_size(self):
        self.refused("card's joint `thigh`", attributes={"checkpoint": str(CHECKPOINTS / "towing")})

    def test_a_refusal_leaves_the_process_well(self):
        for _ in range(50):
            with self.assertRaises(ValueError):
                fish({"density": "-1"})
        self.assertTrue(np.isfinite(steps(fish(), start(fish()), 10)).all())


if __name__ == "__main__":
    unittest.main(verbosity=2)
