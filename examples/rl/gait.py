"""A random search finds a gait that swims: 256 sines of the B1's thighs and calves, an episode each, half a minute.

python examples/rl/gait.py
"""

import gymnasium
import numpy as np

import hydro_mujoco.envs  # noqa: F401  (registers the environments)

GAITS, STEPS, DT = 256, 750, 0.02
#: Parameter -> least, most: frequency [Hz]; amplitudes and middles of the actions; how far the calves are ahead of the
#: thighs, the hind legs of the forelegs [rad].
BOUNDS = {
    "frequency": (0.5, 2.0),
    "thigh": (0.2, 1.0),
    "calf": (0.2, 1.0),
    "thigh_middle": (-0.6, 0.3),
    "calf_middle": (-0.5, 0.5),
    "calf_lead": (-np.pi, np.pi),
    "hind_lead": (-np.pi, np.pi),
}


def actions(gait, time):
    """Actions, shape (n, 12): left and right legs in opposition."""
    action = np.zeros((GAITS, 12), np.float32)
    for leg, lead in enumerate((0.0, np.pi, gait["hind_lead"], gait["hind_lead"] + np.pi)):
        phase = 2 * np.pi * gait["frequency"] * time + lead
        action[:, 3 * leg + 1] = gait["thigh_middle"] + gait["thigh"] * np.sin(phase)
        action[:, 3 * leg + 2] = gait["calf_middle"] + gait["calf"] * np.sin(phase + gait["calf_lead"])
    return action


if __name__ == "__main__":
    random = np.random.default_rng(0)
    gait = {name: random.uniform(*bounds, GAITS) for name, bounds in BOUNDS.items()}
    envs = gymnasium.make_vec("hydro_mujoco/B1Swim-v0", num_envs=GAITS, task="swim")
    envs.reset(seed=[0] * GAITS)
    alive, total, far = np.ones(GAITS, bool), np.zeros(GAITS), np.zeros(GAITS)
    for step in range(STEPS):
        _, reward, terminated, truncated, info = envs.step(actions(gait, step * DT))
        total += reward * alive
        far += info["forward_speed"] * DT * alive if "forward_speed" in info else 0
        alive &= ~terminated
    best = np.argmax(total)
    print(f"return: median {np.median(total):.0f}, best {total[best]:.0f}, which swims {far[best]:.2f} m in 15 s")
    print(", ".join(f"{name} {values[best]:.2f}" for name, values in gait.items()))
