"""A BlueROV2 hovers in a current that changes with depth and time, then surfaces and floats.

python examples/water/rov.py [FOLDER FOR rov.png]
"""

import scene
from scene import mujoco, np

model, data = scene.load("rov.xml", rgba=(0.1, 0.35, 0.45, 0.6))
goal = np.array([0.0, 0.0, -2.0])
error = []
while data.time < 80:
    if data.time > 25:
        goal[2] = 0.5  # up, and out
    rotation = data.xmat[1].reshape(3, 3)
    push = rotation.T @ (60 * np.clip(goal - data.qpos[:3], -0.5, 0.5) - 60 * data.qvel[:3])
    yaw = np.arctan2(rotation[1, 0], rotation[0, 0])
    turn = -2 * yaw - 2 * data.qvel[5]
    flat = [
        [1, 1, 1],
        [1, -1, -1],
        [1, -1, 1],
        [1, 1, -1],
    ]  # surge, sway, yaw of the four in the horizontal
    data.ctrl[:4] = [(a * push[0] + b * push[1]) / (4 * 28.3) + c * turn / 20 for a, b, c in flat]
    data.ctrl[4:] = push[2] / 160
    if data.time > 34:
        data.ctrl[:] = 0
    mujoco.mj_step(model, data)
    if 10 < data.time < 25:
        error.append(np.linalg.norm(data.qpos[:3] - goal))
print(f"station kept within {max(error):.3f} m, 15 s in a current of 0.13 m/s and its gusts")
afloat = data.qpos[2]
out = afloat + 0.01 + 0.127
part = 1 - 13.5 / (1000 * 0.013635)
print(f"afloat: {out / 0.254:.3f} of its box above water; by Archimedes {part:.3f}")
scene.picture(model, data, scene.target("rov.png"), distance=2.0, elevation=-14)
