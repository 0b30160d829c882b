"""The costs of water: every effect has a row, and each row's water does something."""

import mujoco
import numpy as np
import pytest

from hydro_mujoco import gap
from hydro_mujoco.plugin import built_library, load_plugin
from hydro_tools.commands.bench_step import steps
from hydro_tools.commands.bench_step import table as ratios
from hydro_tools.water_costs.rows import ELSEWHERE, rows
from hydro_tools.water_costs.scene import GEOMS
from hydro_tools.water_costs.timing import measure, table

pytestmark = pytest.mark.skipif(not built_library().is_file(), reason="no plugin is built: cargo build")


@pytest.fixture(scope="module")
def found():
    load_plugin()
    return {row.name: row for row in rows()}


def test_every_effect_and_every_form_has_a_row(found):
    applied = {name for name, entry in gap.effects().items() if entry.target != "sensor"} - {"joint_backlash"}
    effects = applied - ELSEWHERE
    assert applied > ELSEWHERE
    assert {f"`{name}`" for name in effects} | {f"`hydrostatics`, {name}" for name in GEOMS} <= set(found)


def test_what_is_timed_moves_the_body(found):
    for name, row in found.items():
        bare, without, wet = row.models()
        assert (bare.nplugin, without.nplugin, wet.nplugin) == (0, 1, 1), name
        ends = []
        for model in (without, wet):
            data = mujoco.MjData(model)
            data.qvel[:], data.ctrl[:] = 0.1, 0.5
            mujoco.mj_step(model, data, 20)
            ends.append(np.concatenate([data.qpos, data.qvel]))
        # Water that moves is felt by what drags alone.
        assert name == "`current`" or not np.array_equal(*ends), name


def test_a_table_of_medians(found):
    some = [found[name] for name in ("`lift`", "`hydrostatics`, sphere")]
    times = measure(some, rounds=2)
    assert {name: each.shape for name, each in times.items()} == {row.name: (2, 3) for row in some}
    lines = table({"water": np.array([[1.0, 2, 4], [1, 3, 6], [1, 2, 4]])}).splitlines()
    assert lines[-1] == "| water | 4.00 | 3.00 | 2.00 (2.00 to 2.50) |"


def test_two_builds_in_turn():
    once = steps(built_library(), 1)
    lines = ratios([once, once], [once, once]).splitlines()
    assert len(lines) == 2 + len(once) and "| 1.000 (1.000 to 1.000) | the same bits |" in lines[-1]
    slower = {name: {"microseconds": 2 * each["microseconds"], "end": "elsewhere"} for name, each in once.items()}
    assert "| 2.000 (2.000 to 2.000) | another |" in ratios([once], [slower])
