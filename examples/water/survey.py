"""A BlueROV2 surveys a wreck: dead reckoning by DVL, fixes by USBL, a map by multibeam, pictures by camera and sonar.

python examples/water/survey.py [FOLDER FOR survey.png]
"""

import scene
from hydro_mujoco.sensors import Dvl, ImagingSonar, Multibeam, Pressure, UnderwaterCamera, Usbl
from scene import mujoco, np, sea

LENGTH, WIDTH, CELLS = 60, 30, 128
spec = mujoco.MjSpec.from_file(str(scene.HERE / "rov.xml"))
sea.add_surface(spec, cell=0.2, cells=128, rgba=(0.1, 0.35, 0.45, 0.6))
x, y = np.meshgrid(np.linspace(0, 1, CELLS), np.linspace(0, 1, CELLS))
sand = 0.5 + 0.2 * np.sin(9 * x + 4 * y) + 0.15 * np.sin(23 * x - 11 * y) + 0.05 * np.sin(160 * x + 30 * y)
spec.add_hfield(name="sand", nrow=CELLS, ncol=CELLS, size=[LENGTH / 2, WIDTH / 2, 2, 1], userdata=sand.ravel())
sand = {"type": mujoco.mjtGeom.mjGEOM_HFIELD, "hfieldname": "sand", "rgba": [0.76, 0.7, 0.5, 1]}
spec.worldbody.add_geom(pos=[25, 0, -9], **sand)
hull = {"type": mujoco.mjtGeom.mjGEOM_CAPSULE, "size": [1.0, 0, 0], "rgba": [0.4, 0.25, 0.2, 1]}
spec.worldbody.add_geom(fromto=[22, -3, -7.5, 28, 2, -7.2], **hull)
spec.worldbody.add_geom(fromto=[25, -0.5, -7, 25.3, -0.3, -4.5], **(hull | {"size": [0.12, 0, 0]}))
spec.worldbody.add_site(name="ship", pos=[0, 8, -1])
rov = spec.body("rov")
rov.add_site(name="keel", pos=[0, 0, -0.12])
rov.add_site(name="bow", pos=[0.2, 0, 0], quat=[np.cos(0.15), 0, np.sin(0.15), 0])  # 17 degrees down
rov.add_camera(name="chase", pos=[-1.8, 0.0, 0.9], quat=[0.59, 0.4, -0.4, -0.59])  # ahead and down
model = spec.compile()
data = mujoco.MjData(model)
dvl, depth, usbl = Dvl(model, "keel", seed=1), Pressure(model, "keel", seed=1), Usbl(model, "ship", "keel", seed=1)
multibeam, sonar = Multibeam(model, "keel", swath=130, seed=1), ImagingSonar(model, "bow", height=30, rays=192, seed=1)

errors, found, image, reckoned = {"dvl": [], "usbl": [], "depth": []}, [], None, None
while data.time < 60:
    rotation = data.body("rov").xmat.reshape(3, 3)
    yaw = np.arctan2(rotation[1, 0], rotation[0, 0])
    want = np.array([0.8, -0.5 * data.qpos[1], 1.0 * (-4.0 - data.qpos[2])])
    push, turn = 180 * (rotation.T @ (want - data.qvel[:3])), -4 * yaw - 4 * data.qvel[5]
    flat = np.array([[1, 1, 1], [1, -1, -1], [1, -1, 1], [1, 1, -1]])  # surge, sway, yaw
    data.ctrl[:4] = flat @ [push[0] / 113.2, push[1] / 113.2, turn / 20]
    level = np.array([-rotation[2, 1], rotation[2, 0]]) - 0.3 * data.qvel[3:5]
    data.ctrl[4:] = push[2] / 160 + 3 * np.array([[-1, -1], [1, -1], [-1, 1], [1, 1]]) @ level
    mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    keel, axes = data.site("keel").xpos.copy(), data.site("keel").xmat.reshape(3, 3)
    if (fix := usbl.poll(data)) is not None:
        errors["usbl"].append(np.linalg.norm(data.site("ship").xpos + fix.position - keel))
    if round(data.time / model.opt.timestep) % 40 == 0:  # 5 Hz
        reckoned = keel.copy() if reckoned is None else reckoned + 0.2 * axes @ dvl.read(data).bottom
        errors["dvl"].append(np.linalg.norm((reckoned - keel)[:2]))
        errors["depth"].append(depth.read(data).depth + keel[2])
        points = multibeam.read(data).points
        found.append(keel + points[np.isfinite(points[:, 0])] @ axes.T)
    if image is None and data.qpos[0] > 17:
        image = sonar.read(data)
        view = UnderwaterCamera(model, "chase", width=960, height=540).read(data)
print(f"after {data.qpos[0]:.0f} m: dead reckoning by DVL is off by {errors['dvl'][-1]:.2f} m")
print(f"{len(errors['usbl'])} fixes by USBL, off by {np.mean(errors['usbl']):.2f} m on average")
millimetres = 1000 * np.array(errors["depth"])
print(f"depth by pressure: off by {millimetres.mean():.0f} mm, scatter {millimetres.std():.0f} mm")
scene.survey_picture(view, image.intensity, image.bearings, np.concatenate(found), scene.target("survey.png"))
