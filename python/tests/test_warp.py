"""hydro_mujoco.warp against the plugin: wrenches on a rollout, closed loops, coefficients by world."""

import json
import re
from pathlib import Path

import mujoco
import numpy as np
import pytest

from hydro_mujoco.errors import DataError
from warp_scenes import CLOSE, Pair, ant, effect, mjw, scene, together, vehicle, water, with_sensor

SIX = ("surge", "sway", "heave", "roll", "pitch", "yaw")
#: Symmetric and positive definite, with couplings.
COUPLED = (np.diag([6, 12, 18, 0.2, 0.4, 0.5]) + 0.02 * np.ones((6, 6)) + np.diag([0, 0, 0, 0.1, 0.1, 0.1])).tolist()
#: A quadratic drag whose damping is indefinite in some motions.
INDEFINITE = (np.diag([5.0, 9, 9, 0.1, 0.2, 0.2]) + 4 * np.eye(6, k=1) + np.eye(6, k=-4)).tolist()

EFFECTS = {
    "added_mass": [effect("added_mass", **dict(zip(SIX, (6, 12, 18, 0.12, 0.35, 0.3))))],
    "added_mass on a link": [effect("added_mass", "fin", **dict(zip(SIX, (0.1, 2, 0.3, 0.01, 0.02, 0.04))))],
    "added_mass, a matrix": [effect("added_mass", matrix=COUPLED, point=[0.1, -0.05, 0.02])],
    "linear_drag": [effect("linear_drag", **dict(zip(SIX, (10, 20, 30, 1, 2, 3))))],
    "linear_drag, a matrix": [effect("linear_drag", matrix=COUPLED)],
    "quadratic_drag": [effect("quadratic_drag", **dict(zip(SIX, (18, 30, 40, 0.5, 0.7, 0.8))))],
    "quadratic_drag, a matrix": [effect("quadratic_drag", matrix=INDEFINITE, point=[0.05, 0, 0.1])],
    "cross_flow_drag": [effect("cross_flow_drag", sway=1.1, heave=0.9)],
    "cross_flow_drag on a link": [effect("cross_flow_drag", "fin", sway=1.1, heave=0.8)],
    "munk_moment": [effect("munk_moment", pitch=9, yaw=5)],
    "lift": [effect("lift", sway=1.2, heave=0.7)],
    "net_buoyancy": [effect("net_buoyancy", force=250, moment_x=3, moment_y=-2, moment_z=5)],
    "net_buoyancy on a link": [effect("net_buoyancy", "fin", force=12)],
    "buoyancy_offset": [effect("buoyancy_offset", x=0.01, y=0.02, z=0.05)],
    "hydrostatics": [effect("hydrostatics")],
    "hydrostatics, a volume": [effect("hydrostatics", volume=0.02), effect("hydrostatics", "fin")],
    "constant_force": [effect("constant_force", x=3, y=-4, z=5, torque_x=1, torque_y=0.5, torque_z=-2)],
    "current": [
        effect("current", x=0.3, y=-0.2, z=0.1),
        effect("linear_drag", **dict(zip(SIX, (10, 20, 30, 1, 2, 3)))),
    ],
}
WATER = [each for name in ("added_mass", "quadratic_drag", "lift", "hydrostatics") for each in EFFECTS[name]]
PROFILE = json.dumps(
    {
        "schema": "hydro-current/1",
        "profile": [{"depth": d, "velocity": [0.4 - d, 0.1 * d, 0.02]} for d in (0, 0.05, 0.3)],
    }
)
ATTRIBUTES = {
    "density": {"density": 1025},
    "current": {"current": "0.3 -0.1 0.05"},
    "current, a profile": {"current": PROFILE, "waterline": 0.1},
    "waterline": {"waterline": 0.02},
    "volume and centre": {"waterline": 0.02, "volume": 0.022, "centre_of_buoyancy": "0.01 0 0.03"},
    "volume, no surface": {"volume": 0.022, "centre_of_buoyancy": "0.01 0 0.03"},
}
HULLS = {
    "box": '<geom type="box" size="0.33 0.18 0.1" mass="25" euler="10 20 30" pos="0.05 0 0.02"/>',
    "sphere": '<geom type="sphere" size="0.2" mass="25" pos="0.05 0 0.02"/>',
    "cylinder": '<geom type="cylinder" size="0.15 0.25" mass="25" euler="10 20 30" pos="0.05 0 0.02"/>',
    "upright cylinder": '<geom type="cylinder" size="0.15 0.25" mass="25"/>',
    "capsule": '<geom type="capsule" size="0.12 0.25" mass="25" euler="10 80 30" pos="0.05 0 0.02"/>',
    "one of group 3 under its looks": '<geom type="ellipsoid" size="0.3 0.15 0.1" mass="25" group="3"/>'
    '<geom type="box" size="0.5 0.3 0.2" mass="0" contype="0" conaffinity="0"/>',
    "one of MuJoCo's fluid": '<geom type="ellipsoid" size="0.3 0.15 0.1" mass="25" fluidshape="ellipsoid"/>'
    '<geom type="box" size="0.5 0.3 0.2" mass="0" group="3" contype="0" conaffinity="0"/>',
    "two": '<geom type="ellipsoid" size="0.3 0.1 0.08" mass="13" pos="0 0.2 0"/>'
    '<geom type="box" size="0.3 0.1 0.08" mass="12" pos="0 -0.2 0"/>',
}


SEAS = {
    "two waves": {
        "components": [
            {"height": 0.4, "period": 4.5, "direction": 20, "phase": 30},
            {"amplitude": 0.1, "period": 3, "direction": -70},
        ]
    },
    "shallow": {"depth": 2.5, "components": [{"height": 0.3, "period": 4, "direction": 110}]},
    "pierson_moskowitz": {
        "spectrum": "pierson_moskowitz",
        "significant_height": 0.3,
        "peak_period": 6,
        "components": 30,
    },
    "jonswap, spreading": {
        "spectrum": "jonswap",
        "significant_height": 0.4,
        "peak_period": 6,
        "direction": 30,
        "spreading": 10,
        "peak_enhancement": 2.2,
        "seed": 7,
    },
}


def close(pair, seed=0, later=0.0):
    """The differences, held to single precision; the force of the water is not nothing."""
    states = pair.states(seed)
    found = pair.compare(states, later)
    assert max(found.values()) < CLOSE, found
    assert np.abs(pair.water.wrench.numpy()).max() > 1e-3


@pytest.mark.parametrize("name", EFFECTS)
def test_each_effect_is_the_plugins(name):
    close(Pair(vehicle(*EFFECTS[name]), nworld=16))


@pytest.mark.parametrize("name", ATTRIBUTES)
def test_each_attribute_is_the_plugins(name):
    close(Pair(vehicle(*WATER, **ATTRIBUTES[name]), nworld=16))


@pytest.mark.parametrize("name", HULLS)
def test_hulls_at_the_surface_are_the_plugins(name):
    pair = Pair(vehicle(*WATER, geoms=HULLS[name], waterline=0), nworld=24)
    # A rollout floats or sinks; heights all through the surface too.
    states = [
        (0.0, np.r_[0, 0, z, qpos[3:]], qvel) for z, (_, qpos, qvel) in zip(np.linspace(-0.5, 0.5, 24), pair.states())
    ]
    found = pair.compare(states)
    assert max(found.values()) < CLOSE, found


@pytest.mark.parametrize("name", ["rov", "fish"])
def test_scenes_are_the_plugins(name):
    close(Pair(scene(name), nworld=16))


@pytest.mark.parametrize("name", SEAS)
def test_waves_are_the_plugins(name):
    """A hull that floats by hydrostatics, and a fin that waves push without an effect."""
    sea = json.dumps({"schema": "hydro-waves/1"} | SEAS[name])
    close(Pair(vehicle(*WATER, waves=sea, waterline=0.05), nworld=16), later=41.7)


@pytest.mark.filterwarnings("ignore:.*two buoyancies")
def test_all_effects_together_in_waves_are_the_plugins():
    names = [name for name in EFFECTS if "," not in name and name != "current"]
    effects = [each for name in names for each in EFFECTS[name]]
    sea = json.dumps({"schema": "hydro-waves/1"} | SEAS["two waves"])
    moving = effect("current", x=0.3, y=-0.2, z=0.1)
    close(Pair(vehicle(*effects, moving, waves=sea, waterline=0.05), nworld=16), later=41.7)


@pytest.mark.filterwarnings("ignore:.*act by the effect `hydrostatics`")
def test_waves_push_what_no_hydrostatics_floats():
    sea = json.dumps({"schema": "hydro-waves/1"} | SEAS["two waves"])
    close(Pair(vehicle(*WATER[:-1], waves=sea, waterline=0.05, volume=0.022), nworld=16), later=41.7)


def test_a_hull_mesh_is_the_plugins():
    spec = scene("boat")
    # The hull is longer than a fifth of the scene's wave, and the buoy is a cylinder.
    sea, buoy = spec.plugins
    longer = {"schema": "hydro-waves/1", "components": [{"height": 0.5, "period": 7, "direction": 20}]}
    sea.config = dict(sea.config) | {"waves": json.dumps(longer)}
    buoy.config = {key: value for key, value in dict(buoy.config).items() if key not in ("waterline", "waves")}
    close(Pair(spec, nworld=16))


@pytest.mark.parametrize("option", ['integrator="RK4"', 'gravity="0 0 0"', 'gravity="1 2 -3"'])
def test_options_are_the_plugins(option):
    close(Pair(vehicle(*WATER[:-1], *EFFECTS["net_buoyancy"], *EFFECTS["buoyancy_offset"], option=option), nworld=8))


def alone():
    """The spec of a body alone in its tree, of which MuJoCo keeps a diagonal of inertia."""
    text = """<mujoco><option timestep="0.005"/><extension><plugin plugin="hydro.wrench"><instance name="water">
      <config key="effects" value='{"schema": "hydro-effects/1", "effects": [%s]}'/></instance></plugin></extension>
      <worldbody><body name="hull"><freejoint/><geom type="box" size="0.3 0.2 0.1" mass="25"/>
      <plugin plugin="hydro.wrench" instance="water"/></body></worldbody></mujoco>"""
    return with_sensor(mujoco.MjSpec.from_string(text % EFFECTS["quadratic_drag"][0]))


def test_a_body_alone_in_its_tree_keeps_a_diagonal():
    """MuJoCo has no room for products of its degrees of freedom: the damping is lumped, as the plugin lumps it."""
    close(Pair(alone(), nworld=8))


def test_added_mass_without_room_is_refused():
    pair = Pair(alone())
    with pytest.raises(DataError, match="`added_mass` on body `hull`, whose inertia MuJoCo keeps as a diagonal"):
        pair.water.set("added_mass", np.eye(6)[np.newaxis, np.newaxis])
    assert not pair.water.numbers.added_mass.numpy().any()
    pair.water.set("added_mass", np.zeros((1, 1, 6, 6)))


def test_gusts_may_be_set_but_not_under_runge_kutta():
    calm = Pair(vehicle(*EFFECTS["linear_drag"]), nworld=2)
    calm.water.set("gust_deviation", np.array([[[0.1, 0, 0]], [[0.0, 0.2, 0]]]))
    calm.compare(calm.states())
    assert (calm.water.gust.numpy()[:, 0] != 0).tolist() == [[True, False, False], [False, True, False]]
    runge_kutta = Pair(vehicle(*EFFECTS["linear_drag"], option='integrator="RK4"'))
    with pytest.raises(DataError, match="`RK4` with the key `random`"):
        runge_kutta.water.set("gust_deviation", np.full((1, 1, 3), 0.1))
    assert not runge_kutta.water.numbers.gust_deviation.numpy().any()


@pytest.fixture(scope="module")
def rov():
    return Pair(scene("rov"), nworld=2)


def test_a_vehicle_goes_where_the_plugins_does(rov):
    data, d = together(rov, 400)
    assert data.time == pytest.approx(2)
    for place in d.qpos.numpy():
        assert place == pytest.approx(data.qpos, abs=1e-4)
    assert d.qvel.numpy()[1] == pytest.approx(data.qvel, abs=1e-4)
    assert np.abs(data.qvel).max() > 0.5
    assert d.sensordata.numpy()[0, 3:] == pytest.approx(data.sensordata[3:], abs=1e-4 * np.abs(data.sensordata).max())


def test_gusts_are_the_plugins_and_start_anew_after_a_reset(rov):
    data, d = together(rov, 50)
    mjw.forward(rov.m, d)
    # Three numbers of velocity and how many were drawn.
    gust = data.plugin_state[:3].copy()
    assert data.plugin_state[3] == 51
    assert np.abs(gust[:2]).min() > 1e-4
    assert rov.water.gust.numpy()[:, 0] == pytest.approx(np.array([gust, gust]), abs=1e-6)
    mjw.forward(rov.m, d)
    assert rov.water.gust.numpy()[0, 0] == pytest.approx(gust, abs=1e-6)
    data, d = together(rov, 50)
    mjw.forward(rov.m, d)
    assert rov.water.gust.numpy()[0, 0] == pytest.approx(gust, abs=1e-6)


def test_gusts_may_differ_by_world():
    pair = Pair(scene("rov"), nworld=3)
    pair.water.set("gust_seed", np.array([[1], [2], [2**63 + 5]], dtype=np.uint64))
    pair.compare(pair.states())
    gusts = pair.water.gust.numpy()[:, 0]
    assert np.unique(gusts[:, 0]).size == 3
    assert np.abs(gusts).max() < 0.2


def test_the_ant_of_another_wheel_goes_where_the_plugins_does():
    data, d = together(Pair(ant()), 200)
    assert data.time == pytest.approx(2)
    assert d.qpos.numpy()[0] == pytest.approx(data.qpos, abs=1e-3)
    assert d.qvel.numpy()[0] == pytest.approx(data.qvel, abs=1e-3 * np.abs(data.qvel).max())
    assert np.abs(data.qvel[6:]).max() > 0.5


def test_the_ant_of_another_wheel_is_the_plugins():
    close(Pair(ant(), nworld=16))


def test_the_page_of_it_says_what_works():
    page = Path(__file__).parents[2] / "docs" / "warp.md"
    names = {}
    for block in re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL):
        exec(block, names)
    assert names["attached"].bodies == ("head", "trunk", "rear", "tail")
    assert names["attached"].wrench.shape == (64, 4)
    assert names["attached"].numbers.quadratic_drag.shape == (64, 4)
    assert np.isfinite(names["attached"].wrench.numpy()).all()
    assert names["swum"].bodies[0] == "trunk"


def test_a_step_in_two_halves_is_the_step(rov):
    def halves(m, d):
        mjw.step1(m, d)
        mjw.step2(m, d)

    _, whole = together(rov, 20)
    _, split = together(rov, 20, halves)
    assert split.qvel.numpy()[0] == pytest.approx(whole.qvel.numpy()[0], abs=1e-6)
    # Of the factor of M that has the water in it.
    assert np.abs(whole.qacc_smooth.numpy()).max() > 0.1
    assert split.qacc_smooth.numpy()[0] == pytest.approx(whole.qacc_smooth.numpy()[0], abs=1e-4)


def test_coefficients_may_differ_by_world(rov):
    pair = Pair(scene("rov"), nworld=2)
    drag = np.repeat(pair.water.numbers.quadratic_drag.numpy(), 2, axis=0)
    drag[1] *= 3
    pair.water.set("quadratic_drag", drag)
    _, d = together(pair, 100)
    _, usual = together(rov, 100)
    assert d.qvel.numpy()[0] == pytest.approx(usual.qvel.numpy()[0], abs=1e-6)
    assert np.linalg.norm(d.qvel.numpy()[1, :3]) < 0.9 * np.linalg.norm(usual.qvel.numpy()[1, :3])


@pytest.mark.parametrize(
    ("name", "values", "reason"),
    [
        ("drag", np.zeros((1, 1)), "`drag`; there are: added_mass"),
        ("up_force", np.zeros((3, 1)), r"shape \(3, 1\); expected \(1, 1\) or \(2, 1\)"),
        ("up_force", np.full((1, 1), np.nan), "holds nan"),
    ],
)
def test_coefficients_of_another_shape_are_refused(rov, name, values, reason):
    before = rov.water.numbers.up_force.numpy().copy()
    with pytest.raises(DataError, match=reason):
        rov.water.set(name, values)
    assert rov.water.numbers.up_force.numpy() == pytest.approx(before)


def test_a_callback_that_is_there_already_acts_first():
    spec = vehicle(*EFFECTS["linear_drag"])
    model, plain = spec.compile(), water.without_plugin(spec).compile()
    m, order = mjw.put_model(plain), []
    m.callback.passive = lambda m, d: order.append("theirs")
    attached = water.attach(m, model, nworld=1)
    data = mujoco.MjData(plain)
    mujoco.mj_forward(plain, data)
    m.callback.passive(m, mjw.put_data(plain, data))
    assert order == ["theirs"]
    assert m.callback.passive == attached.passive


def test_another_number_of_worlds_is_refused(rov):
    data = mujoco.MjData(rov.plain)
    mujoco.mj_forward(rov.plain, data)
    with pytest.raises(DataError, match="the data has 3 worlds, and the water was attached for 2"):
        rov.water.passive(rov.m, mjw.put_data(rov.plain, data, nworld=3))
