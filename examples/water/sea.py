"""The boat of boat.xml in a sea of 200 components, filmed; the surface drawn is the one that floats it.

python examples/water/sea.py [FOLDER FOR sea.webp]
"""

import json
from time import perf_counter

import scene
from scene import mujoco, np, sea

SEA = {"spectrum": "jonswap", "significant_height": 0.5, "peak_period": 4, "direction": 20, "spreading": 8, "seed": 3}
FRAMES, RATE = 48, 12

spec = mujoco.MjSpec.from_file(str(scene.HERE / "boat.xml"))
for water in spec.plugins:
    waves = json.dumps({"schema": "hydro-waves/1", "components": 200, **SEA})
    water.config = {**water.config, "waves": waves}
model = sea.add_surface(spec, cells=256).compile()
data = mujoco.MjData(model)
surface = sea.Surface(model, "boat")
data.qpos[2] = surface.water.level(0, 0, 0) + 0.08
while data.time < 4:
    mujoco.mj_step(model, data)

camera, option = mujoco.MjvCamera(), mujoco.MjvOption()
camera.distance, camera.azimuth, camera.elevation = 13, 120, -13
option.flags[mujoco.mjtVisFlag.mjVIS_PERTOBJ] = 0
pictures, seconds, gaps = [], {"update": [], "render": []}, []
with mujoco.Renderer(model, 270, 480) as renderer:
    for frame in range(FRAMES):
        while data.time < 4 + frame / RATE:
            mujoco.mj_step(model, data)
        mujoco.mj_forward(model, data)
        start = perf_counter()
        surface.update(data)
        seconds["update"].append(perf_counter() - start)
        camera.lookat[:] = *data.body("boat").xpos[:2], 0
        renderer.update_scene(data, camera, option)
        pictures.append(renderer.render())
        seconds["render"].append(perf_counter() - start - seconds["update"][-1])
        x, y, z = data.body("boat").xpos
        gaps.append(z - float(surface.water.level(x, y, data.time)))
rates = {name: 1 / np.median(each) for name, each in seconds.items()}
print(f"{model.nskinvert} vertices of 200 waves: {rates['update']:.0f} a second; render {rates['render']:.1f} a second")
print(f"the boat's origin stays {np.min(gaps):.2f} to {np.max(gaps):.2f} m above the drawn surface")
try:
    from PIL import Image

    first, *others = map(Image.fromarray, pictures)
    out = scene.target("sea.webp")
    first.save(out, save_all=True, append_images=others, duration=1000 // RATE, loop=0, quality=60, method=6)
except ImportError:
    print("no picture: pip install hydro-mujoco[examples]")
