# ---
# jupyter:
#   jupytext:
#     text_representation: {extension: .py, format_name: percent}
#   kernelspec: {display_name: Python 3, language: python, name: python3}
# ---

# %% [markdown]
# # Water for any body in five minutes
#
# A hull floats, drifts with a current and rides waves. Every number is compared with its closed form.
# This page is [a script](https://jupytext.readthedocs.io) that was run when the page was built.

# %%
import os

os.environ.setdefault("MUJOCO_GL", "egl")
import matplotlib.pyplot as plt
import mujoco
import numpy as np

import hydro_mujoco as hydro

# %% [markdown]
# ## A body, and water for it
#
# A box of 2 x 1 x 0.5 m and 400 kg. `add_water` puts an instance of the plugin `hydro.wrench` on the body `hull`:
# buoyancy of the submerged part, added mass [kg, kg m^2], linear drag [N s/m, N m s/rad], quadratic drag [N s^2/m^2,
# N m s^2/rad^2].

# %%
XML = """
<mujoco>
  <option timestep="0.005" integrator="implicitfast"/>
  <asset><texture type="skybox" builtin="gradient" rgb1="0.55 0.75 0.9" rgb2="0.95 0.98 1" width="64" height="64"/></asset>
  <visual><global offwidth="960" offheight="480"/><headlight ambient="0.5 0.5 0.5"/></visual>
  <worldbody>
    <light pos="0 -3 6" dir="0 0.4 -1"/>
    <body name="hull" pos="0 0 0.6">
      <freejoint/>
      <geom type="box" size="1 0.5 0.25" mass="400" rgba="0.85 0.4 0.15 1"/>
    </body>
    <geom type="plane" size="0 0 1" rgba="0.1 0.4 0.6 0.5" contype="0" conaffinity="0"/>
  </worldbody>
</mujoco>
"""
EFFECTS = {
    "hydrostatics": {},
    "added_mass": {"surge": 60, "sway": 150, "heave": 400, "roll": 20, "pitch": 80, "yaw": 40},
    "linear_drag": {"surge": 10, "sway": 40, "heave": 800, "roll": 60, "pitch": 200, "yaw": 20},
    "quadratic_drag": {
        "surge": 150,
        "sway": 400,
        "heave": 900,
        "roll": 60,
        "pitch": 200,
        "yaw": 100,
    },
}


def boat(**water):
    """Model and data of the hull; the arguments are those of `add_water`."""
    spec = hydro.add_water(
        mujoco.MjSpec.from_string(XML), body="hull", effects=EFFECTS, waterline=0, **water
    )
    model = spec.compile()
    return model, mujoco.MjData(model)


def run(model, data, seconds, read):
    """Times, and what `read` gives at each of them."""
    times, rows = [], []
    while data.time < seconds:
        mujoco.mj_step(model, data)
        times.append(data.time)
        rows.append(read(data))
    return np.array(times), np.array(rows)


# %% [markdown]
# ## It falls in and floats
#
# At rest the water lifts what the body weighs, so the draught is mass / (density x area) = 400 / (1000 x 2) = 0.2 m.

# %%
model, data = boat()
time, height = run(model, data, 30, lambda data: data.qpos[2])
draught = 0.25 - height[-1]
print(f"draught {draught:.4f} m, closed form 0.2 m")
print(
    f"the water lifts {hydro.wrench(model, data, 'hull')[2]:.1f} N, the weight is {400 * 9.81:.1f} N"
)
assert abs(draught - 0.2) < 1e-3

figure, axes = plt.subplots(figsize=(8, 2.8), layout="constrained")
axes.plot(time, height - 0.25)
axes.axhline(-0.2, color="0.5", linestyle="--")
axes.set(xlabel="time [s]", ylabel="keel above the surface [m]")
plt.show()

# %% [markdown]
# ## A current takes it along
#
# Drag counts in the velocity relative to the water: the hull ends at the current's speed.

# %%
model, data = boat(current=(0.5, 0, 0))
data.qpos[2] = 0.05
time, speed = run(model, data, 120, lambda data: data.qvel[0])
print(f"speed after 120 s {speed[-1]:.3f} m/s in a current of 0.5 m/s")
assert 0.45 < speed[-1] < 0.5

# %% [markdown]
# ## Waves
#
# A regular wave of 10 s, 156 m long: the hull, small beside it, follows the surface. Waves can also be a JONSWAP or
# Pierson-Moskowitz spectrum.

# %%
model, data = boat(waves=[{"height": 0.6, "period": 10, "direction": 0}])
data.qpos[2] = 0.05
omega = 2 * np.pi / 10
time, state = run(model, data, 60, lambda data: (data.qpos[0], data.qpos[2] - 0.05))
surface = 0.3 * np.cos(omega**2 / 9.81 * state[:, 0] - omega * time)
later = time > 30
print(f"heave over the wave's elevation: {np.polyfit(surface[later], state[later, 1], 1)[0]:.3f}")

figure, axes = plt.subplots(figsize=(8, 2.8), layout="constrained")
axes.plot(time, surface, color="0.6", label="surface")
axes.plot(time, state[:, 1], label="hull")
axes.set(xlabel="time [s]", ylabel="height [m]")
axes.legend()
plt.show()

# %% [markdown]
# ## How it looks

# %%
camera = mujoco.MjvCamera()
camera.lookat[:], camera.distance, camera.azimuth, camera.elevation = data.qpos[:3], 4.5, 125, -12
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
# ## What is wrong is refused
#
# Effects, targets and parameters are checked when the spec is compiled; the message names what was found and what exists.

# %%
try:
    hydro.add_water(mujoco.MjSpec.from_string(XML), body="hul", effects=EFFECTS)
except hydro.DataError as error:
    print(error)

# %% [markdown]
# Next: [all effects](../reference-effects.md), [all attributes](../reference-attributes.md),
# [how right it is](../water-without-a-network.md#how-right-it-is), [a learned B1](b1.py).
