"""A boat floats at its draught, follows a swell and is driven ashore by the current; a buoy stays on its mooring.

python examples/water/boat.py [FOLDER FOR boat.png]
"""

import scene
from scene import mujoco, np

model, data = scene.load("boat.xml")
height, omega, heading = 0.3, 2 * np.pi / 4.5, np.deg2rad(20)
wavenumber = omega**2 / 9.81


def swell(x, y):
    """Elevation of the waves of boat.xml at the present time [m]."""
    along = x * np.cos(heading) + y * np.sin(heading)
    return 0.5 * height * np.cos(wavenumber * along - omega * data.time)


data.qpos[2] = swell(0, 0) + 0.08
data.qvel[:2] = (
    0.3 + 0.5 * height * omega * np.cos(heading),
    0.5 * height * omega * np.sin(heading),
)  # with the water
times, heave, waves, x, buoy = [], [], [], [], []
grounded = None
while data.time < 90:
    mujoco.mj_step(model, data)
    times.append(data.time)
    heave.append(data.qpos[2])
    waves.append(swell(*data.qpos[:2]))
    x.append(data.qpos[0])
    buoy.append(data.body("buoy").xpos.copy())
    if grounded is None and data.ncon:
        grounded = data.time
    if abs(data.time - 12) < 0.5 * model.opt.timestep:
        scene.picture(model, data, scene.target("boat.png"), swell)
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
scene.picture(model, data, scene.target("boat_ashore.png"), swell)
