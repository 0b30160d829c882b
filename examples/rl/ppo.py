"""PPO of stable-baselines3 learns to keep station, on a vector environment over `mujoco.batch`.

python examples/rl/ppo.py [STEPS]    (pip install 'hydro-mujoco[rl]')
"""

import sys

import gymnasium
import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv, VecMonitor

import hydro_mujoco.envs  # noqa: F401  (registers the environments)


class Batched(VecEnv):
    """A vector environment of Gymnasium that starts anew in the same step, as stable-baselines3 expects."""

    def __init__(self, name, number, **arguments):
        self.envs = gymnasium.make_vec(name, num_envs=number, autoreset_mode="SameStep", **arguments)
        self.render_mode = None
        super().__init__(number, self.envs.single_observation_space, self.envs.single_action_space)

    def reset(self):
        return self.envs.reset(seed=self._seeds[0])[0]

    def step_async(self, actions):
        self.actions = actions

    def step_wait(self):
        observation, reward, terminated, truncated, info = self.envs.step(self.actions)
        infos = [{} for _ in range(self.num_envs)]
        for row in np.flatnonzero(terminated | truncated):
            cut = bool(truncated[row] and not terminated[row])
            infos[row] = {"terminal_observation": info["final_obs"][row], "TimeLimit.truncated": cut}
        return observation, reward, terminated | truncated, infos

    def get_attr(self, name, indices=None):
        return [getattr(self.envs, name)] * self.num_envs

    def env_is_wrapped(self, wrapper, indices=None):
        return [False] * self.num_envs

    close = set_attr = env_method = lambda self, *args, **kwargs: None


if __name__ == "__main__":
    steps = int(sys.argv[1]) if len(sys.argv) > 1 else 500_000
    envs = VecMonitor(Batched("hydro_mujoco/RovStation-v0", 64))
    policy = {"log_std_init": -1.0, "net_arch": [64, 64]}
    model = PPO("MlpPolicy", envs, n_steps=128, batch_size=1024, policy_kwargs=policy, seed=0, verbose=1).learn(steps)
    # Seas that it has not seen.
    test = VecMonitor(Batched("hydro_mujoco/RovStation-v0", 64, sea_seed=1))
    observation, returns = test.reset(), []
    while len(returns) < 64:
        observation, _, _, infos = test.step(model.predict(observation, deterministic=True)[0])
        returns += [info["episode"]["r"] for info in infos if "episode" in info]
    print(f"return on unseen seas {np.mean(returns):.0f} +- {np.std(returns):.0f}")
