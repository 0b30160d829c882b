"""`hydro gap` on one link that is driven by rough torques: inertia, a motor's gain, and a spring that rests anywhere."""

import json
import subprocess
import tempfile
import unittest
from pathlib import Path

import mujoco
import numpy as np

from test_gap import program

#: A link on a motor; with gravity it hangs, without it turns about the vertical.
LINK = """<mujoco><option timestep="0.005" integrator="RK4" gravity="0 0 {gravity}"/><worldbody>
  <body name="link"><joint name="hinge" axis="{axis}" armature="{armature}" stiffness="{stiffness}" springref="{rest}"/>
    <geom type="capsule" size="0.03" fromto="{ends}" mass="2"/></body>
</worldbody>
<actuator><motor name="motor" joint="hinge"/></actuator>
<sensor><jointpos name="angle" joint="hinge" noise="1e-4"/><jointvel name="rate" joint="hinge" noise="2e-3"/></sensor>
</mujoco>"""
HANGING = {"gravity": -9.81, "axis": "0 1 0", "ends": "0 0 0 0 0 -0.5"}
TURNING = {"gravity": 0, "axis": "0 0 1", "ends": "0 0 0 0.5 0 0"}
NOTHING = {"armature": 0.02, "stiffness": 0.0, "rest": 0.0}
SECONDS = 6.0
#: White part of the torque [N m].
ROUGHNESS = 0.3


def link(**given: object) -> str:
    """The MJCF of a link."""
    return LINK.format(**{**NOTHING, **given})


def trial(path: Path, truth: str, seed: int) -> None:
    """A run under a torque that holds the link, swings it, and is rough: a row a step, with the torque that acts from there."""
    model = mujoco.MjModel.from_xml_string(truth)
    data = mujoco.MjData(model)
    draw = np.random.default_rng(seed)
    swing = list(zip((0.5, 0.3), draw.uniform(2, 6, 2), draw.uniform(0, 6, 2)))
    lines = ["time,motor,angle,rate"]
    data.qpos[0] = 0.3
    for _ in range(round(SECONDS / model.opt.timestep)):
        mujoco.mj_forward(model, data)
        read = data.sensordata + draw.normal(size=2) * model.sensor_noise
        command = sum(a * np.sin(w * data.time + p) for a, w, p in swing) + ROUGHNESS * draw.normal()
        command -= 1.5 * (data.qpos[0] - 0.3) + 0.3 * data.qvel[0]
        lines.append(f"{data.time:.9g},{command:.9g},{read[0]:.9g},{read[1]:.9g}")
        data.ctrl[0] = command
        mujoco.mj_step(model, data)
    path.write_text("\n".join(lines) + "\n")


@unittest.skipUnless(program(), "no `hydro` is built: cargo build")
class Joints(unittest.TestCase):
    def verdict(self, nominal: str, truth: str) -> dict:
        """Of four trials."""
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder)
            (folder / "trials").mkdir()
            (folder / "nominal.xml").write_text(nominal)
            for seed in range(4):
                trial(folder / "trials" / f"{seed}.csv", truth, seed)
            command = [str(program()), "gap", "run", "--model", "nominal.xml", "--trials", "trials", "--out", "out"]
            ran = subprocess.run([*command, "--no-residual"], cwd=folder, capture_output=True, text=True)
            self.assertEqual(ran.returncode, 0, ran.stderr)
            return json.loads((folder / "out" / "verdict.json").read_text())

    def test_a_rotor_is_named_where_gravity_tells_it_from_a_gain(self):
        found = self.verdict(link(**HANGING), link(**HANGING, armature=0.08))
        self.assertEqual(
            (found["verdict"], found["named"], found["verified"]), ("named", ["joint_armature"], True), found
        )
        (value,) = found["effects"][0]["parameters"]
        self.assertLess(abs(value["value"] - 0.06), 0.01)
        low, high = value["ci95"]
        self.assertTrue(low < 0.06 < high, value)

    def test_without_gravity_it_may_be_the_gain(self):
        # A rotor of a third of the link's inertia. The torque is rough, and the log may be early or late by a part of a step.
        found = self.verdict(link(**TURNING), link(**TURNING, armature=0.08))
        self.assertEqual(found["verdict"], "confusable", found)
        self.assertLessEqual({"joint_armature", "actuator_gain"}, set(found["confusion_set"]))

    def test_a_spring_is_named_wherever_it_rests(self):
        found = self.verdict(link(**TURNING), link(**TURNING, stiffness=0.8, rest=18.0))
        self.assertEqual((found["verdict"], found["named"]), ("named", ["joint_stiffness"]), found)
        values = {value["name"]: value["value"] for value in found["effects"][0]["parameters"]}
        self.assertLess(abs(values["stiffness"] - 0.8), 0.08)
        self.assertLess(abs(values["reference"] - np.radians(18.0)), 0.03)


if __name__ == "__main__":
    unittest.main()
