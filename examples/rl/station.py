"""A proportional-derivative controller keeps a BlueROV2 on its station, beside random commands.

python examples/rl/station.py
"""

import gymnasium
import numpy as np

import hydro_mujoco.envs  # noqa: F401  (registers the environments)

#: Surge, sway and yaw of the four thrusters in the horizontal; roll and pitch of the four along z.
FLAT = np.array([[1, 1, 1], [1, -1, -1], [1, -1, 1], [1, 1, -1]])
UP = np.array([[-1, -1], [1, -1], [-1, 1], [1, 1]])
EPISODES, SETTLED = 64, 200


def pd(observation):
    """Commands, shape (n, 8), for observations, shape (n, 23)."""
    offset, face, vertical = observation[:, 0:3], observation[:, 3:6], observation[:, 6:9]
    velocity, rate = observation[:, 9:12], observation[:, 12:15]
    push = 300 * offset - 80 * velocity
    yaw = np.arctan2(face[:, 1], face[:, 0]) - 0.5 * rate[:, 2]
    level = np.stack([-vertical[:, 1], vertical[:, 0]], axis=1) - 0.3 * rate[:, :2]
    flat = np.column_stack([push[:, :2] / (4 * 28.3), 0.3 * yaw]) @ FLAT.T
    return np.clip(np.hstack([flat, push[:, 2:] / 160 + 0.3 * level @ UP.T]), -1, 1).astype(np.float32)


def play(name, command):
    """Play an episode of each environment; prints what came of it."""
    # Seas that a policy trained with sea_seed=0 has not seen.
    envs = gymnasium.make_vec("hydro_mujoco/RovStation-v0", num_envs=EPISODES, sea_seed=1)
    observation, _ = envs.reset(seed=0)
    alive, total, distances = np.ones(EPISODES, bool), np.zeros(EPISODES), []
    for step in range(600):
        observation, reward, terminated, truncated, info = envs.step(command(observation))
        total += reward * alive
        if step >= SETTLED:
            distances.append(np.where(alive, info.get("distance", np.nan), np.nan))
        alive &= ~terminated
    kept = np.array(distances)[:, alive]
    print(f"{name:9} return {total.mean():4.0f} +- {total.std():3.0f}, {alive.sum()} of {EPISODES} kept to the end")
    if alive.any():
        worst = kept.max(axis=0)
        print(
            f"          from 10 s on within {np.median(worst):.2f} m (median of episodes), {worst.max():.2f} m (worst)"
        )
    envs.close()


if __name__ == "__main__":
    random = np.random.default_rng(0)
    play("random", lambda observation: random.uniform(-1, 1, (EPISODES, 8)).astype(np.float32))
    play("no thrust", lambda observation: np.zeros((EPISODES, 8), np.float32))
    play("PD", pd)
