"""Tasks of `hydro_mujoco.envs`: terms by hand, rotations, seas, a controller. Skipped without the library."""

import importlib.util

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

gymnasium = pytest.importorskip("gymnasium")

import hydro_mujoco.envs  # noqa: E402, F401
from hydro_mujoco import packaged, plugin  # noqa: E402
from hydro_mujoco.envs import attitude  # noqa: E402
from hydro_mujoco.envs.b1_tasks import b1_task  # noqa: E402
from hydro_mujoco.envs.seas import draw_seas  # noqa: E402
from hydro_mujoco.envs.station_task import Station  # noqa: E402
from hydro_mujoco.envs.task import State  # noqa: E402

pytestmark = pytest.mark.skipif(not plugin.built_library().is_file(), reason="no plugin library: cargo build --release")


#: At x = 0.25 m ahead of a goal at the origin, on its axis, upright, moving forward at 0.2 m/s, joints at rest.
TERMS = [
    ("swim", {"reward_forward": 2.0, "reward_heading": 0.5, "reward_upright": 0.5}),
    ("hold", {"reward_place": 0.5, "reward_heading": 0.5, "reward_upright": 0.5}),
    ("waypoint", {"reward_progress": -2.0, "reward_reached": 500.0, "reward_upright": 0.5}),
]


@pytest.mark.parametrize(("task", "expected"), TERMS)
def test_terms_of_the_swimmer_by_hand(task, expected):
    water = b1_task(task, "b1-relaxation")
    state = by_hand(water, place=[0.25, 0, 0], speed=0.2)
    terms = {key: float(value[0]) for key, value in water.terms(state).items() if value[0] != 0}
    assert terms == pytest.approx(expected)
    assert bool(water.ended(state)[0]) == (task == "waypoint")
    low = by_hand(water, place=[0.25, 0, -1.6], speed=0.2)
    assert water.terms(low)["reward_depth"][0] == pytest.approx(-0.8)
    assert water.ended(low)[0]


def test_terms_of_the_vehicle_by_hand():
    water = Station(1, 0, 0.5, 0.4)
    state = by_hand(water, place=[0, 0.5, 0], speed=0)
    state.ctrl[:] = 0.5
    terms = {key: float(value[0]) for key, value in water.terms(state).items()}
    assert terms == pytest.approx({"reward_place": 0.2, "reward_heading": 0.25, "reward_effort": -0.025})
    assert not water.ended(state)[0]
    assert water.ended(by_hand(water, place=[0, 3.1, 0], speed=0))[0]
    assert water.ended(by_hand(water, place=[0, 0, 0], speed=0, quaternion=[0, 1, 0, 0]))[0]


def by_hand(water, place, speed, quaternion=(1, 0, 0, 0)):
    """A state with the goal at the origin, its x axis the world's."""
    model = water.models[0]
    qpos, qvel = np.zeros((1, model.nq)), np.zeros((1, model.nv))
    qpos[0, :3], qpos[0, 3:7], qvel[0, 0] = place, quaternion, speed
    goal, turn = np.zeros((1, 3)), np.array([[1.0, 0, 0, 0]])
    return State(np.zeros(1), qpos, qvel, np.zeros((1, model.nu)), goal, turn)


numbers = st.floats(-1, 1)


@settings(max_examples=100, deadline=None)
@given(st.lists(numbers, min_size=4, max_size=4), st.lists(numbers, min_size=3, max_size=3), st.floats(-3, 3))
def test_rotations_are_those_of_mujoco(quaternion, vector, angle):
    quaternion = np.array(quaternion) + [1.5, 0, 0, 0]
    quaternion /= np.linalg.norm(quaternion)
    matrix, turned = np.empty(9), np.empty(4)
    mujoco.mju_quat2Mat(matrix, quaternion)
    found = attitude.rotation(quaternion[None])
    np.testing.assert_allclose(found[0], matrix.reshape(3, 3), atol=1e-14)
    vector = np.array(vector)
    np.testing.assert_allclose(attitude.to_body(found, vector[None])[0], found[0].T @ vector, atol=1e-14)
    mujoco.mju_mulQuat(turned, quaternion, attitude.about_z(angle))
    np.testing.assert_allclose(attitude.product(quaternion, attitude.about_z(angle)), turned, atol=1e-14)


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 20), st.integers(0, 2**63 - 1))
def test_a_sea_depends_on_its_number_and_the_seed_alone(number, seed):
    seas = draw_seas(number, seed, 0.5, 0.4)
    assert seas[: number // 2] == draw_seas(number, seed, 0.5, 0.4)[: number // 2]
    assert len(set(seas)) == number


def test_the_controller_of_the_example_keeps_station_and_random_commands_do_not():
    spec = importlib.util.spec_from_file_location("station", f"{packaged.examples()}/rl/station.py")
    station = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(station)
    envs = gymnasium.make_vec("hydro_mujoco/RovStation-v0", num_envs=6, seas=3, sea_seed=9)
    returns = []
    for command in (station.pd, lambda observation: envs.action_space.sample()):
        envs.action_space.seed(0)
        observation, _ = envs.reset(seed=1)
        total, distance = np.zeros(6), np.zeros(6)
        for step in range(400):
            observation, reward, _, _, info = envs.step(command(observation))
            total += reward
            distance = np.maximum(distance, info["distance"] if step > 200 and "distance" in info else 0)
        returns.append(total.mean())
        if command is station.pd:
            assert distance.max() < 0.2
    assert returns[0] > 4 * returns[1]


def test_ppo_of_the_example_learns_for_a_moment(monkeypatch):
    pytest.importorskip("stable_baselines3", reason="pip install 'hydro-mujoco[rl]'")
    monkeypatch.syspath_prepend(f"{packaged.examples()}/rl")
    import ppo_b1

    model = ppo_b1.trained(256, robots=4, rounds=32)
    assert model.num_timesteps == 256
    total, ahead, lasted = ppo_b1.judged(model, robots=4, steps=20)
    assert np.isfinite(total).all() and np.abs(ahead).max() < 1.0 and (lasted == 20).all()
