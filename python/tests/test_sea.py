"""`hydro_mujoco.sea`: the same water as the plugin's, and its surface drawn."""

import json
import os
import subprocess
import sys

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hydro_mujoco as hydro
from hydro_mujoco import DataError, plugin, sea

pytestmark = pytest.mark.skipif(not plugin.built_library().is_file(), reason="no plugin library: cargo build --release")

#: A box of 1 dm, half under water where its middle is at the level. A ball of drag 1 N s/m, too small to feel pressure.
PROBES = """<mujoco><option timestep="0.01" density="{density}" wind="0.07 0 0"/><worldbody>
  <body name="spar" pos="{x} {y} 0"><freejoint/><geom name="spar" type="box" size="0.05 0.05 0.05" mass="0.5"/></body>
  <body name="ball" pos="{x} {y} {z}"><freejoint/><geom name="ball" size="0.00001" mass="1"/>
    <body name="below"><geom size="0.001" mass="0.01"/></body></body>
  <body name="dry"><freejoint/><geom size="0.1" mass="1"/></body>
</worldbody></mujoco>"""
UNIT = dict.fromkeys(("surge", "sway", "heave"), 1.0) | dict.fromkeys(("roll", "pitch", "yaw"), 0.0)
#: Shallow, deep, one wave, many.
SEAS = {
    "listed": {
        "components": [
            {"height": 0.4, "period": 5.0, "direction": 25, "phase": 40},
            {"amplitude": 0.1, "period": 2.3, "direction": -110},
        ]
    },
    "shallow": {"depth": 3.5, "components": [{"height": 0.3, "period": 4.0, "direction": 10}]},
    "jonswap": {
        "spectrum": "jonswap",
        "significant_height": 1.2,
        "peak_period": 6,
        "direction": 30,
        "spreading": 10,
        "components": 73,
        "seed": 12345678901234567890,
    },
    "long": {"spectrum": "pierson_moskowitz", "significant_height": 0.8, "peak_period": 7, "depth": 12},
    "broad": {
        "spectrum": "jonswap",
        "significant_height": 0.5,
        "peak_period": 4,
        "spreading": 0,
        "peak_enhancement": 1,
    },
    "coast": {"spectrum": "tma", "significant_height": 0.4, "peak_period": 6, "depth": 4, "spreading": 6},
    "young": {"spectrum": "eckv", "significant_height": 0.4, "peak_period": 3, "inverse_wave_age": 2.5},
    "default": {"spectrum": "jonswap", "significant_height": 0.5, "peak_period": 5},
}
CURRENTS = {
    "none": None,
    "constant": (0.3, -0.2, 0.1),
    "profile": {"profile": [{"depth": 0, "velocity": [0.5, 0, 0]}, {"depth": 10, "velocity": [0.1, 0.2, 0]}]},
    "grid": {
        "grid": {
            "x": [-20, 5, 50],
            "depth": [0, 4],
            "time": [0, 30],
            "velocity": [[0.1 * i, 0.05 * (i % 5), -0.02 * (i % 3)] for i in range(12)],
        }
    },
    "random": {"velocity": [0.2, 0, 0], "random": {"deviation": [0.3, 0.2, 0.1], "time_constant": 8, "seed": 5}},
}


def document(kind, content):
    return None if content is None else {"schema": f"hydro-{kind}/1", **content}


def probes(waves, current=None, x=0.0, y=0.0, z=-1.0, density=1025.0, more=(), fluid=0.0):
    """Model and data of the spar and the ball in one sea; `more`: effects on the ball."""
    spec = mujoco.MjSpec.from_string(PROBES.format(x=x, y=y, z=z, density=fluid))
    current = document("current", current) if isinstance(current, dict) else current
    about = {"waterline": 0.5, "waves": document("waves", waves), "density": density}
    hydro.add_water(spec, body="spar", effects={"hydrostatics": {}}, **about)
    effects = [{"effect": "linear_drag", "parameters": UNIT}, *more]
    hydro.add_water(spec, body="ball", effects=effects, current=current, **about)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def at(model, data, time):
    data.time = time
    mujoco.mj_forward(model, data)
    return data


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", SEAS)
def test_the_level_is_that_of_the_plugin_s_buoyancy(name):
    for x, y in ((0.0, 0.0), (13.7, -41.2), (-820.0, 333.0)):
        model, data = probes(SEAS[name], x=x, y=y)
        water = sea.water(model, "spar")
        for time in (0.0, 3.21, 987.6):
            data.qpos[2] = water.level(x, y, time)
            share = hydro.submerged(model, at(model, data, time), "spar").share
            assert 0.1 * (share - 0.5) == pytest.approx(0, abs=1e-10)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", SEAS)
@pytest.mark.parametrize("depth", [0.9, 3.2])
def test_the_velocity_is_that_of_the_plugin_s_drag(name, depth):
    model, data = probes(SEAS[name], CURRENTS["profile"], x=7.0, y=-3.0, z=0.5 - depth)
    water = sea.water(model, "below")
    for time in (0.0, 4.4, 321.0):
        felt = hydro.wrench(model, at(model, data, time), "ball")[:3]
        np.testing.assert_allclose(water.velocity((7.0, -3.0, 0.5 - depth), data), felt, atol=1e-9)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", CURRENTS)
def test_currents_are_those_of_the_plugin_s_drag(name):
    for x, z in ((-30.0, -9.0), (4.0, -1.5), (20.0, 0.0)):
        model, data = probes(SEAS["listed"], CURRENTS[name], x=x, z=z)
        water = sea.water(model, "ball")
        for time in (0.0, 17.0, 99.0):
            felt = hydro.wrench(model, at(model, data, time), "ball")[:3]
            np.testing.assert_allclose(water.velocity((x, 0.0, z), data), felt, atol=1e-9)


@pytest.mark.filterwarnings("ignore")
def test_gusts_go_on_as_the_plugin_s_memory_does():
    model, data = probes(SEAS["listed"], CURRENTS["random"])
    water, gusts = sea.water(model, "ball"), []
    for _ in range(50):
        mujoco.mj_step(model, data, 20)
        mujoco.mj_forward(model, data)
        data.qvel[:] = 0
        mujoco.mj_forward(model, data)
        place = data.body("ball").xpos
        felt = data.body("ball").xmat.reshape(3, 3) @ hydro.wrench(model, data, "ball")[:3]
        np.testing.assert_allclose(water.velocity(place, data), felt, atol=1e-9)
        gusts.append(water.current.remembered(data.plugin_state[water.memory]))
    assert np.std(gusts, axis=0).min() > 0.03


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", ["profile", "random"])
def test_what_a_program_sets_moves_the_water_as_the_plugin_s_drag_feels_it(name):
    model, data = probes(SEAS["listed"], {**CURRENTS[name], "settable": True})
    water = sea.water(model, "ball")
    before = water.velocity((0, 0, -1.0), data)
    for wanted in ((0.4, -0.2, 0.1), [0, 0, 0], np.array([-1.0, 2, 0])):
        water.set_current(data, wanted)
        np.testing.assert_allclose(water.velocity((0, 0, -1.0), data) - before, wanted, atol=1e-12)
        felt = hydro.wrench(model, at(model, data, 0.0), "ball")[:3]
        np.testing.assert_allclose(water.velocity((0, 0, -1.0), data), felt, atol=1e-9)
    mujoco.mj_resetData(model, data)
    np.testing.assert_array_equal(water.velocity((0, 0, -1.0), data), before)


DRIFTER = """<mujoco><option timestep="0.002" gravity="0 0 0"/><worldbody><body name="ball"><freejoint/>
  <geom type="sphere" size="0.1" mass="2"/></body></worldbody></mujoco>"""


def drifter():
    """A ball of 2 kg with a linear drag of 4 N s/m, in still water until a current is set."""
    drag = {"linear_drag": {"surge": 4, "sway": 4, "heave": 4, "roll": 0, "pitch": 0, "yaw": 0}}
    current = {"schema": "hydro-current/1", "velocity": [0, 0, 0], "settable": True}
    spec = hydro.add_water(mujoco.MjSpec.from_string(DRIFTER), body="ball", effects=drag, current=current)
    model = spec.compile()
    return model, mujoco.MjData(model)


def test_a_ball_drifts_with_a_current_from_when_it_is_set():
    model, data = drifter()
    water = sea.water(model, "ball")
    mujoco.mj_step(model, data, 500)
    np.testing.assert_array_equal(data.qvel, np.zeros(6))
    water.set_current(data, (0.5, 0, -0.25))
    mujoco.mj_step(model, data, 250)
    # v = U (1 - exp(-D t / m)).
    np.testing.assert_allclose(data.qvel[:3], np.array([0.5, 0, -0.25]) * (1 - np.exp(-1.0)), rtol=3e-3)
    # A copy goes on in the same water, and with another's own.
    other = mujoco.MjData(model)
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    state = np.empty(size)
    mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    mujoco.mj_setState(model, other, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    mujoco.mj_step(model, data, 250)
    mujoco.mj_step(model, other, 250)
    np.testing.assert_array_equal(other.qvel, data.qvel)
    water.set_current(other, (0, 0, 0))
    mujoco.mj_step(model, data, 2500)
    mujoco.mj_step(model, other, 2500)
    np.testing.assert_allclose(data.qvel[:3], (0.5, 0, -0.25), atol=1e-4)
    np.testing.assert_allclose(other.qvel[:3], np.zeros(3), atol=1e-4)


def test_a_current_that_cannot_be_set_says_so():
    model, data = drifter()
    water = sea.water(model, "ball")
    for wrong in ((1, 2), 3.0, (np.nan, 0, 0), (101, 0, 0), (-np.inf, 0, 0), "fast", [[1], [1, 2]], None):
        with pytest.raises(DataError, match="expected three numbers from -100 to 100 m/s"):
            water.set_current(data, wrong)
    np.testing.assert_array_equal(data.plugin_state, np.zeros(3))
    model, other = probes(SEAS["listed"], (0.1, 0, 0))
    with pytest.raises(DataError, match="current. is not settable"):
        sea.water(model, "ball").set_current(other, (0, 0, 0))
    with pytest.raises(DataError, match="the data have 0 numbers of plugin state, the model 3"):
        water.set_current(other, (0, 0, 0))


def test_a_current_is_set_where_it_acts_though_effects_need_less_memory_than_the_model_has():
    spec = mujoco.MjSpec.from_string(
        DRIFTER.replace("</worldbody>", "</worldbody><actuator><motor name='m' joint='j'/></actuator>").replace(
            "<freejoint/>", "<joint name='j' type='slide' axis='1 0 0'/>"
        )
    )
    drag = {"linear_drag": {"surge": 4, "sway": 4, "heave": 4, "roll": 0, "pitch": 0, "yaw": 0}}
    effects = [{"effect": "actuator_delay", "target": "m", "parameters": {"delay": 0.5}}]
    effects += [{"effect": effect, "parameters": parameters} for effect, parameters in drag.items()]
    current = {"schema": "hydro-current/1", "velocity": [0, 0, 0], "settable": True}
    model = hydro.add_water(spec, body="ball", effects=effects, current=current).compile()
    model.opt.timestep *= 2
    data = mujoco.MjData(model)
    sea.water(model, "ball").set_current(data, (0.5, 0, 0))
    mujoco.mj_step(model, data, 2000)
    np.testing.assert_allclose(data.qvel, [0.5], atol=1e-3)


def test_what_is_no_velocity_counts_as_none():
    model, data = drifter()
    data.plugin_state[:] = (np.nan, 0, 0)
    mujoco.mj_step(model, data, 10)
    np.testing.assert_array_equal(data.qvel, np.zeros(6))
    assert data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number == 0


@pytest.mark.filterwarnings("ignore")
def test_effects_and_wind_move_the_water_too():
    swell = {"x": 0.3, "y": -0.1, "z": 0.2, "frequency": 2.5, "phase": 0.4, "vertical_lag": 1.57}
    more = [
        {"effect": "current", "parameters": {"x": 0.1, "y": -0.2, "z": 0.3}},
        {"effect": "waves", "parameters": swell},
    ]
    # MuJoCo's own fluid is thin enough not to act itself.
    model, data = probes(SEAS["listed"], (0.1, 0, 0), more=more, fluid=1e-12)
    for body in ("ball", "spar"):
        water = sea.water(model, body)
        assert water.density == 1025
    for time in (0.0, 1.7):
        felt = hydro.wrench(model, at(model, data, time), "ball")[:3]
        found = sea.water(model, "ball").velocity((0, 0, -1.0), data)
        np.testing.assert_allclose(found, felt, atol=1e-9)
    assert abs(found).max() > 0.2


@pytest.mark.filterwarnings("ignore")
def test_the_pressure_s_gradient_accelerates_the_water_and_is_zero_at_the_surface():
    model, data = probes(SEAS["jonswap"])
    water = sea.water(model, "spar")
    place, time, h = np.array([3.0, 2.0, -2.0]), 5.0, 1e-4
    rate = (water.waves.velocity(place, time + h) - water.waves.velocity(place, time - h)) / (2 * h)
    around = place + h * np.concatenate([np.eye(3), -np.eye(3)])
    pressure = water.waves.pressure(around, time)
    np.testing.assert_allclose(-(pressure[:3] - pressure[3:]) / (2 * h), rate, atol=1e-6)
    deep = np.array([0.0, 0.0, -200.0])
    assert water.pressure(deep, time) == pytest.approx(1025 * 9.81 * 200.5, rel=1e-6)
    for x in range(0, 200, 7):
        level = float(water.level(x, 0.0, time))
        if level > 0.5:  # a crest, exactly; a trough, to the second order
            assert water.pressure((x, 0, level), time) == pytest.approx(0, abs=1e-6)
        assert water.pressure((x, 0, level + 0.1), time) == 0


@given(st.integers(1, 12), st.integers(1, 9), st.floats(-1e3, 1e3), st.floats(0, 1e4))
@settings(max_examples=25, deadline=None)
def test_a_grid_is_the_sum_at_its_points(nx, ny, far, time):
    waves = sea.Waves.read(SEAS["jonswap"], 9.81)
    x, y = np.cumsum(np.linspace(0.3, 4, nx + 1)), far + np.arange(ny + 1.0)
    grid = sea.Grid(waves, x, y)
    np.testing.assert_allclose(grid.elevation(time), waves.elevation(x[:, None], y, time), atol=1e-9)
    moved = grid.elevation(time, offset=(5.5, -2.0))
    np.testing.assert_allclose(moved, waves.elevation(x[:, None] + 5.5, y - 2.0, time), atol=1e-9)


def test_what_a_grid_cannot_show_fades():
    waves = sea.Waves.read({"components": [{"height": 1.0, "period": 2.0}]}, 9.81)  # 6.2 m long
    for cell, share in ((0.5, 1.0), (2.08, 0.5), (3.2, 0.0)):
        x = cell * np.arange(400)
        height = sea.Grid(waves, x, np.arange(3.0), fade=True).elevation(0.3).std() / (0.5 / np.sqrt(2))
        assert height == pytest.approx(share, abs=0.02)


def test_many_points_and_none():
    waves = sea.Waves.read({**SEAS["jonswap"], "components": 1000}, 9.81)
    x = np.linspace(-50, 50, 3001)
    whole = waves.elevation(x, 1.0, 2.0)
    np.testing.assert_allclose(whole[::500], [float(waves.elevation(each, 1.0, 2.0)) for each in x[::500]], atol=1e-12)
    assert waves.elevation(np.zeros((0, 4)), 0.0, 0.0).shape == (0, 4)
    assert waves.velocity(np.zeros((2, 5, 3)), 0.0).shape == (2, 5, 3)
    assert waves.significant_height == pytest.approx(1.2)


@pytest.mark.filterwarnings("ignore")
def test_documents_may_be_files(tmp_path, monkeypatch):
    (tmp_path / "sea.json").write_text(json.dumps(document("waves", SEAS["shallow"])))
    monkeypatch.setenv("HYDRO_PATH", str(tmp_path))
    spec = mujoco.MjSpec.from_string(PROBES.format(x=0, y=0, z=-1, density=0))
    hydro.add_water(spec, body="spar", effects={"hydrostatics": {}}, waterline=0, waves="sea.json")
    model = spec.compile()
    assert sea.water(model, "spar").waves.depth == 3.5
    (tmp_path / "sea.json").write_text("{")
    with pytest.raises(DataError, match="attribute `waves`, .*sea.json: is no JSON"):
        sea.water(model, "spar")
    (tmp_path / "sea.json").unlink()
    with pytest.raises(DataError, match="attribute `waves`: sea.json is no file any more"):
        sea.water(model, "spar")


def test_water_without_a_surface_and_bodies_without_water():
    spec = mujoco.MjSpec.from_string(PROBES.format(x=0, y=0, z=-1, density=0))
    hydro.add_water(spec, body="ball", effects={"linear_drag": UNIT})
    sea.add_surface(spec, cells=8, cell=1.0)
    model = spec.compile()
    water = sea.water(model, "ball")
    assert sea.water(model, "dry").density == 1000  # of the only instance
    assert np.isinf(water.level(np.zeros(4), 0.0, 1.0)).all() and water.density == 1000
    assert water.pressure((0, 0, -10.0), 0.0) == pytest.approx(98100)
    with pytest.raises(DataError, match="the water about body `ball` has no surface: its instance needs a `waterline`"):
        sea.Surface(model, "ball")
    model, _ = probes(SEAS["listed"])
    with pytest.raises(
        DataError, match="body `dry` and those above it carry no hydro.wrench; these do: `spar`, `ball`"
    ):
        sea.water(model, "dry")
    with pytest.raises(DataError, match="no body is called `hull`; there are: `spar`, `ball`"):
        sea.water(model, "hull")


@pytest.mark.filterwarnings("ignore")
def test_the_drawn_surface_is_the_level_and_follows_the_body():
    spec = mujoco.MjSpec.from_string(PROBES.format(x=100.3, y=-50.2, z=-1, density=0))
    hydro.add_water(
        spec, body="spar", effects={"hydrostatics": {}}, waterline=0.5, waves=document("waves", SEAS["jonswap"])
    )
    sea.add_surface(spec, cells=64, cell=0.25, size=200)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    surface = sea.Surface(model, "spar")
    data.time = 7.7
    surface.update(data)
    vertices = model.skin_vert.reshape(65, 65, 3)
    np.testing.assert_allclose(vertices[32, 32, :2], [100.25, -50.25], atol=0.01)
    assert vertices[0, 0, 0] == pytest.approx(0.25, abs=0.1) and vertices[-1, 0, 0] == pytest.approx(200.25, abs=0.1)
    middle = vertices[24:41, 24:41].astype(float)
    level = surface.water.level(middle[..., 0], middle[..., 1], 7.7)
    assert np.ptp(level) > 0.1
    # The shortest waves are 1.5 cells of the coarser ones.
    np.testing.assert_allclose(middle[..., 2], level, atol=0.01)
    # No ray meets it, nothing collides with it.
    assert mujoco.mj_ray(model, data, [110.0, -50, 50], [0.0, 0, -1], None, 1, -1, None) == -1
    surface.update(data, centre=(0.0, 0.0))
    assert model.skin_vert.reshape(65, 65, 3)[32, 32, 0] == 0


def test_refusals_of_the_surface():
    def spec():
        return mujoco.MjSpec.from_string(PROBES.format(x=0, y=0, z=-1, density=0))

    with pytest.raises(DataError, match="cells is 4; expected 8 to 1024"):
        sea.add_surface(spec(), cells=4)
    for cell in (0.0, 3.0, float("nan")):
        with pytest.raises(DataError, match="expected 0 < cell <= size / cells, 2 m"):
            sea.add_surface(spec(), cells=50, size=100, cell=cell)
    with pytest.raises(DataError, match="the spec has a skin `hydro_sea` already"):
        sea.add_surface(sea.add_surface(spec()))
    model = hydro.add_water(spec(), body="ball", effects={"linear_drag": UNIT}, waterline=0).compile()
    with pytest.raises(DataError, match="the model has no skin `hydro_sea`: .*add_surface"):
        sea.Surface(model, "ball")


RENDER = """
import mujoco, numpy as np, hydro_mujoco as hydro
spec = mujoco.MjSpec.from_string('''<mujoco><visual><headlight ambient="1 1 1"/></visual><worldbody><body name="mark">
  <freejoint/><geom type="box" size="0.5 0.5 0.5" rgba="1 0 0 1" mass="500"/></body></worldbody></mujoco>''')
spec = hydro.add_water(spec, body="mark", effects={"hydrostatics": {}}, waterline=0, waves=[{"height": 1.0, "period": 8}])
model = hydro.sea.add_surface(spec, cells=64, rgba=(0, 0, 1, 1), sun=None).compile()
data = mujoco.MjData(model)
surface = hydro.sea.Surface(model, "mark")
camera = mujoco.MjvCamera(); camera.distance, camera.elevation, camera.azimuth = 6, -20, 90
reds = []
with mujoco.Renderer(model, 120, 160) as renderer:
    for time in (0.0, 4.0):
        data.time, data.qpos[2] = time, -0.1
        mujoco.mj_forward(model, data); surface.update(data); renderer.update_scene(data, camera)
        pixels = renderer.render().astype(int)
        reds.append(int(((pixels[..., 0] > 100) & (pixels[..., 2] < 80)).sum()))
print(*reds)
"""


def test_a_crest_hides_the_body_and_a_trough_shows_it():
    run = subprocess.run(
        [sys.executable, "-c", RENDER], capture_output=True, text=True, env={**os.environ, "MUJOCO_GL": "egl"}
    )
    if run.returncode and "EGL" in run.stderr:
        pytest.skip("no EGL")
    crest, trough = map(int, run.stdout.split())
    assert crest < 20 and trough > 400, run.stderr
