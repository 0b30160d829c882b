"""Steps a second of the Gymnasium environments, one and many at once.

    python scripts/bench_envs.py [--rounds 9] [--envs 64] [--threads 1 2]

Random actions, episodes that end start anew. Rows of an environment are timed in turn, rounds times; printed are
medians
with quartiles and the median ratio to one environment.
The last table: what a reset costs, and what it would cost to compile the sea of the episode.
"""

import argparse
import time
from collections.abc import Callable

import gymnasium
import mujoco
import numpy as np
from gymnasium.vector import SyncVectorEnv

import hydro_mujoco.envs  # noqa: F401
from hydro_mujoco import packaged
from hydro_mujoco.envs.seas import draw_seas

#: Environment -> arguments.
ENVIRONMENTS = {
    "hydro_mujoco/B1Swim-v0": {"task": "swim"},
    "hydro_mujoco/RovStation-v0": {},
}


def one(name: str, steps: int) -> Callable[[], float]:
    """Seconds a step of one environment."""
    env = gymnasium.make(name, **ENVIRONMENTS[name])
    actions = np.random.default_rng(0).uniform(-1, 1, (steps, *env.action_space.shape)).astype(np.float32)
    env.reset(seed=0)

    def run() -> float:
        start = time.perf_counter()
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()
        return (time.perf_counter() - start) / steps

    return run


def physics(name: str, steps: int) -> Callable[[], float]:
    """Seconds a step of MuJoCo with the plugin alone, from the environment's start with its controls held."""
    env = gymnasium.make(name, **ENVIRONMENTS[name]).unwrapped
    env.reset(seed=0)
    first = np.empty(mujoco.mj_stateSize(env.model, mujoco.mjtState.mjSTATE_INTEGRATION))
    mujoco.mj_getState(env.model, env.data, first, mujoco.mjtState.mjSTATE_INTEGRATION)

    def run() -> float:
        mujoco.mj_setState(env.model, env.data, first, mujoco.mjtState.mjSTATE_INTEGRATION)
        start = time.perf_counter()
        for _ in range(steps):
            mujoco.mj_step(env.model, env.data, env.frame_skip)
        return (time.perf_counter() - start) / steps

    return run


def many(name: str, number: int, steps: int, threads: int | None) -> Callable[[], float]:
    """Seconds a step of an environment among many; threads: None: in `SyncVectorEnv`."""
    arguments = ENVIRONMENTS[name]
    if threads is None:
        envs = SyncVectorEnv([lambda: gymnasium.make(name, **arguments) for _ in range(number)])
    else:
        envs = gymnasium.make_vec(name, num_envs=number, nthread=threads, **arguments)
    actions = np.random.default_rng(0).uniform(-1, 1, (steps, *envs.action_space.shape)).astype(np.float32)
    envs.reset(seed=0)

    def run() -> float:
        start = time.perf_counter()
        for action in actions:
            envs.step(action)
        return (time.perf_counter() - start) / steps / number

    return run


def table(name: str, rounds: int, number: int, threads: list[int]) -> list[str]:
    """Rows of one environment, in Markdown."""
    steps = max(20, 2000 // number)
    runs = {
        "MuJoCo with the plugin alone": physics(name, 500),
        "`gymnasium.make`": one(name, 500),
        f"`SyncVectorEnv`, {number}": many(name, number, steps, None),
    }
    for count in threads:
        label = f"`make_vec`, {number}, {count} thread{'s' if count > 1 else ''}"
        runs[label] = many(name, number, steps, count)
    seconds = {label: [] for label in runs}
    for run in runs.values():
        run()
    for _ in range(rounds):
        for label, run in runs.items():
            seconds[label].append(run())
    single = np.array(seconds["`gymnasium.make`"])
    rows = [f"| {name.split('/')[1]} | steps a second | times one environment |", "|---|---|---|"]
    for label, taken in seconds.items():
        least, median, most = np.quantile(1 / np.array(taken), [0.25, 0.5, 0.75])
        ratio = np.median(single / np.array(taken))
        rows.append(f"| {label} | {median:,.0f} ({least:,.0f} to {most:,.0f}) | {ratio:.2f} |")
    return rows


def resets(rounds: int) -> list[str]:
    """What a reset costs, and compiling a sea."""
    rows = ["| | ms (median) |", "|---|---|"]
    for name, arguments in ENVIRONMENTS.items():
        env = gymnasium.make(name, **arguments)
        env.reset(seed=0)
        rows.append(f"| reset of {name.split('/')[1]} | {_milliseconds(env.reset, 20 * rounds):.2f} |")
    spec = mujoco.MjSpec.from_file(packaged.scene("rov"))
    sea = draw_seas(1, 0, 0.5, 0.4)[0]
    spec.plugins[0].config = {**spec.plugins[0].config, "current": sea.current, "waves": sea.waves}
    model = spec.compile()
    rows.append(f"| compile RovStation's model with another sea | {_milliseconds(spec.compile, 5 * rounds):.2f} |")
    rows.append(f"| make its MjData | {_milliseconds(lambda: mujoco.MjData(model), 5 * rounds):.2f} |")
    return rows


def _milliseconds(act: Callable[[], object], times: int) -> float:
    taken = []
    for _ in range(times):
        start = time.perf_counter()
        act()
        taken.append(time.perf_counter() - start)
    return 1e3 * float(np.median(taken))


def main() -> int:
    """Print the tables; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=9, help="times each row is timed, in turn")
    parser.add_argument("--envs", type=int, default=64, help="environments of a vector environment")
    parser.add_argument("--threads", type=int, nargs="+", default=[1, 2], help="threads of mujoco.batch")
    args = parser.parse_args()
    for name in ENVIRONMENTS:
        print("\n".join([*table(name, args.rounds, args.envs, args.threads), ""]))
    print("\n".join(resets(args.rounds)))
    return 0
