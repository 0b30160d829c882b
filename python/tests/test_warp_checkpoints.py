"""Checkpoints in MuJoCo Warp against the plugin: the wrench along its rollouts, resets, many worlds, attributes."""

import json

import mujoco
import numpy as np
import pytest

from drawn_checkpoints import LINKS, draw
from hydro_mujoco.errors import DataError
from warp_rollouts import Rollout, differences, replay, swimmer
from warp_scenes import Pair, effect, mjw, together, vehicle, water, wp

#: Relative to the greatest value along a rollout, number by number: a network in single precision, sample by sample.
CLOSE = 3e-5
CHECKPOINTS = (
    *("b1-relaxation", "b1-strip", "b1-strip-mlp-ode", "b1-strip-attention-ode", "b1-task2"),
    *("b1-strip-lstm", "b1-strip-cnode"),
)
PARTS = ("hip", "thigh", "calf")
SIX = ("surge", "sway", "heave", "roll", "pitch", "yaw")
BESIDE = (effect("linear_drag", **dict(zip(SIX, (10, 20, 30, 1, 2, 3)))), effect("hydrostatics"))
RELAXATION = {"window": 3, "hidden": [9, 7], "encoding": "hydrodynamic", "skip": True, "modes": 3, "memory": 5}
STEPPED = {"latent": 6, "hidden": [9], "encoding": "raw", "field_sees_force": True, "skip": True}
ATTENTION = STEPPED | {"window": 3, "heads": 2, "embedding": 8, "end_of_step": True}
CNODE = {"hidden_state": 3, "hidden": [9], "encoding": "up", "control": "hermite"}
DRAWN = {
    "relaxation-ode, hydrodynamic": ("relaxation-ode", RELAXATION, {}),
    "relaxation-ode, links": ("relaxation-ode", RELAXATION | {"encoding": LINKS, "window": 1}, {"limited": False}),
    "mlp-ode, rk4": ("mlp-ode", STEPPED | {"latent_hidden": [5]}, {"solver": "rk4"}),
    "mlp-ode, a running sum": ("mlp-ode", STEPPED | {"latent_hidden": [], "field_sees_force": False}, {}),
    "attention-ode, end of step": ("attention-ode", ATTENTION, {"sample_period": 0.005}),
    "lstm, three layers": ("lstm", {"hidden": [5, 3, 4], "encoding": "up", "skip": False}, {}),
    "cnode, rk4": ("cnode", CNODE, {"solver": "rk4"}),
    "mlp": ("mlp", {"hidden": [8], "encoding": "up", "skip": True}, {"limited": False}),
}


@pytest.mark.parametrize("name", CHECKPOINTS)
def test_the_wrench_along_a_rollout_is_the_plugins(name):
    """Two worlds in other states, one of which is reset alone: 300 steps, 60 samples."""
    pair = Pair(swimmer(name), nworld=2)
    long = Rollout(pair.model, 300)
    halves = [Rollout(pair.model, 150, seed) for seed in (1, 2)]
    found = differences(pair, [[long], halves])
    assert max(found) < CLOSE, found
    assert np.abs(long.sensor).max() > 100


@pytest.mark.parametrize("name", DRAWN)
def test_every_kind_and_encoding_is_the_plugins(name, tmp_path):
    """A step of 5 ms does not divide the sample period of 12 ms; velocities leave the range of the training."""
    kind, config, of = DRAWN[name]
    spec = vehicle(*BESIDE, checkpoint=draw(tmp_path / "drawn", kind, config, **of))
    pair = Pair(spec, nworld=3)
    tracks = [[Rollout(pair.model, 60, seed), Rollout(pair.model, 40, seed + 3)] for seed in range(3)]
    found = differences(pair, tracks)
    assert max(found) < CLOSE, found


ATTRIBUTES = {
    "water": {"current": "0.3 -0.2 0.1", "density": 1010},
    "wrench_scale": {"wrench_scale": "1 2 0.5 3 1 0.7"},
    "outputs": {"outputs": "wrench"},
    "initial_force": {"initial_force": " ".join(["40 -30 500 2 -3 1", *["0.5"] * 12])},
    "joints": {"joints": " ".join(f"{leg}_{part}_joint" for leg in ("FL", "FR", "RL", "RR") for part in PARTS)},
}


@pytest.mark.parametrize("name", ATTRIBUTES)
def test_each_attribute_of_a_checkpoint_is_the_plugins(name):
    pair = Pair(swimmer("b1-strip", **ATTRIBUTES[name]))
    found = differences(pair, [[Rollout(pair.model, 60)]])
    assert max(found) < CLOSE, found


def test_an_attributes_solver_is_the_plugins():
    pair = Pair(swimmer("b1-strip-mlp-ode", solver="rk4"))
    found = differences(pair, [[Rollout(pair.model, 60)]])
    assert max(found) < CLOSE, found


def test_gusts_and_a_profile_move_the_water_of_a_checkpoint():
    current = {
        "schema": "hydro-current/1",
        "profile": [{"depth": 0, "velocity": [0.4, 0, 0]}, {"depth": 0.1, "velocity": [-0.2, 0.1, 0.05]}],
        "random": {"deviation": [0.2, 0.1, 0.05], "time_constant": 2, "seed": 3},
    }
    pair = Pair(swimmer("b1-relaxation", current=json.dumps(current)))
    found = differences(pair, [[Rollout(pair.model, 60)]])
    assert max(found) < CLOSE, found


WAVES = {"schema": "hydro-waves/1", "components": [{"height": 0.3, "period": 5, "direction": 20}]}


@pytest.mark.filterwarnings("ignore:.*act by the effect `hydrostatics`")
@pytest.mark.parametrize("waves", [None, WAVES], ids=["still", "waves"])
@pytest.mark.parametrize("name", ["b1-relaxation", "b1-strip"])
def test_the_force_fades_with_the_submerged_part_of_the_robot(name, waves):
    # Feet and calves overlap.
    hull = ["trunk_hull", *(f"{leg}_{part}_hull" for leg in ("FR", "FL", "RR", "RL") for part in PARTS)]
    sea = {"waterline": -0.1, "hull": " ".join(hull)} | ({} if waves is None else {"waves": json.dumps(waves)})
    pair = Pair(swimmer(name, **sea), nworld=2)
    found = differences(pair, [[Rollout(pair.model, 60, seed)] for seed in (0, 1)])
    assert max(found) < CLOSE, found
    share = pair.water.share.numpy()
    assert 0.05 < share.min() < share.max() < 0.95


def test_a_state_beyond_the_range_of_the_training_is_held_and_braked():
    pair = Pair(swimmer("b1-strip"))
    rollout = Rollout(pair.model, 30, speed=4)
    assert max(differences(pair, [[rollout]])) < CLOSE
    assert np.abs(rollout.states[0][2]).max() > 6


def test_many_worlds_are_as_one():
    """Bit for bit, in whatever place of a group a world stands."""
    spec = swimmer("b1-strip-attention-ode")
    one, many = Pair(spec, nworld=1), Pair(spec, nworld=64)
    rollouts = [Rollout(one.model, 12, seed) for seed in range(3)]
    alone = [replay(one, [[rollout]]) for rollout in rollouts]
    for ours, *theirs in zip(replay(many, [[rollouts[world % 3]] for world in range(64)]), *alone, strict=True):
        for world in range(64):
            assert np.array_equal(ours[:, world], theirs[world % 3][:, 0])


def test_steps_take_no_memory(monkeypatch):
    """As a CUDA graph asks for: neither at a start, which settles the first force, nor at samples."""
    pair = Pair(swimmer("b1-strip-attention-ode"), nworld=2)
    d, allocator, taken = mjw.make_data(pair.plain, nworld=2), wp.get_device("cpu").get_allocator(), []
    allocate = allocator.allocate
    monkeypatch.setattr(allocator, "allocate", lambda *sizes: taken.append(sizes) or allocate(*sizes))
    for step in range(7):
        d.time.fill_(0.002 * step)
        taken.clear()
        pair.water.passive(pair.m, d)
        assert not taken
    wp.zeros(3, dtype=float, device="cpu")
    assert taken


def test_a_robot_goes_where_the_plugins_does_and_again_after_a_reset():
    pair = Pair(swimmer("b1-strip"), nworld=3)
    for _ in range(2):
        data, d = together(pair, 50)
        assert data.time == pytest.approx(0.1)
        for world in range(3):
            assert d.qpos.numpy()[world] == pytest.approx(data.qpos, abs=1e-5)
            assert d.qvel.numpy()[world] == pytest.approx(data.qvel, abs=1e-4 * np.abs(data.qvel).max())
        assert np.abs(data.qvel).max() > 0.3


def test_a_world_that_is_moved_before_its_first_step_or_in_time_starts_anew():
    pair = Pair(swimmer("b1-strip"))
    rollout, moved, later = (Rollout(pair.model, 8, seed) for seed in (0, 1, 0))
    expected, *_ = replay(pair, [[rollout]])
    del moved.states[1:]
    later.states = [(time + 5, qpos, qvel) for time, qpos, qvel in later.states]
    found, *_ = replay(pair, [[moved, rollout, later]])
    assert not np.allclose(found[0], expected[0])
    assert np.array_equal(found[1:], np.concatenate([expected, expected]))


def test_a_state_that_is_no_number_has_no_force_until_a_reset():
    pair = Pair(swimmer("b1-relaxation"), nworld=2)
    rollout, broken = Rollout(pair.model, 8), Rollout(pair.model, 8)
    broken.states[4][2][7] = np.nan
    sensor, *_ = replay(pair, [[broken, rollout], [rollout, rollout]])
    assert np.abs(sensor[:4, 0]).min() > 0
    assert not sensor[4:8, 0].any()
    assert np.array_equal(sensor[8:, 0], sensor[8:, 1])


@pytest.mark.parametrize(
    ("attributes", "step", "reason"),
    [
        ({"solver": "dopri5"}, 0.002, "checkpoint b1-task2: solver `dopri5` is not supported in MuJoCo Warp, only"),
        ({"engine": "fused-f16"}, 0.002, "attribute `engine` is not supported"),
        ({"waterline": 0}, 0.002, "hull of body `FR_calf`: boxes round two of its geoms overlap"),
        ({}, 0.02, "a step of 0.02 s, longer than the sample period, is not supported"),
    ],
)
def test_what_a_checkpoint_does_not_get_is_refused_by_name(attributes, step, reason):
    spec = swimmer("b1-task2", step, **attributes)
    m = mjw.put_model(water.without_plugin(spec).compile())
    with pytest.raises(DataError, match=reason):
        water.attach(m, spec.compile(), nworld=1)
    assert m.callback.passive is None


def test_runge_kutta_with_a_checkpoint_is_refused_by_name():
    spec = swimmer("b1-task2")
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    with pytest.raises(DataError, match="`RK4` with attribute `checkpoint` is not supported"):
        Pair(spec)


def test_attention_over_features_is_refused_by_name(tmp_path):
    features = ATTENTION | {"tokens": "features", "window": 1}
    shapes = {key: features[key] for key in features if key != "end_of_step"}
    folder = draw(tmp_path / "drawn", "attention-ode", shapes)
    with pytest.raises(DataError, match="checkpoint drawn: attention over `features` is not supported"):
        water.checkpoint.card.read_card(folder, "instance `water`")
