"""Drag that the catalogue lacks, as effects of one's own; water that a program changes while it runs."""

import mujoco
import numpy as np
import pytest

import hydro_mujoco
from hydro_mujoco import plugin

pytestmark = pytest.mark.skipif(not plugin.built_library().is_file(), reason="no plugin library: cargo build")

SIX = ("surge", "sway", "heave", "roll", "pitch", "yaw")
HULL = """<mujoco><option timestep="0.005" gravity="0 0 0" integrator="implicitfast"/><worldbody>
  <body name="hull"><freejoint/><geom type="ellipsoid" size="0.33 0.18 0.1" mass="25"/></body></worldbody></mujoco>"""
#: Units of a product of two velocities' coefficient: of forces by both linear, one, none; of torques the next.
UNITS = ("N s^2/m^2", "N s^2/m", "N s^2", "N m s^2")


def two_velocities(matrix: np.ndarray, second: str) -> dict:
    """-sum of A_ijk s(nu_k) nu_j over j and k as a definition; A: [6, 6, 6] in SI units, second: s, `abs(nu)` or `nu`.

    gz-sim's quadratic drag is one of each, the forward-speed term of uuv_simulator is A_ij0 with `nu`.
    """
    names, others = "uvwpqr", "abcdef"
    let = dict(zip(names, (f"nu_{axis}" for axis in SIX)))
    let |= {other: second.replace("nu", name) for other, name in zip(others, names)}

    def row(i: int) -> str:
        parts = []
        for j, name in enumerate(names):
            sums = []
            for kind in (0, 1):  # nu_k along an axis, about one
                terms = (f"{matrix[i, j, k]:+.4g}*{others[k]}" for k in range(3 * kind, 3 * kind + 3))
                sums.append(f"k{(i > 2) + (j > 2) + kind}*({''.join(terms).removeprefix('+')})")
            parts.append(f"{name}*({'+'.join(sums)})")
        return f"-scale*({'+'.join(parts)})"

    return {
        "summary": f"drag by {second} times nu",
        "target": "body",
        "parameters": {"scale": {"unit": "1", "lower": 0.0, "upper": 2.0, "null": 0.0, "prior_sd": 1.0}},
        "constants": {f"k{n}": {"value": 1.0, "unit": unit} for n, unit in enumerate(UNITS)},
        "let": let,
        "wrench": {axis: row(i) for i, axis in enumerate(SIX)},
    }


def test_quadratic_drag_of_two_velocities_by_effects_of_ones_own():
    random = np.random.default_rng(3)
    a, b = random.uniform(-20, 20, (2, 6, 6, 6)).round(2)
    effects = [
        {"effect": f"user.{name}", "parameters": {"scale": 1.0}, "definition": two_velocities(matrix, second)}
        for name, matrix, second in (("modulus", a, "abs(nu)"), ("plain", b, "nu"))
    ]
    model = hydro_mujoco.add_water(mujoco.MjSpec.from_string(HULL), body="hull", effects=effects).compile()
    data = mujoco.MjData(model)
    for velocity in random.normal(size=(20, 6)):
        data.qvel[:] = velocity
        mujoco.mj_forward(model, data)
        expected = -np.einsum("ijk,j,k", a, velocity, np.abs(velocity)) - np.einsum("ijk,j,k", b, velocity, velocity)
        np.testing.assert_allclose(hydro_mujoco.wrench(model, data, "hull"), expected, atol=1e-9)


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
