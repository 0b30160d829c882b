"""The soak: what it runs, what it calls broken, what the table counts."""

from collections import Counter
from pathlib import Path

import mujoco
import pytest

import hydro_mujoco as hydro
from hydro_mujoco.plugin import built_library, load_plugin
from hydro_tools.released import RELEASED
from hydro_tools.soak import SoakError, campaign, catalogue, energy, threads
from hydro_tools.soak.case import Case, Outcome, run
from hydro_tools.soak.scenes import INTEGRATORS, allows, robot

pytestmark = pytest.mark.skipif(not built_library().is_file(), reason="no plugin is built: cargo build")

STEPS = 75


@pytest.fixture(scope="module")
def effects() -> dict[str, catalogue.Effect]:
    return {effect.effect: effect for effect in catalogue.effects()}


def outcome(*effects: catalogue.Effect, calm: bool = False, integrator: str = "Euler", steps: int = STEPS) -> Outcome:
    warnings: Counter = Counter()
    mujoco.set_mju_user_warning(lambda text: warnings.update([text]))
    return run(Case("", effects, integrator, "violent", calm, 3), steps, warnings)


def test_every_effect_of_the_plugin_is_there_and_all_pairs_come(effects):
    assert {effect.target for effect in effects.values()} == {"hull", "fin", "hinge", "tail"}
    two = [effects["linear_drag"], effects["fin"]]
    kinds = Counter(kind for kind, _ in campaign.cases(two, 0))
    ways, checkpoints = len(INTEGRATORS) * 2, len(RELEASED)
    assert kinds == {
        "checkpoint": checkpoints * ways,
        "effect": 2 * ways,
        "pair": ways,
        "checkpoint and effect": 2 * checkpoints * ways,
        "energy": len(INTEGRATORS),
    }


def test_every_checkpoint_that_is_shipped_is_there_with_the_effects_that_it_allows(effects):
    """Added mass on the trunk of one whose card has it already is refused."""
    load_plugin()
    models = Path(hydro.checkpoint("b1-task2")).parent
    assert sorted(RELEASED) == sorted(folder.name for folder in models.glob("*") if (folder / "card.json").is_file())
    beside = effects["added_mass"]
    in_strips = [name for name in RELEASED if name.startswith("b1-strip")]
    assert [name for name in RELEASED if not allows(name, beside)] == in_strips
    for name in RELEASED:
        if allows(name, beside):
            robot(name, [beside], "Euler")
        else:
            with pytest.raises(SoakError, match="added mass"):
                robot(name, [beside], "Euler")


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_sound_water_passes_and_takes(effects, integrator):
    found = outcome(effects["quadratic_drag"], effects["added_mass"], calm=True, integrator=integrator)
    assert not found.broken
    assert 0 < found.energy <= 1 + energy.TOLERANCE
    assert found.steps == 150


def test_water_that_gives_energy_is_told(effects):
    gives = catalogue.Effect("constant_force", "hull", dict.fromkeys(effects["constant_force"].parameters, 200.0))
    found = outcome(gives, calm=True)
    assert found.energy > 1.01 and "times what there can be" in found.broken


def test_a_simulation_that_diverges_is_told(effects):
    huge = catalogue.Effect("constant_force", "hull", dict.fromkeys(effects["constant_force"].parameters, 1e15))
    assert "diverged" in outcome(huge).broken


def test_what_does_not_compile_is_told():
    assert outcome(catalogue.Effect("linear_drag", "keel", {})).broken.startswith("refused: linear_drag: ")


def test_another_run_after_a_reset_is_told(effects, monkeypatch):
    starts = iter(range(10))
    from hydro_tools.soak import motion

    def start(model, data, kind, seed):
        mujoco.mj_resetData(model, data)
        data.qvel[0] = next(starts)

    monkeypatch.setattr(motion, "start", start)
    assert outcome(effects["linear_drag"]).broken == "a reset does not give the same run"


def test_memory_that_grows_is_seen():
    assert campaign.growth([100.0] * 50) == 0
    assert campaign.growth([50.0, 90.0] + [100.0] * 40) == 0
    assert campaign.growth([float(k) for k in range(80)]) == pytest.approx(20)


def test_the_table_counts():
    tally = campaign.Tally()
    for n in range(2):
        tally.add(Outcome(75, 0.0, n == 0, "no" * n))
    assert campaign.table({("effect", "RK4"): tally}).splitlines()[-1] == "| effect | RK4 | 2 | 150 | 1 |  | 1 |"


def test_threads_get_the_run_of_one(effects, monkeypatch):
    few = [effects["linear_drag"], effects["wake_memory"]]
    found = threads.stress(few, 4, 0.5)
    models = len(RELEASED) + 1
    assert found.models > 4 and found.runs == found.models + 8 * models and not found.broken
    monkeypatch.setattr(threads, "_together", lambda model, count, expected: [expected == b"another run"])
    assert threads.stress(few, 1, 0.0).broken == models
