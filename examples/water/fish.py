"""A fish of four links swims: a travelling wave of its servos, the water on every link.

python examples/water/fish.py [FOLDER FOR fish.png]
"""

import scene
from scene import mujoco, np

model, data = scene.load("fish.xml", rgba=(0.1, 0.35, 0.45, 0.6))
amplitude, lag, frequency = np.array([0.10, 0.30, 0.55]), np.array([0.0, 1.0, 2.0]), 2.0
track = []
while data.time < 15:
    ramp = min(data.time, 1.0)
    data.ctrl[:] = ramp * amplitude * np.sin(2 * np.pi * frequency * data.time - lag)
    mujoco.mj_step(model, data)
    track.append(data.qpos[:3].copy())
track = np.array(track)
second = round(1 / model.opt.timestep)
speed = np.linalg.norm(track[-1, :2] - track[-5 * second, :2]) / 5
print(f"speed {speed:.2f} m/s, {speed / 0.5:.1f} body lengths a second; depth changed by {track[-1, 2] + 0.5:+.3f} m")
scene.picture(model, data, scene.target("fish.png"), distance=1.0, elevation=-18)
