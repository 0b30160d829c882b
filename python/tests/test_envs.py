"""`hydro_mujoco.envs`: Gymnasium's own checks, seeds, the vector environments. Skipped without the library."""

import pickle
import subprocess
import sys
import warnings

import mujoco
import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")
from gymnasium.utils.env_checker import check_env  # noqa: E402
from gymnasium.vector import AutoresetMode, SyncVectorEnv  # noqa: E402

from hydro_mujoco import packaged, plugin  # noqa: E402
from hydro_mujoco.envs.b1_swim import B1SwimEnv, B1SwimVectorEnv  # noqa: E402
from hydro_mujoco.envs.b1_tasks import B1Task  # noqa: E402
from hydro_mujoco.envs.rov_station import RovStationEnv, RovStationVectorEnv  # noqa: E402
from hydro_mujoco.envs.task import checked  # noqa: E402
from hydro_mujoco.errors import DataError  # noqa: E402

pytestmark = pytest.mark.skipif(not plugin.built_library().is_file(), reason="no plugin library: cargo build --release")
B1, ROV = "hydro_mujoco/B1Swim-v0", "hydro_mujoco/RovStation-v0"
#: Environments and arguments; few seas, for each is compiled.
CASES = [
    (B1, {"task": "swim"}),
    (B1, {"task": "hold", "checkpoint": "b1-task2"}),
    (B1, {"task": "waypoint"}),
    (ROV, {"seas": 3, "sea_seed": 5}),
]


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    """MuJoCo writes its warnings to a file in the working directory."""
    monkeypatch.chdir(tmp_path)


def run(env, seed, actions):
    """Observations, rewards and ends of an episode."""
    rows = [env.reset(seed=seed)[0]]
    rewards = []
    for action in actions:
        observation, reward, terminated, truncated, _ = env.step(action)
        rows.append(observation)
        rewards.append(reward)
        if terminated or truncated:
            break
    return np.array(rows), np.array(rewards)


def random_actions(env, number, seed=0):
    return np.random.default_rng(seed).uniform(-1, 1, (number, *env.action_space.shape)).astype(np.float32)


@pytest.mark.parametrize(("name", "arguments"), CASES)
def test_gymnasium_finds_no_fault(name, arguments):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        env = gymnasium.make(name, **arguments)
        # The render check opens a window.
        check_env(env.unwrapped, skip_render_check=True)
    told = [str(each.message) for each in caught]
    # Bounds without end, as all of Gymnasium's MuJoCo environments have.
    assert [text for text in told if "infinity" not in text and "is probably too" not in text] == []
    assert env.unwrapped.dt * env.spec.max_episode_steps >= 12


def test_the_module_in_the_name_registers():
    code = (
        "import gymnasium; env = gymnasium.make('hydro_mujoco.envs:hydro_mujoco/RovStation-v0', seas=1); "
        "print(env.reset(seed=0)[0].shape)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "(23,)\n"


def test_without_gymnasium_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    monkeypatch.delitem(sys.modules, "hydro_mujoco.envs")
    with pytest.raises(ImportError, match=r"pip install 'hydro-mujoco\[gym\]'"):
        __import__("hydro_mujoco.envs")


@pytest.mark.parametrize(("name", "arguments"), CASES)
def test_a_seed_gives_the_same_bits(name, arguments):
    first, second = gymnasium.make(name, **arguments), gymnasium.make(name, **arguments)
    actions = random_actions(first, 40)
    for seed in range(6):
        run(second, seed, actions)
    for seed in (7, 8):
        for one, other in zip(run(first, seed, actions), run(second, seed, actions)):
            np.testing.assert_array_equal(one, other)
    assert not np.array_equal(run(first, 7, actions)[0], run(first, 8, actions)[0])


def test_the_state_of_mujoco_is_the_whole_state():
    env = gymnasium.make(B1, task="waypoint").unwrapped
    actions = random_actions(env, 40)
    run(env, 3, actions[:20])
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.empty(mujoco.mj_stateSize(env.model, kind))
    mujoco.mj_getState(env.model, env.data, state, kind)
    first = [env.step(action)[0] for action in actions[20:]]
    mujoco.mj_setState(env.model, env.data, state, kind)
    np.testing.assert_array_equal(first, [env.step(action)[0] for action in actions[20:]])


@pytest.mark.parametrize(("name", "arguments"), CASES)
def test_the_reward_is_the_sum_of_its_terms(name, arguments):
    env = gymnasium.make(name, **arguments)
    env.reset(seed=0)
    for action in random_actions(env, 5):
        _, reward, _, _, info = env.step(action)
        assert reward == pytest.approx(sum(value for key, value in info.items() if key.startswith("reward_")))


def test_pickled_it_is_the_same():
    env = RovStationEnv(seas=2, sea_seed=4)
    actions = random_actions(env, 20)
    np.testing.assert_array_equal(run(env, 1, actions)[0], run(pickle.loads(pickle.dumps(env)), 1, actions)[0])


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
@pytest.mark.parametrize(("name", "arguments"), CASES)
def test_vector_and_single_agree_bit_for_bit(name, arguments, mode):
    """Over ends of episodes, rewards and infos too."""
    steps = 15
    singles = SyncVectorEnv(
        [lambda: gymnasium.make(name, max_episode_steps=steps, **arguments) for _ in range(5)], autoreset_mode=mode
    )
    vector = gymnasium.make_vec(
        name,
        num_envs=5,
        vectorization_mode="vector_entry_point",
        max_episode_steps=steps,
        nthread=2,
        autoreset_mode=mode,
        **arguments,
    )
    assert vector.metadata["autoreset_mode"] == mode
    assert vector.single_action_space == singles.single_action_space
    np.testing.assert_array_equal(singles.reset(seed=11)[0], vector.reset(seed=11)[0])
    for action in random_actions(vector, 40):
        *expected, expected_info = singles.step(action)
        *found, info = vector.step(action)
        for one, other in zip(expected, found):
            np.testing.assert_array_equal(one, other)
        same_infos(expected_info, info)
    # Without a seed each goes on drawing.
    np.testing.assert_array_equal(singles.reset()[0], vector.reset()[0])


def test_a_start_at_the_stops_of_the_joints_agrees_too(monkeypatch):
    """There the solver starts from the acceleration before."""
    start = B1Task.start

    def bent(self, random):
        begun = start(self, random)
        begun.qpos[[9, 12, 15, 18]] = -2.65
        begun.ctrl[:] = begun.qpos[7:]
        return begun

    monkeypatch.setattr(B1Task, "start", bent)
    singles = SyncVectorEnv([lambda: gymnasium.make(B1) for _ in range(2)])
    vector = gymnasium.make_vec(B1, num_envs=2)
    np.testing.assert_array_equal(singles.reset(seed=0)[0], vector.reset(seed=0)[0])
    for action in random_actions(vector, 5):
        np.testing.assert_array_equal(singles.step(action)[0], vector.step(action)[0])


def same_infos(expected, found):
    assert expected.keys() == found.keys()
    for name, value in expected.items():
        if isinstance(value, dict):
            same_infos(value, found[name])
        elif value.dtype == object:
            for one, other in zip(value, found[name]):
                np.testing.assert_array_equal(one, other)
        else:
            np.testing.assert_array_equal(value, found[name], err_msg=name)


def test_episodes_that_terminate_agree_too():
    """A vehicle that only dives leaves its station."""
    arguments = {"seas": 2, "max_episode_steps": 200}
    singles = SyncVectorEnv([lambda: gymnasium.make(ROV, **arguments) for _ in range(3)])
    vector = gymnasium.make_vec(ROV, num_envs=3, **arguments)
    np.testing.assert_array_equal(singles.reset(seed=2)[0], vector.reset(seed=2)[0])
    ends = 0
    action = np.tile(np.float32([0, 0, 0, 0, -1, -1, -1, -1]), (3, 1))
    for _ in range(150):
        *expected, _ = singles.step(action)
        *found, _ = vector.step(action)
        for one, other in zip(expected, found):
            np.testing.assert_array_equal(one, other)
        ends += found[2].sum()
    assert ends >= 3


def test_threads_change_no_bit():
    runs = []
    for threads in (1, 2, 3):
        env = RovStationVectorEnv(6, seas=2, nthread=threads)
        env.reset(seed=0)
        runs.append([env.step(action)[0] for action in random_actions(env, 30)])
    np.testing.assert_array_equal(runs[0], runs[1])
    np.testing.assert_array_equal(runs[0], runs[2])


def test_a_mask_resets_some():
    env = B1SwimVectorEnv(3)
    before, _ = env.reset(seed=0)
    env.step(random_actions(env, 1)[0])
    after, _ = env.reset(seed=[0, 5, 0], options={"reset_mask": np.array([True, False, False])})
    np.testing.assert_array_equal(before[0], after[0])
    assert not np.array_equal(before[1], after[1])


def test_a_step_before_a_reset_is_refused():
    env = B1SwimVectorEnv(2)
    action = np.zeros((2, 12), np.float32)
    with pytest.raises(gymnasium.error.ResetNeeded, match="step before reset"):
        env.step(action)
    env.reset(options={"reset_mask": np.array([True, False])})
    with pytest.raises(gymnasium.error.ResetNeeded, match="step before reset"):
        env.step(action)
    env.reset(seed=np.int64(3))
    env.step(action)


def test_a_simulation_of_the_vector_can_be_drawn():
    env = RovStationVectorEnv(4, seas=2)
    env.reset(seed=0)
    model, data = env.simulation(2)
    assert model.body(1).name == "rov"
    np.testing.assert_array_equal(data.xpos[1], data.qpos[:3])


def test_a_simulation_that_blows_up_ends_with_zeros():
    env = RovStationEnv(seas=1)
    env.reset(seed=0)
    env.data.qvel[:] = 1e200
    observation, reward, terminated, _, _ = env.step(np.zeros(8, np.float32))
    assert terminated
    assert reward == 0
    assert not observation.any()


def test_water_moves_the_vehicle_and_differs_from_sea_to_sea():
    still = RovStationEnv(seas=1, current=0.0, wave_height=0.0)
    assert drift(still) < 0.1
    drifts = [drift(RovStationEnv(seas=1, sea_seed=seed, current=0.5)) for seed in range(4)]
    assert max(drifts) > 1
    assert len(set(np.round(drifts, 3))) == 4


def drift(env, seconds=10):
    """How far the vehicle is carried without thrust, in the horizontal [m]."""
    env.reset(seed=0)
    place = env.data.qpos[:2].copy()
    for _ in range(round(seconds / env.dt)):
        env.step(np.zeros(8, np.float32))
    return float(np.linalg.norm(env.data.qpos[:2] - place))


def test_the_trim_is_near_neutral():
    env = B1SwimEnv()
    env.reset(seed=1)
    depth = env.data.qpos[2]
    for _ in range(750):
        info = env.step(np.zeros(12, np.float32))[-1]
    assert abs(env.data.qpos[2] - depth) < 0.7
    assert info["upright"] > 0.9


def test_the_checkpoint_is_the_one_named(tmp_path):
    env = B1SwimEnv(checkpoint=packaged.checkpoint("b1-task2"))
    assert "b1-task2" in bytes(env.model.plugin_attr).decode()
    actions = random_actions(env, 20)
    np.testing.assert_array_equal(run(env, 0, actions)[0], run(B1SwimEnv(checkpoint="b1-task2"), 0, actions)[0])
    assert not np.array_equal(run(env, 0, actions)[0], run(B1SwimEnv(), 0, actions)[0])


REFUSALS = [
    (lambda: B1SwimEnv(task="fly"), "task is 'fly'; there are: swim, hold, waypoint"),
    (lambda: B1SwimEnv(checkpoint="b1-lost"), "no checkpoint is called `b1-lost`; there are: b1-relaxation, b1-strip"),
    (lambda: RovStationEnv(seas=0), "seas is 0; expected 1 to 1000"),
    (lambda: RovStationEnv(sea_seed=-1), "sea_seed is -1; expected 0 to "),
    (lambda: RovStationEnv(current=float("nan")), "current is nan; expected 0 to 2"),
    (lambda: RovStationEnv(wave_height=3), "wave_height is 3; expected 0 to 1"),
    (lambda: RovStationVectorEnv(0), "num_envs is 0; expected 1 or more"),
    (lambda: RovStationVectorEnv(1, 0), "max_episode_steps is 0; expected 1 or more"),
    (lambda: RovStationVectorEnv(1, seas=1, autoreset_mode="Disabled"), "autoreset_mode is Disabled; expected"),
    (lambda: RovStationVectorEnv(2, seas=1).reset(seed=[1]), "seed: 1 seeds for 2 environments"),
    (
        lambda: RovStationVectorEnv(2, seas=1).reset(options={"reset_mask": np.ones(3, bool)}),
        r"options\['reset_mask'\] is array",
    ),
    (lambda: checked([0.0, np.nan], (2,)), r"action\[1\] is nan; expected a number between -1 and 1"),
    (lambda: checked(np.full((2, 3), np.inf), (2, 3)), r"action\[0, 0\] is inf"),
    (lambda: checked(np.zeros(3), (2,)), r"action: its shape is \(3,\), expected \(2,\)"),
]


@pytest.mark.parametrize(("act", "message"), REFUSALS, ids=[message for _, message in REFUSALS])
def test_refusals(act, message):
    with pytest.raises(DataError, match=message):
        act()


def test_the_picture_is_of_the_present_episode(monkeypatch):
    """Over a change of the sea, which changes model and data."""
    monkeypatch.setenv("MUJOCO_GL", "egl")
    env = gymnasium.make(ROV, seas=3, render_mode="rgb_array", width=160, height=120)
    pictures, models = [], set()
    for seed in range(4):
        env.reset(seed=seed)
        try:
            pictures.append(env.render())
        except (ImportError, AttributeError) as error:
            pytest.skip(f"no EGL: {error}")
        models.add(id(env.unwrapped.model))
    env.close()
    assert len(models) > 1
    for first, second in zip(pictures, pictures[1:]):
        assert first.shape == (120, 160, 3)
        # The vehicle is blue, in the middle, and otherwise turned.
        assert np.ptp(first[40:80, 50:110].astype(int), axis=(0, 1)).min() > 50
        assert (first != second).any(axis=2).mean() > 0.02
