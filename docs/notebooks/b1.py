# ---
# jupyter:
#   jupytext:
#     text_representation: {extension: .py, format_name: percent}
#   kernelspec: {display_name: Python 3, language: python, name: python3}
# ---

# %% [markdown]
# # A learned B1
#
# A quadruped swims in water that a network has learned: the released checkpoint `b1-relaxation` inside MuJoCo.

# %%
import json
import os

os.environ.setdefault("MUJOCO_GL", "egl")
import matplotlib.pyplot as plt
import mujoco
import numpy as np

import hydro_mujoco as hydro
from hydro_mujoco.plugin import load_plugin

load_plugin()  # in a checkout; that of an installed wheel is loaded by `import mujoco`

# %% [markdown]
# ## Load the scene, name the checkpoint
#
# The scene `b1_swim` carries an instance of `hydro.wrench` on the trunk. Its attribute `checkpoint` takes a folder, or the
# name of a released one. B1 weighs 62.58 kg and displaces 58 L: a named effect beside the checkpoint, the lift of some foam,
# trims it.

# %%
spec = mujoco.MjSpec.from_file(hydro.scene("b1_swim"))
water = spec.plugins[0]
foam = {"effect": "net_buoyancy", "target": "trunk", "parameters": {"force": (62.58 - 58) * 9.81}}
water.config = {
    **water.config,
    "checkpoint": hydro.checkpoint("b1-relaxation"),
    "effects": json.dumps({"schema": "hydro-effects/1", "effects": [foam]}),
}
model = spec.compile()
data = mujoco.MjData(model)
mujoco.mj_resetDataKeyframe(model, data, 0)  # the pose `home`
print(
    f"{model.nu} servos, {sum(model.body_mass):.2f} kg, {model.npluginstate} numbers of memory in the plugin's state"
)

# %% [markdown]
# ## Paddle
#
# Thighs and calves swing by sines, left and right legs in opposition, ramped up over a second. The network is asked every
# 10 ms; its memory is MuJoCo's plugin state, so copies and restored states go on with the same bits.

# %%
home = model.key_ctrl[0].reshape(4, 3)
lead = np.array([0, np.pi, -0.25, np.pi - 0.25])  # FR, FL, RR, RL [rad]
times, forces, places = [], [], []
while data.time < 10:
    phase = 2 * np.pi * 1.5 * data.time + lead
    swing = np.zeros((4, 3))
    swing[:, 1] = -0.06 + 0.32 * np.sin(phase)
    swing[:, 2] = -0.37 + 0.63 * np.sin(phase + 1.42)
    data.ctrl[:] = (home + min(data.time, 1) * swing).ravel()
    mujoco.mj_step(model, data)
    times.append(data.time)
    forces.append(data.sensor("water_wrench").data[:3].copy())
    places.append(data.qpos[:3].copy())
times, forces, places = map(np.array, (times, forces, places))
print(f"after 10 s: {np.linalg.norm(places[-1, :2]):.2f} m away, {places[-1, 2]:+.2f} m of depth")

figure, axes = plt.subplots(2, 1, figsize=(8, 4.5), sharex=True, layout="constrained")
axes[0].plot(times, forces, label=["x", "y", "z"])
axes[0].set(ylabel="force on the trunk [N]")
axes[0].legend(loc="lower right")
axes[1].plot(times, places, label=["x", "y", "z"])
axes[1].set(xlabel="time [s]", ylabel="position [m]")
plt.show()

# %%
camera = mujoco.MjvCamera()
camera.lookat[:], camera.distance, camera.azimuth, camera.elevation = data.qpos[:3], 3.0, 130, -18
option = mujoco.MjvOption()
option.flags[mujoco.mjtVisFlag.mjVIS_PERTOBJ] = False  # without the arrows of force and torque
with mujoco.Renderer(model, 480, 960) as renderer:
    renderer.update_scene(data, camera, option)
    picture = renderer.render()
figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
axes.imshow(picture)
axes.axis("off")
plt.show()

# %% [markdown]
# ## Copies repeat bit for bit

# %%
state = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_INTEGRATION))
mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
mujoco.mj_step(model, data, 500)
first = data.qpos.copy()
mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
mujoco.mj_step(model, data, 500)
print("the same bits:", np.array_equal(first, data.qpos))
assert np.array_equal(first, data.qpos)

# %% [markdown]
# ## As a Gymnasium environment
#
# Trimmed to near neutral, with tasks to swim, hold and go to a waypoint: [envs](../envs.md).

# %%
import gymnasium

import hydro_mujoco.envs

env = gymnasium.make("hydro_mujoco/B1Swim-v0", task="swim")
observation, _ = env.reset(seed=0)
print("observation", env.observation_space.shape, "action", env.action_space.shape)
total = sum(env.step(env.action_space.sample())[1] for _ in range(50))
print(f"a second of random actions: return {total:.1f}")

# %% [markdown]
# Next: [a force model of your own robot](../any-robot.md), [how well it was learned](../experiments.md),
# [all attributes](../reference-attributes.md).
