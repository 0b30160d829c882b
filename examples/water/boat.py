"""A boat floats at its draught, rolls, follows a swell and is driven ashore; a buoy stays on its mooring.

python examples/water/boat.py [FOLDER FOR boat.png]
"""

import scene
from scene import mujoco, np, sea

# In still water: its draught, and its roll after a heel of 2 degrees.
model, data = scene.load("boat.xml", still=True)
mujoco.mj_step(model, data, 6000)
hull = model.geom("hull").id
corners = data.geom_xpos[hull] + model.mesh_vert[: model.mesh_vertnum[0]] @ data.geom_xmat[hull].reshape(3, 3).T
mujoco.mju_mulQuat(data.qpos[3:7], data.qpos[3:7].copy(), [np.cos(0.0175), np.sin(0.0175), 0, 0])
heel, up = [], []
while len(up) < 6:
    mujoco.mj_step(model, data)
    heel.append(data.body("boat").xmat[7])
    if len(heel) > 1 and heel[-2] < 0 <= heel[-1]:
        up.append(data.time - model.opt.timestep * heel[-1] / (heel[-1] - heel[-2]))
print(f"draught {-corners[:, 2].min():.3f} m, period of roll {np.diff(up).mean():.2f} s")

model, data = scene.load("boat.xml")
water = sea.water(model, "boat")
height = 2 * water.waves.amplitude[0]

data.qpos[2] = water.level(0, 0, data.time) + 0.08
data.qvel[:2] = water.velocity((0, 0, 0), data)[:2]  # with the water
times, heave, waves, x, buoy = [], [], [], [], []
grounded = None
while data.time < 90:
    mujoco.mj_step(model, data)
    times.append(data.time)
    heave.append(data.qpos[2])
    waves.append(water.level(*data.qpos[:2], data.time))
    x.append(data.qpos[0])
    buoy.append(data.body("buoy").xpos.copy())
    if grounded is None and data.ncon:
        grounded = data.time
    if abs(data.time - 12) < 0.5 * model.opt.timestep:
        scene.picture(model, data, scene.target("boat.png"))
times, heave, waves = np.array(times), np.array(heave), np.array(waves)
afloat = (times > 5) & (times < (grounded or 90))
follow = np.polyfit(waves[afloat], heave[afloat], 1)[0]
print(f"follows the swell: heave = {follow:.2f} of the wave's elevation (1 for a small boat)")
drift = np.polyfit(times[afloat], np.array(x)[afloat], 1)[0]
print(f"drift {drift:.2f} m/s in a current of 0.30 m/s")
buoy = np.array(buoy)[times > 20]
print(
    f"the buoy moves by {np.ptp(buoy[:, 2]):.2f} m up and down in waves of {height} m, {np.ptp(buoy[:, 0]):.1f} m along, on its mooring"
)
print(f"aground after {grounded:.0f} s" if grounded else "not aground")
scene.picture(model, data, scene.target("boat_ashore.png"))
