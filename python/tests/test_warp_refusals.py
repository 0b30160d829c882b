"""What hydro_mujoco.warp refuses, each by name, and that nothing is attached then."""

import json
import sys

import mujoco
import numpy as np
import pytest

from hydro_mujoco import gap
from hydro_mujoco.errors import DataError
from hydro_mujoco.program import run_json
from warp_scenes import effect, mjw, scene, vehicle, water

SIX = ("surge", "sway", "heave", "roll", "pitch", "yaw")
DRAG = effect("linear_drag", **dict.fromkeys(SIX, 1))
FLOAT = effect("hydrostatics")
BUOYANCY = "supported: added_mass, linear_drag, "
GRID = {"schema": "hydro-current/1", "grid": {"x": [0, 1], "velocity": [[0, 0, 0], [1, 0, 0]]}}
RANDOM = {"deviation": [0.1, 0.1, 0], "time_constant": 30, "seed": 1}


def refusal(spec, prepare=None):
    """What attaching the water of a spec is refused with; the Warp model keeps its callbacks."""
    model, plain = spec.compile(), water.without_plugin(spec).compile()
    m = mjw.put_model(plain)
    if prepare:
        prepare(m)
    with pytest.raises(DataError) as caught:
        water.attach(m, model, nworld=1)
    assert m.callback.passive is None
    assert m.callback.sensor is None
    text = str(caught.value)
    assert len(text.splitlines()) <= 3
    return text


def values_of(parameters):
    """Values of an effect that a file may have."""
    return {each.name: min(max(each.null, 0.1), each.upper or 1.0) for each in parameters if not each.optional}


def other_effects():
    """Effects of the catalogue that act on a vehicle in the plugin, and that MuJoCo Warp does not get."""
    known = gap.effects()
    there = {"body": "hull", "joint": "fin", "actuator": "left"}
    elsewhere = {*water.support.EFFECTS, "joint_backlash"}
    return [(id, there[of.target], of) for id, of in known.items() if of.target in there and id not in elsewhere]


@pytest.mark.parametrize(
    ("id", "target", "of"), other_effects(), ids=lambda value: value if isinstance(value, str) else ""
)
def test_every_other_effect_is_refused_by_name(id, target, of):
    attributes = {"waterline": 0} if id == "windage" else {}
    spec = vehicle(
        DRAG, json.dumps({"effect": id, "target": target, "parameters": values_of(of.parameters)}), **attributes
    )
    text = refusal(spec)
    assert f"effect `{id}` is not supported in MuJoCo Warp" in text
    assert "supported: added_mass, linear_drag, quadratic_drag," in text


def test_an_effect_of_ones_own_is_refused_by_name():
    definition = {"phrase": "a brake", "summary": "a brake", "target": "body", "wrench": {"surge": "-c * nu_surge^3"}}
    definition["parameters"] = {"c": {"unit": "N s^3/m^3", "lower": 0.0, "upper": 10.0, "prior_sd": 1.0}}
    own = {"effect": "user.brake", "target": "hull", "parameters": {"c": 1}, "definition": definition}
    assert "effect `user.brake` is not supported in MuJoCo Warp" in refusal(vehicle(DRAG, json.dumps(own)))


def test_every_attribute_is_known():
    known = next(each for each in run_json(["attributes"])["plugins"] if each["plugin"] == "hydro.wrench")
    assert {each["name"] for each in known["attributes"]} == {*water.support.ATTRIBUTES, *water.support.WITHOUT}


@pytest.mark.parametrize(
    ("attribute", "value"),
    [
        ("engine", "candle"),
    ],
)
def test_other_attributes_are_refused_by_name(attribute, value):
    text = value if isinstance(value, str) else json.dumps(value)
    found = refusal(vehicle(DRAG, **{attribute: text, "waterline": 0}))
    assert f"instance `water` of hydro.wrench: attribute `{attribute}` is not supported" in found
    assert "supported: effects, density" in found


def test_a_current_on_a_grid_is_refused_by_name():
    found = refusal(vehicle(DRAG, current=json.dumps(GRID)))
    assert "attribute `current`: `grid` is not supported" in found
    assert "supported: velocity, profile, random" in found


def test_a_current_that_a_program_sets_is_refused_by_name():
    settable = {"schema": "hydro-current/1", "velocity": [0, 0, 0], "settable": True}
    assert "attribute `current`: `settable` is not supported" in refusal(vehicle(DRAG, current=json.dumps(settable)))


def test_gusts_under_runge_kutta_are_refused_by_name():
    gusts = {"schema": "hydro-current/1", "velocity": [0, 0, 0], "random": RANDOM}
    found = refusal(vehicle(DRAG, current=json.dumps(gusts), option='integrator="RK4"'))
    assert "option integrator: `RK4` with the key `random` of attribute `current` is not supported" in found
    assert "supported: Euler, implicit, implicitfast" in found


@pytest.mark.filterwarnings("ignore:.*it scatters them")
def test_waves_that_are_short_beside_a_floating_hull_are_refused():
    short = {"schema": "hydro-waves/1", "components": [{"height": 0.05, "period": 1.3}]}
    found = refusal(vehicle(FLOAT, DRAG, waves=json.dumps(short), waterline=0))
    assert "instance `water`, body `hull`: a wave of 2.64 m over a hull of 0.66 m is not supported" in found
    assert "supported: waves of 3.3 m and longer" in found


def set_discrete(m):
    m.opt.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE


def set_sleep(m):
    m.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_SLEEP


def set_no_passive(m):
    m.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SPRING | mujoco.mjtDisableBit.mjDSBL_DAMPER


@pytest.mark.parametrize(
    ("prepare", "reason"),
    [
        (
            set_discrete,
            "option integrator: `discrete` is not supported in MuJoCo Warp, only in the plugin;\nsupported: Euler",
        ),
        (set_sleep, "option flag sleep: `enable` is not supported"),
        (set_no_passive, "option flags spring and damper are both `disable`"),
    ],
)
def test_options_are_refused_by_name(prepare, reason):
    assert reason in refusal(vehicle(DRAG), prepare)


def test_hulls_that_overlap_at_a_surface_are_refused():
    geoms = '<geom type="box" size="0.3 0.1 0.08" mass="13"/><geom type="sphere" size="0.1" mass="12"/>'
    assert "hull of body `hull`: boxes round two of its geoms overlap" in refusal(
        vehicle(FLOAT, geoms=geoms, waterline=0)
    )


def test_a_moving_water_beside_mujocos_fluid_is_refused():
    spec = vehicle(effect("current", x=0.1, y=0, z=0), DRAG, option='density="1000"')
    assert "effect `current` beside MuJoCo's own fluid" in refusal(spec)


def test_a_model_without_water_is_refused():
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody></mujoco>"
    )
    with pytest.raises(DataError, match="the model has no instance of hydro.wrench: hydro_mujoco.add_water"):
        water.attach(mjw.put_model(model), model, nworld=1)


def test_a_warp_model_of_another_robot_is_refused():
    other = mjw.put_model(water.without_plugin(scene("fish")).compile())
    with pytest.raises(DataError, match="the Warp model has nq = 10 and the MuJoCo model 8: make it of the same MJCF"):
        water.attach(other, vehicle(DRAG).compile(), nworld=1)


def test_no_worlds_are_refused():
    spec = vehicle(DRAG)
    with pytest.raises(DataError, match="nworld is 0; expected 1 or more"):
        water.attach(mjw.put_model(water.without_plugin(spec).compile()), spec.compile(), nworld=0)


def test_a_load_cell_is_refused_and_the_spec_stays():
    spec = vehicle(DRAG)
    spec.bodies[1].add_site(name="cell")
    sensor = spec.add_sensor(name="gantry", type=mujoco.mjtSensor.mjSENS_PLUGIN)
    plugin = spec.add_plugin(name="cell", plugin_name="hydro.load_cell", active=True)
    plugin.config = {"site": "cell"}
    spec.activate_plugin("hydro.load_cell")
    sensor.plugin.plugin_name, sensor.plugin.name, sensor.plugin.active = "hydro.load_cell", "cell", True
    with pytest.raises(
        DataError, match="sensor `gantry` is of the plugin hydro.load_cell, which does not act in MuJoCo"
    ):
        water.without_plugin(spec)
    assert spec.compile().nplugin == 2


def test_the_plain_model_has_all_readings_at_their_places():
    spec = vehicle(DRAG)
    model, plain = spec.compile(), water.without_plugin(spec).compile()
    assert plain.nplugin == 0
    assert np.array_equal(plain.sensor_adr, model.sensor_adr)
    assert np.array_equal(plain.sensor_dim, model.sensor_dim)


def test_a_file_of_effects_is_looked_for_and_missed_by_name(tmp_path, monkeypatch):
    (tmp_path / "drag.json").write_text(f'{{"schema": "hydro-effects/1", "effects": [{DRAG}]}}')
    monkeypatch.setenv("HYDRO_PATH", str(tmp_path))
    spec = vehicle(DRAG)
    spec.plugins[0].config = {"effects": "drag.json"}
    model = spec.compile()
    assert water.instances.instances(model)[0].effects[0]["effect"] == "linear_drag"
    (tmp_path / "drag.json").unlink()
    with pytest.raises(DataError, match="attribute `effects`: drag.json is no file any more"):
        water.instances.instances(model)


def test_a_missing_package_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco_warp", None)
    for name in [name for name in sys.modules if name.startswith("hydro_mujoco.warp")]:
        monkeypatch.delitem(sys.modules, name)
    with pytest.raises(ImportError, match=r"pip install 'hydro-mujoco\[warp\]'"):
        import hydro_mujoco.warp  # noqa: F401
