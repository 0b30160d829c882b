"""Filmed side by side: a BlueROV2 comes up and floats, and a boat that was heeled rolls freely in still water.

python examples/water/afloat.py [FOLDER FOR afloat.webp]
"""

import scene
from scene import mujoco, np, sea

FRAMES, RATE, HEEL = 84, 12, np.radians(18)


class Shot:
    """A model, and a camera that keeps its height and follows the first body."""

    def __init__(self, name, body, distance, elevation, **look):
        self.model, self.data = scene.load(name, cells=64, **look)
        self.body = self.data.body(body)
        self.surface = sea.Surface(self.model, body)
        self.renderer = mujoco.Renderer(self.model, 240, 320)
        self.camera, self.option = mujoco.MjvCamera(), mujoco.MjvOption()
        self.camera.distance, self.camera.azimuth, self.camera.elevation = distance, 120, elevation
        self.option.flags[mujoco.mjtVisFlag.mjVIS_PERTOBJ] = 0

    def frame(self, time, height):
        while self.data.time < time:
            mujoco.mj_step(self.model, self.data)
        mujoco.mj_forward(self.model, self.data)
        self.surface.update(self.data)
        self.camera.lookat[:] = *self.body.xpos[:2], height
        self.renderer.update_scene(self.data, self.camera, self.option)
        return self.renderer.render()


rov = Shot("rov.xml", "rov", 2.6, -9, rgba=(0.1, 0.35, 0.45, 0.6))
boat = Shot("boat.xml", "boat", 8, -10, still=True)
rov.data.qpos[2] = -1.0
boat.data.qpos[2] = 0.0774
boat.data.qpos[3:7] = np.cos(HEEL / 2), np.sin(HEEL / 2), 0, 0
pictures, heights, heels = [], [], []
for k in range(FRAMES):
    rov.data.ctrl[4:] = 0.15 if rov.data.qpos[2] < -0.3 else 0
    pictures.append(np.hstack([rov.frame(k / RATE, -0.25), boat.frame(k / RATE, 0.3)]))
    heights.append(rov.body.xpos[2])
    heels.append(np.degrees(np.arctan2(boat.body.xmat[7], boat.body.xmat[8])))
print(f"the ROV comes up from {heights[0]:.2f} m to {heights[-1]:.3f} m")
last = np.max(np.abs(heels[-RATE:]))
print(
    f"the boat rolls from {heels[0]:.0f} degrees to {np.min(heels):.0f}, and by {last:.1f} after {FRAMES / RATE:.0f} s"
)
try:
    from PIL import Image

    first, *others = map(Image.fromarray, pictures)
    out = scene.target("afloat.webp")
    first.save(out, save_all=True, append_images=others, duration=1000 // RATE, loop=0, quality=60, method=6)
except ImportError:
    print("no picture: pip install hydro-mujoco[examples]")
