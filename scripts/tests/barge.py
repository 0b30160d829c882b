"""A barge whose nominal model has drag and no hydrostatics; its truth integrates wet columns of the box in NumPy."""

import json
from pathlib import Path

import mujoco
import numpy as np

AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
#: Drag of the submerged hull [N s/m], [N m s/rad].
DRAG = np.array([60.0, 150, 700, 60, 250, 150])
HALF, MASS, RHO, G = np.array([1.0, 0.5, 0.25]), 400.0, 1000.0, 9.81
#: Measurement noise of pos, quat, gyro, vel.
NOISE = np.repeat([0.004, 0.002, 0.003, 0.005], [3, 4, 3, 3])
COLUMNS = [f"{name}[{i}]" for name, n in (("pos", 3), ("quat", 4), ("gyro", 3), ("vel", 3)) for i in range(n)]
STEP, ROW = 0.001, 20


def scene(effects: list | None) -> str:
    """The MJCF with these effects; None: without water."""
    extension = plugin = ""
    if effects is not None:
        text = json.dumps({"schema": "hydro-effects/1", "effects": effects})
        extension = f"""<extension><plugin plugin="hydro.wrench"><instance name="water">
          <config key="waterline" value="0"/><config key="effects" value='{text}'/></instance></plugin></extension>"""
        plugin = '<plugin plugin="hydro.wrench" instance="water"/>'
    return f"""
<mujoco><option timestep="0.005" integrator="implicitfast"/>{extension}
  <worldbody><body name="hull" pos="0 0 0.05"><freejoint name="free"/>{plugin}
    <geom name="box" type="box" size="1 0.5 0.25" mass="{MASS}"/>
    <site name="s"/><site name="port" pos="-1 0.4 -0.1"/><site name="starboard" pos="-1 -0.4 -0.1"/><body name="room"/>
  </body></worldbody>
  <actuator>
    <motor name="port" site="port" gear="1 0 0 0 0 0" ctrlrange="-300 300"/>
    <motor name="starboard" site="starboard" gear="1 0 0 0 0 0" ctrlrange="-300 300"/>
    <motor name="heel" site="s" gear="0 0 -1 0.3 0.2 0" ctrlrange="-600 600"/>
  </actuator>
  <sensor>
    <framepos name="pos" objtype="site" objname="s" noise="0.004"/>
    <framequat name="quat" objtype="site" objname="s" noise="0.002"/>
    <gyro name="gyro" site="s" noise="0.003"/><velocimeter name="vel" site="s" noise="0.005"/>
  </sensor></mujoco>"""


def columns():
    """Places across the box [n, 2] m and areas [n] m^2 of columns whose sum is exact for polynomials."""
    (x, of_x), (y, of_y) = (np.polynomial.legendre.leggauss(n) for n in (10, 8))
    places = np.array([[HALF[0] * a, HALF[1] * b] for a in x for b in y])
    return places, np.array([a * b for a in of_x for b in of_y]) * HALF[0] * HALF[1]


PLACES, AREAS = columns()


def water(model, data) -> np.ndarray:
    """Force [N] and torque [N m] of the water about the centre of mass, in the world."""
    turn, origin = data.xmat[1].reshape(3, 3), data.xpos[1]
    above = origin[2] + PLACES @ turn[2, :2]
    top = np.clip(-above / turn[2, 2], -HALF[2], HALF[2])
    wet = top + HALF[2]
    volume = AREAS @ wet
    moments = [AREAS @ (wet * PLACES[:, 0]), AREAS @ (wet * PLACES[:, 1]), AREAS @ (wet * 0.5 * (top - HALF[2]))]
    force = np.array([0, 0, RHO * G * volume])
    torque = np.cross(origin + turn @ (np.array(moments) / max(volume, 1e-9)) - data.xipos[1], force)
    velocity = np.zeros(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, 1, velocity, 1)
    drag = -volume / (8 * HALF.prod()) * DRAG * np.roll(velocity, 3)
    return np.concatenate([force + turn @ drag[:3], torque + turn @ drag[3:]])


def trial(seed: int, duration: float) -> np.ndarray:
    """Rows of time, commands and readings of one run."""
    random = np.random.default_rng(seed)
    model = mujoco.MjModel.from_xml_string(scene(None))
    model.opt.timestep = STEP
    model.body_mass[1] *= 1.01
    model.body_inertia[1] *= [1.01, 0.99, 1.01]
    data = mujoco.MjData(model)
    data.qpos[2] += random.uniform(-0.05, 0.05)
    mujoco.mju_euler2Quat(data.qpos[3:7], random.uniform([-0.1, -0.05, -1], [0.1, 0.05, 1]), "XYZ")
    rate, phase = random.uniform(0.5, 3, (3, 3)), random.uniform(0, 6, (3, 3))
    push = np.array([75.0, 75, 200])[:, None]
    rows = []
    for k in range(round(duration / STEP)):
        time = k * STEP
        data.ctrl[:] = np.clip((push * np.sin(rate * time + phase)).sum(1), *model.actuator_ctrlrange.T)
        mujoco.mj_forward(model, data)
        if k % ROW == 0:
            readings = data.sensordata + NOISE * random.normal(size=NOISE.size)
            # A row holds the readings at the start of the step that ends at its time.
            rows.append(np.concatenate([[time + 0.005], data.ctrl, readings]))
        data.xfrc_applied[1] = water(model, data)
        mujoco.mj_step(model, data)
    return np.array(rows)


def make(folder: Path, trials: int, duration: float, seed: int) -> None:
    """Write nominal.xml and trials/."""
    (folder / "trials").mkdir(parents=True)
    drag = {"effect": "linear_drag", "target": "hull", "parameters": dict(zip(AXES, DRAG.tolist()))}
    (folder / "nominal.xml").write_text(scene([drag]))
    header = ",".join(["time", "port", "starboard", "heel", *COLUMNS])
    for k in range(trials):
        rows = trial(1000 * seed + k, duration)
        np.savetxt(folder / "trials" / f"t{k}.csv", rows, delimiter=",", header=header, comments="")
