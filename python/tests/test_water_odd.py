"""`add_water` with odd arguments: a DataError, a refusal when the spec is compiled, or a model that steps. Needs hypothesis."""

import json

import mujoco
import numpy as np
import pytest

import hydro_mujoco
from hydro_mujoco import plugin
from hydro_mujoco.errors import DataError

pytest.importorskip("hypothesis")
from hypothesis import given, settings  # noqa: E402
from hypothesis import strategies as st  # noqa: E402

pytestmark = pytest.mark.skipif(not plugin.built_library().is_file(), reason="no plugin library: cargo build --release")

HULL = """<mujoco><option timestep="0.005"/><worldbody>
  <body name="hull"><freejoint/><geom name="keel" type="ellipsoid" size="0.33 0.18 0.1" mass="25"/>
    <body name="fin" pos="-0.3 0 0"><joint name="hinge"/><geom name="fin" size="0.05" mass="1"/></body></body>
</worldbody><actuator><motor name="servo" joint="hinge"/></actuator></mujoco>"""
NUMBERS = st.floats() | st.integers() | st.sampled_from([0.0, 1e300, -1e300, 1e18, 1e-320])
SIX = ("surge", "sway", "heave", "roll", "pitch", "yaw")
PARAMETERS = st.dictionaries(
    st.sampled_from([*SIX, "x", "y", "z", "force", "volume", "area", "mass", "delay", "matrix", "point"]),
    NUMBERS | st.none() | st.text(max_size=3) | st.lists(NUMBERS, max_size=3),
    max_size=7,
)
DRAG = st.fixed_dictionaries(dict.fromkeys(SIX, NUMBERS))
NAMES = [
    "linear_drag",
    "added_mass",
    "current",
    "net_buoyancy",
    "hydrostatics",
    "payload",
    "actuator_delay",
    "user.a",
    "",
]
EFFECTS = st.one_of(
    st.dictionaries(st.sampled_from(NAMES), PARAMETERS, max_size=3),
    st.fixed_dictionaries({"linear_drag": DRAG}),
    st.fixed_dictionaries({"quadratic_drag": DRAG, "added_mass": DRAG}),
    st.lists(
        st.fixed_dictionaries(
            {"effect": st.sampled_from(NAMES), "target": st.sampled_from(["hull", "fin", "hinge", "servo", ""])},
            optional={"parameters": PARAMETERS},
        ),
        max_size=2,
    ),
    st.text(max_size=8),
)
ODD = {
    "waterline": NUMBERS,
    "current": st.lists(NUMBERS, min_size=2, max_size=4) | st.text(max_size=6),
    "waves": st.lists(
        st.fixed_dictionaries({}, optional=dict.fromkeys(("height", "period", "direction"), NUMBERS)), max_size=3
    ),
    "density": NUMBERS,
    "hull": st.sampled_from(["keel", "fin keel", "", "none", ["keel"]]),
    "volume": NUMBERS,
    "centre_of_buoyancy": st.lists(NUMBERS, min_size=2, max_size=4),
}


@given(effects=EFFECTS, more=st.fixed_dictionaries({}, optional=ODD))
@settings(max_examples=60, deadline=None)
def test_odd_water_is_refused_or_steps(effects, more):
    spec = mujoco.MjSpec.from_string(HULL)
    try:
        model = hydro_mujoco.add_water(spec, body="hull", effects=effects, **more).compile()
    except DataError as error:
        assert str(error)
        return
    except ValueError as error:
        # A number that JSON has not stays one; what the plugin refuses it names.
        assert "hydro" in str(error) or "must not" in str(error), error
        assert len(str(error).splitlines()) <= 3, error
        return
    data = mujoco.MjData(model)
    for _ in range(3):
        mujoco.mj_step(model, data)
    assert np.isfinite(data.qfrc_passive).all() or np.abs(data.qacc).max() == 0


@given(
    st.dictionaries(
        st.sampled_from(["schema", "effects", "components", "a"]), NUMBERS | st.text(max_size=4), max_size=3
    )
)
@settings(max_examples=25, deadline=None)
def test_a_document_of_anything_is_refused(document):
    for name in ("effects", "current", "waves"):
        given = {"effects": {"linear_drag": dict.fromkeys(SIX, 1.0)}, "waterline": 0.0} | {name: json.dumps(document)}
        spec = hydro_mujoco.add_water(mujoco.MjSpec.from_string(HULL), body="hull", **given)
        with pytest.raises(ValueError, match=f"`{name}`|effects"):
            spec.compile()
