"""Drag that other simulators have, by products of two velocities; water that a program changes while it runs."""

import mujoco
import numpy as np
import pytest

import hydro_mujoco
from hydro_mujoco import plugin

pytestmark = pytest.mark.skipif(not plugin.built_library().is_file(), reason="no plugin library: cargo build")

SIX = ("surge", "sway", "heave", "roll", "pitch", "yaw")
HULL = """<mujoco><option timestep="0.005" gravity="0 0 0" integrator="implicitfast"/><worldbody>
  <body name="hull"><freejoint/><geom type="ellipsoid" size="0.33 0.18 0.1" mass="25"/></body></worldbody></mujoco>"""


def tensors(seed):
    """Coefficients of any sign, a third of them zero."""
    random = np.random.default_rng(seed)
    shape = (2, 6, 6, 6)
    return np.where(random.uniform(size=shape) < 1 / 3, 0, random.uniform(-20, 20, shape))


@pytest.mark.parametrize("given", ["both", "modulus", "plain"])
def test_quadratic_drag_of_two_velocities(given):
    a, b = tensors(3)
    parts = {"modulus": a, "plain": b} if given == "both" else {given: a if given == "modulus" else b.tolist()}
    effects = [{"effect": "linear_drag", "parameters": dict.fromkeys(SIX, 2.0)}]
    effects += hydro_mujoco.drag_tensors("drag", **parts)
    current = np.array([0.3, -0.2, 0.1])
    spec = mujoco.MjSpec.from_string(HULL)
    model = hydro_mujoco.add_water(spec, body="hull", effects=effects, current=current).compile()
    data = mujoco.MjData(model)
    for velocity in np.random.default_rng(4).normal(size=(20, 6)):
        data.qvel[:] = velocity
        mujoco.mj_forward(model, data)
        nu = velocity - [*current, 0, 0, 0]
        expected = -2 * nu
        if "modulus" in parts:
            expected = expected + np.einsum("ijk,j,k", a, nu, np.abs(nu))
        if "plain" in parts:
            expected = expected + np.einsum("ijk,j,k", b, nu, nu)
        np.testing.assert_allclose(hydro_mujoco.wrench(model, data, "hull"), expected, atol=1e-9)


def test_it_fades_with_the_submerged_part_of_the_hull():
    a, b = tensors(5)
    effects = hydro_mujoco.drag_tensors("drag", modulus=a, plain=b)
    spec = hydro_mujoco.add_water(mujoco.MjSpec.from_string(HULL), body="hull", effects=effects, waterline=0)
    model = spec.compile()
    data = mujoco.MjData(model)
    for height, share in ((-1.0, 1.0), (0.0, 0.5), (0.05, 0.15625), (1.0, 0.0)):
        data.qpos[2] = height
        data.qvel[:] = (0.5, -1, 0.3, 0.2, -0.7, 0.4)
        mujoco.mj_forward(model, data)
        nu = data.qvel
        whole = np.einsum("ijk,j,k", a, nu, np.abs(nu)) + np.einsum("ijk,j,k", b, nu, nu)
        np.testing.assert_allclose(hydro_mujoco.wrench(model, data, "hull"), share * whole, atol=1e-9)


def test_what_is_no_tensor_is_refused():
    a, _ = tensors(3)
    with pytest.raises(hydro_mujoco.DataError, match=r"plain: shape \(6, 6\), expected \(6, 6, 6\)"):
        hydro_mujoco.drag_tensors("drag", plain=a[0])
    with pytest.raises(hydro_mujoco.DataError, match="modulus: could not convert"):
        hydro_mujoco.drag_tensors("drag", modulus="abc")
    a[1, 2, 3] = np.nan
    with pytest.raises(hydro_mujoco.DataError, match=r"modulus\[1, 2, 3\]: nan, expected finite"):
        hydro_mujoco.drag_tensors("drag", modulus=a)
    for nothing in ({}, {"plain": np.zeros((6, 6, 6))}):
        with pytest.raises(hydro_mujoco.DataError, match="no number but zeros"):
            hydro_mujoco.drag_tensors("drag", **nothing)


def test_a_current_that_is_changed_goes_on_from_the_same_state():
    spec = mujoco.MjSpec.from_string(HULL)
    effects = {"linear_drag": dict.fromkeys(SIX, 20.0), "wake_memory": dict.fromkeys(SIX, 5.0) | {"rate": 0.5}}
    hydro_mujoco.add_water(spec, body="hull", effects=effects, current=(0.3, 0, 0))
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 400)
    before = data.time, data.qpos.copy(), data.qvel.copy(), data.plugin_state.copy()
    (water,) = spec.plugins
    water.config = {**water.config, "current": "0 0.3 0"}
    model, data = spec.recompile(model, data)
    for kept, was in zip((data.time, data.qpos, data.qvel, data.plugin_state), before):
        np.testing.assert_array_equal(kept, was)
    mujoco.mj_step(model, data, 4000)
    np.testing.assert_allclose(data.qvel[:3], [0, 0.3, 0], atol=1e-3)
