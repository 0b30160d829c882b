"""Effects that remember the motion, in MuJoCo Warp against the plugin."""

import json

import numpy as np
import pytest

from hydro_mujoco.errors import DataError
from warp_rollouts import Rollout, differences, replay
from warp_scenes import Pair, effect, together, vehicle

SIX = ("surge", "sway", "heave", "roll", "pitch", "yaw")
DRAG = effect("quadratic_drag", **dict(zip(SIX, (18, 30, 40, 0.5, 0.7, 0.8))))
CURRENT = {
    "schema": "hydro-current/1",
    "velocity": [0.2, 0, 0.1],
    "random": {"deviation": [0.2, 0.1, 0.05], "time_constant": 2, "seed": 3},
}
REMEMBERING = {
    "wake_memory": [effect("wake_memory", rate=2.5, **dict(zip(SIX, (20, 30, 35, 1, 2, 3))))],
    "wake_memory that forgets slowly": [effect("wake_memory", rate=0.05, **dict(zip(SIX, (20, 30, 35, 1, 2, 3))))],
    "wake_memory on a link": [effect("wake_memory", "fin", rate=8, **dict(zip(SIX, (2, 3, 3, 0.1, 0.2, 0.3))))],
    "basset_history": [effect("basset_history", surge=12, sway=20, heave=25)],
    "basset_history on a link": [effect("basset_history", "fin", surge=1, sway=3, heave=2)],
}
BOTH = [DRAG, *REMEMBERING["wake_memory"], *REMEMBERING["basset_history"], *REMEMBERING["wake_memory on a link"]]
#: Relative to the greatest value along a rollout, number by number.
CLOSE = 3e-5


def tracks(pair):
    """Rollouts of three worlds; the second is reset alone."""
    halves = [Rollout(pair.model, 60, seed) for seed in (1, 2)]
    return [[Rollout(pair.model, 120)], halves, [Rollout(pair.model, 120, 3)]]


@pytest.mark.parametrize("name", REMEMBERING)
def test_each_effect_that_remembers_is_the_plugins(name):
    pair = Pair(vehicle(*REMEMBERING[name]), nworld=3)
    found = differences(pair, tracks(pair))
    assert max(found) < CLOSE, found


def test_together_at_a_surface_in_gusts_they_are_the_plugins():
    spec = vehicle(*BOTH, effect("hydrostatics"), waterline=0.05, current=json.dumps(CURRENT))
    pair = Pair(spec, nworld=3)
    found = differences(pair, tracks(pair))
    assert max(found) < CLOSE, found


def test_a_vehicle_with_memory_goes_where_the_plugins_does_and_again_after_a_reset():
    pair = Pair(vehicle(*BOTH), nworld=2)
    for _ in range(2):
        data, d = together(pair, 100)
        assert d.qvel.numpy()[1] == pytest.approx(data.qvel, abs=1e-4 * np.abs(data.qvel).max())
        assert np.abs(data.qvel).max() > 0.3


def test_a_wake_may_differ_by_world():
    pair = Pair(vehicle(*REMEMBERING["wake_memory"]), nworld=2)
    pair.water.set("wake", pair.water.numbers.wake.numpy() * np.array([1.0, 3.0])[:, np.newaxis, np.newaxis])
    rollout = Rollout(pair.model, 20)
    sensor, *_ = replay(pair, [[rollout], [rollout]])
    assert sensor[-1, 1] == pytest.approx(3 * sensor[-1, 0], rel=1e-5)


def test_memory_under_runge_kutta_is_refused_by_name():
    with pytest.raises(DataError, match="`RK4` with the effects `wake_memory` and `basset_history` is not supported"):
        Pair(vehicle(*BOTH, option='integrator="RK4"'))
    pair = Pair(vehicle(DRAG, option='integrator="RK4"'))
    with pytest.raises(DataError, match="`RK4` with the effects `wake_memory`"):
        pair.water.set("basset", np.ones((1, 1, 3)))
