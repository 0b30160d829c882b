"""`hydro_mujoco.sensors.UnderwaterCamera` against the law of its light."""

import os
import re
import subprocess
import sys

import mujoco
import numpy as np
import pytest

import hydro_mujoco as hydro
from hydro_mujoco import DataError, plugin
from hydro_mujoco.sensors import UnderwaterCamera, WaterLight

pytestmark = pytest.mark.skipif(not plugin.built_library().is_file(), reason="no plugin library: cargo build --release")

#: A wall that shines white, 4 m ahead of a camera; nothing beside it.
WALL = """<mujoco><visual><global offwidth="200" offheight="160"/><headlight ambient="0 0 0" diffuse="0 0 0"/></visual>
  <asset><material name="white" emission="1" rgba="1 1 1 1"/></asset><worldbody>
  <geom type="box" size="0.5 1.2 1.2" pos="4.5 0 -10" material="white"/>
  <body name="rov" pos="0 0 {z}"><freejoint/><geom type="box" size="0.2 0.2 0.1" pos="-1 0 0" mass="5"/>
    <camera name="eye" xyaxes="0 -1 0 0 0 1" fovy="60"/><camera name="flat" projection="orthographic"/></body>
</worldbody></mujoco>"""
DRAG = dict.fromkeys(("surge", "sway", "heave", "roll", "pitch", "yaw"), 1.0)


def scene(z=-10.0):
    spec = mujoco.MjSpec.from_string(WALL.format(z=z))
    model = hydro.add_water(spec, body="rov", effects={"linear_drag": DRAG}, waterline=0).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


LOOK = """
import sys; sys.path.insert(0, {tests!r})
import numpy as np
from test_camera import scene
from hydro_mujoco.sensors import UnderwaterCamera, WaterLight
c, k, b = np.array([0.3, 0.1, 0.05]), np.array([0.04, 0.02, 0.01]), np.array([0.1, 0.5, 0.8])
given = dict(width=150, height=120, light=WaterLight(c, k, b))
model, data = scene()
with UnderwaterCamera(model, "eye", **given) as camera:
    found = camera.read(data) / 255
clear = np.exp(-c * 4)
rows = {{"middle": (found[60, 75], np.exp(-k * 10) * (clear + b * (1 - clear)))}}
# The wall 1 m to the left and 1 m above, sqrt(18) m away, 9 m deep: 60 degrees over 120 pixels.
column, row = (round(at - 60 / np.tan(np.radians(30)) / 4) for at in (75, 60))
clear = np.exp(-c * np.sqrt(18))
rows["corner"] = found[row, column], np.exp(-k * 9) * clear + b * np.exp(-k * 10) * (1 - clear)
rows["beside"] = found[2, 2], b * np.exp(-k * 10)
for name, (picture, law) in rows.items():
    assert abs(picture - law).max() < 0.006, (name, picture, law)
# Where nothing is there the way has no end, however clear the water.
with UnderwaterCamera(model, "eye", width=150, height=120, light=WaterLight([1e-3] * 3, k, b)) as camera:
    assert abs(camera.read(data)[2, 2] / 255 - b * np.exp(-k * 10)).max() < 0.006
model, data = scene(z=1.0)
with UnderwaterCamera(model, "eye", **given) as camera:
    assert camera.read(data)[5, 5].max() == 0  # the air has no colour
print("as the law has it")
"""


def test_a_white_wall_has_the_colour_of_the_law():
    code = LOOK.format(tests=os.path.dirname(__file__))
    run = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env={**os.environ, "MUJOCO_GL": "egl"}
    )
    if run.returncode and "EGL" in run.stderr:
        pytest.skip("no EGL")
    assert run.stdout.strip() == "as the law has it", run.stderr


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"camera": "eyes"}, "no camera is called `eyes`; there are: `eye`, `flat`"),
        ({"camera": "flat"}, "camera `flat` is orthographic or has a sensor size; expected one by `fovy` alone"),
        ({"width": 400}, "the picture is 400 x 100; the model's offscreen buffer is 200 x 160"),
        ({"width": 0}, "width is 0; expected a whole number, at least 1"),
    ],
)
def test_refusals_of_a_camera(given, text):
    model, _ = scene()
    arguments = {"camera": "eye", "width": 100, "height": 100} | given
    with pytest.raises(DataError, match=re.escape(text)):
        UnderwaterCamera(model, **arguments)


def test_nothing_between_leaves_what_is_seen():
    light = WaterLight(attenuation=(0.5, 0.2, 0), daylight=(0.1, 0, 0), colour=(1, 0.5, 0.2))
    seen, far = np.array([[0.2, 0.5, 0.9]]), np.array([np.inf])
    np.testing.assert_allclose(light.through(seen, np.zeros(1), np.zeros(1), 0.0), seen)
    # Blue is not attenuated at all.
    np.testing.assert_allclose(light.through(seen, far, np.zeros(1), 2.0), [[np.exp(-0.2), 0.5, 0.9]])


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"attenuation": (1, 2)}, "attenuation is (1, 2); expected 3 numbers"),
        ({"attenuation": (1, 2, -1)}, "attenuation is 1, 2, -1; expected three numbers, 0 or more"),
        ({"colour": (1, 2, 1)}, "colour is 1, 2, 1; expected three numbers, 0 to 1"),
        ({"daylight": (0, 0, float("nan"))}, "daylight is 0, 0, nan; expected three numbers, 0 or more"),
    ],
)
def test_refusals_of_light(given, text):
    with pytest.raises(DataError, match=re.escape(text)):
        WaterLight(**given)
