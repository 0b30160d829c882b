"""PPO of stable-baselines3 learns to swim the B1 in learned water, on 64 environments over `mujoco.batch`.

python examples/rl/ppo_b1.py [STEPS]    (pip install 'hydro-mujoco[rl]')
"""

import sys

import numpy as np
from ppo import Batched
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecMonitor

ROBOTS = 64


def trained(steps, robots=ROBOTS, rounds=64, **options):
    """PPO after so many steps of the environments, `rounds` of each between two updates."""
    envs = VecMonitor(Batched("hydro_mujoco/B1Swim-v0", robots, task="swim"))
    policy = {"log_std_init": -1.0, "net_arch": [128, 128]}
    batch = min(1024, robots * rounds)
    return PPO(
        "MlpPolicy", envs, n_steps=rounds, batch_size=batch, policy_kwargs=policy, gamma=0.995, seed=0, **options
    ).learn(steps)


def judged(model, robots=ROBOTS, steps=750):
    """Return, way ahead [m] and steps of an episode of each robot, as the policy acts without noise."""
    envs = Batched("hydro_mujoco/B1Swim-v0", robots, task="swim")
    envs.seed(1000)
    observation, alive = envs.reset(), np.ones(robots, bool)
    total, ahead, lasted = np.zeros(robots), np.zeros(robots), np.zeros(robots)
    for _ in range(steps):
        # The goal's x axis in the trunk's, and the velocity there: the speed ahead.
        ahead += alive * np.sum(observation[:, 6:9] * observation[:, 48:51], axis=1) * 0.02
        observation, reward, done, _ = envs.step(model.predict(observation, deterministic=True)[0])
        total, lasted, alive = total + alive * reward, lasted + alive, alive & ~done
    return total, ahead, lasted


if __name__ == "__main__":
    steps = int(sys.argv[1]) if len(sys.argv) > 1 else 2_000_000
    total, ahead, lasted = judged(trained(steps, verbose=1))
    ended = f"{lasted.mean() * 0.02:.1f} s until an end, {(lasted == 750).sum()} of {ROBOTS} to the last"
    print(f"return {total.mean():.0f} +- {total.std():.0f}, {ahead.mean():.2f} m ahead, {ended}")
