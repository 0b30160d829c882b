"""`submerged`: how much of a body is under water."""

import ctypes
import subprocess
import sys
import tempfile
from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import hydro_mujoco
from hydro_mujoco import DataError, plugin, submersion

pytestmark = pytest.mark.skipif(not plugin.built_library().is_file(), reason="no plugin library: cargo build --release")

SPHERE = """<mujoco><option timestep="0.005"/><worldbody>
  <body name="ball" pos="0 0 {z}" quat="{quat}"><freejoint/><geom name="ball" size="0.5" mass="200"/>
    <body name="keel" pos="0 0 -0.62"><geom name="keel" type="box" size="0.1 0.1 0.1" mass="8"/></body>
    <body name="mast" pos="0 0 0.5"><joint name="mast"/><geom size="0.05" mass="1"/></body></body>
  <body name="dry"><freejoint/><geom size="0.1" mass="1"/></body>
</worldbody></mujoco>"""
DRAG = dict.fromkeys(("surge", "sway", "heave", "roll", "pitch", "yaw"), 10.0)


def at_rest(z=0.0, quat="1 0 0 0", **water):
    spec = mujoco.MjSpec.from_string(SPHERE.format(z=z, quat=quat))
    given = {"body": "ball", "effects": {"hydrostatics": {}}, "waterline": 0.0, "hull": ["ball"]} | water
    model = hydro_mujoco.add_water(spec, **given).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


@given(z=st.floats(-0.9, 0.9), tilt=st.floats(-3, 3))
def test_a_sphere_has_its_cap_under_water_at_every_attitude(z, tilt):
    model, data = at_rest(z=z, quat=f"{np.cos(tilt / 2)} {np.sin(tilt / 2)} 0 0")
    part = hydro_mujoco.submerged(model, data, "ball")
    depth = np.clip(0.5 - z, 0.0, 1.0)
    expected = np.pi * depth**2 * (1.5 - depth) / 3
    assert part.volume == pytest.approx(expected, abs=1e-9)
    assert part.share == pytest.approx(expected / (np.pi / 6), abs=1e-9)
    if expected > 1e-4:
        world = data.body("ball").xmat.reshape(3, 3) @ part.centre
        # Centroid of a spherical cap from the sphere's centre.
        below = 3 * (1 - depth) ** 2 / (4 * (1.5 - depth))
        np.testing.assert_allclose(world, [0, 0, -below], atol=1e-8)


def test_it_is_what_floats_the_body():
    model, data = at_rest(z=0.2)
    part = hydro_mujoco.submerged(model, data, "ball")
    force = hydro_mujoco.wrench(model, data, "ball")
    np.testing.assert_allclose(force[2], 1000 * 9.81 * part.volume, rtol=1e-12)
    np.testing.assert_allclose(force[3:], np.cross(part.centre, force[:3]), atol=1e-9)


def test_volume_and_centre_of_the_attributes():
    model, data = at_rest(z=0.0, volume=0.3, centre_of_buoyancy=(0.01, 0.02, -0.03))
    part = hydro_mujoco.submerged(model, data, "ball")
    assert (part.volume, part.share) == (pytest.approx(0.15), pytest.approx(0.5))
    np.testing.assert_allclose(part.centre, [0.01, 0.02, -0.03])
    model, data = at_rest(z=0.0, effects={"hydrostatics": {"volume": 0.4}})
    assert hydro_mujoco.submerged(model, data, "ball").volume == pytest.approx(0.2)


def test_what_is_welded_counts_and_what_moves_does_not():
    model, data = at_rest(z=-5.0, hull=None)
    part = hydro_mujoco.submerged(model, data, "ball")
    assert part.volume == pytest.approx(np.pi / 6 + 0.008)
    assert part.centre[2] < 0


def test_waves_lift_the_surface():
    waves = [{"height": 0.2, "period": 4.0, "phase": 0.0}]
    model, data = at_rest(z=0.0, waves=waves)
    before = hydro_mujoco.submerged(model, data, "ball").share
    data.time = 2.0
    after = hydro_mujoco.submerged(model, data, "ball").share
    assert abs(before - after) > 0.1 and 0 < min(before, after) < max(before, after) < 1


def test_effects_without_buoyancy_and_a_checkpoint_have_a_hull_too():
    model, data = at_rest(z=0.0, effects={"quadratic_drag": DRAG})
    assert hydro_mujoco.submerged(model, data, "ball").share == pytest.approx(0.5)
    model, data = at_rest(z=3.0, effects={"quadratic_drag": DRAG}, waterline=None)
    assert hydro_mujoco.submerged(model, data, "ball").share == 1
    spec = mujoco.MjSpec.from_file(hydro_mujoco.scene("b1_truth"))
    spec.option.density = spec.option.viscosity = 0
    checkpoint = hydro_mujoco.checkpoint("b1-relaxation")
    model = hydro_mujoco.add_water(spec, body="trunk", checkpoint=checkpoint, waterline=-100).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    part = hydro_mujoco.submerged(model, data, "trunk")
    assert (part.volume, part.share) == (0, 0)


def test_it_changes_nothing():
    model, data = at_rest(z=0.1)
    other = mujoco.MjData(model)
    for _ in range(20):
        mujoco.mj_step(model, data)
        hydro_mujoco.submerged(model, data, "ball")
        mujoco.mj_step(model, other)
    np.testing.assert_array_equal(data.qpos, other.qpos)


def test_refusals():
    model, data = at_rest()
    with pytest.raises(DataError, match="no body is called `hull`; there are: `ball`, `keel`, `mast`, `dry`"):
        hydro_mujoco.submerged(model, data, "hull")
    with pytest.raises(
        DataError, match="body `dry` carries no hydro.wrench, and no effect of one acts on it: .*add_water"
    ):
        hydro_mujoco.submerged(model, data, "dry")


def test_a_number_or_a_pointer_that_is_wrong_is_refused_by_the_library():
    model, data = at_rest()
    function, reason = submersion._acting_function(), ctypes.create_string_buffer(64)
    at = [ctypes.c_void_p(model._address), ctypes.c_void_p(data._address)]
    assert function(*at, 99, None, reason, 64) == submersion.REFUSED
    assert reason.value == b"body 99 is not of the model, which has 5"
    assert function(*at, -1, None, reason, 9) == submersion.REFUSED
    assert reason.value == b"body -1 "
    assert function(None, at[1], 1, None, reason, 64) == submersion.REFUSED
    assert reason.value == b"model or data is null"


def test_of_two_copies_the_one_that_acts_answers():
    library = plugin.built_library()
    with tempfile.TemporaryDirectory() as folder:
        # The idle one sorts first.
        other, acting = Path(folder, "a", library.name), Path(folder, "b", library.name)
        for copy in (other, acting):
            copy.parent.mkdir()
            copy.write_bytes(library.read_bytes())
        code = f"""
import ctypes, mujoco
mujoco.mj_loadPluginLibrary({str(acting)!r})
ctypes.CDLL({str(other)!r})
import hydro_mujoco as hydro
model = hydro.add_water(mujoco.MjSpec.from_string({SPHERE.format(z=0, quat="1 0 0 0")!r}), body="ball", effects={{"hydrostatics": {{}}}},
                        waterline=0, hull="ball").compile()
data = mujoco.MjData(model); mujoco.mj_forward(model, data)
print(ctypes.CDLL({str(other)!r}).hydro_submerged(None, None, -1, None, None, 0), hydro.submerged(model, data, "ball").share)
"""
        run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=folder)
    assert run.stdout.splitlines()[-1] == "2 0.5", run.stdout + run.stderr


@pytest.mark.skipif(Path(plugin.__file__).with_name(plugin.library_name()).is_file(), reason="a wheel loads it always")
def test_a_process_without_the_plugin_says_so():
    code = """
import mujoco, hydro_mujoco as hydro
model = mujoco.MjModel.from_xml_string('<mujoco><worldbody><body name="a"><geom size="1"/></body></worldbody></mujoco>')
try: hydro.submerged(model, mujoco.MjData(model), "a")
except hydro.DataError as error: print(error)
"""
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (
        run.stdout.strip() == "the plugin hydro.wrench does not act in this process: python -m hydro_mujoco says why"
    ), run
