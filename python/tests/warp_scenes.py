"""The plugin and MuJoCo Warp side by side, for the tests of hydro_mujoco.warp."""

import html
import json

import mujoco
import numpy as np
import pytest

import models

mjw = pytest.importorskip("mujoco_warp")
wp = pytest.importorskip("warp")
# Kernels are compiled in a third of the time.
wp.config.optimization_level = 0
wp.config.quiet = True

import hydro_mujoco as hydro  # noqa: E402
from hydro_mujoco import warp as water  # noqa: E402
from hydro_mujoco.plugin import load_plugin  # noqa: E402

load_plugin()
#: Relative to the greatest force of a rollout: what single precision may differ by.
CLOSE = 1e-5
#: Fields of a Warp data that the water reads or adds to.
FIELDS = ("qvel", "xpos", "xmat", "subtree_com", "cvel", "cdof", "cdof_dot", "qfrc_passive", "M")


def effect(name, target="hull", **parameters):
    """One effect as text."""
    return json.dumps({"effect": name, "target": target, "parameters": parameters})


def vehicle(*effects, option='integrator="implicitfast"', geoms=None, **attributes):
    """The spec of the tests' vehicle, a hull with a fin on a hinge, and a sensor of its water."""
    escaped = {name: html.escape(str(value)) for name, value in attributes.items()}
    text = models.vehicle(*effects, option=option, attributes=escaped)
    if geoms is not None:
        text = text.replace('<geom type="ellipsoid" size="0.33 0.18 0.1" mass="25"/>', geoms)
    return with_sensor(mujoco.MjSpec.from_string(text))


def scene(name, integrator=mujoco.mjtIntegrator.mjINT_IMPLICITFAST):
    """The spec of a scene of the package, without contacts, with a sensor of its water."""
    spec = mujoco.MjSpec.from_file(hydro.scene(name))
    spec.option.integrator = integrator
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    return with_sensor(spec)


def ant():
    """The ant of Gymnasium's wheel, neutral under the surface: water on its torso and on its four thighs."""
    assets = pytest.importorskip("gymnasium").__path__[0]
    spec = mujoco.MjSpec.from_file(f"{assets}/envs/mujoco/assets/ant.xml")
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    six = ("surge", "sway", "heave", "roll", "pitch", "yaw")
    effects = [
        {"effect": "hydrostatics", "target": "torso", "parameters": {"volume": 0.0009}},
        {"effect": "added_mass", "target": "torso", "parameters": dict(zip(six, (0.3, 0.4, 0.5, 0.01, 0.02, 0.02)))},
    ]
    for number in range(1, 5):
        drag = {"effect": "quadratic_drag", "parameters": dict(zip(six, (0.5, 1, 1, 0.01, 0.02, 0.02)))}
        mass = {"effect": "added_mass", "parameters": dict(zip(six, (0.02, 0.1, 0.1, 1e-4, 1e-3, 1e-3)))}
        effects += [each | {"target": f"aux_{number}"} for each in (drag, mass)]
    hydro.add_water(
        spec,
        body="torso",
        effects=effects,
        waterline=0.8,
        current=(0.1, -0.05, 0),
        hull=["torso_geom", "left_leg_geom", "right_leg_geom", "back_leg_geom", "rightback_leg_geom"],
    )
    next(sensor for sensor in spec.sensors if sensor.name == "torso_water").name = "water"
    return spec


def with_sensor(spec):
    """The spec with a sensor of its first instance's wrench, after one of the body's velocity."""
    spec.add_sensor(
        name="speed",
        type=mujoco.mjtSensor.mjSENS_FRAMELINVEL,
        objtype=mujoco.mjtObj.mjOBJ_BODY,
        objname=spec.bodies[1].name,
    )
    sensor = spec.add_sensor(name="water", type=mujoco.mjtSensor.mjSENS_PLUGIN)
    sensor.plugin.plugin_name, sensor.plugin.name, sensor.plugin.active = "hydro.wrench", spec.plugins[0].name, True
    return spec


class Pair:
    """A model with the plugin and its Warp model, in `nworld` worlds."""

    def __init__(self, spec, nworld=1):
        self.model, self.plain = spec.compile(), water.without_plugin(spec).compile()
        self.m = mjw.put_model(self.plain)
        self.water = water.attach(self.m, self.model, nworld=nworld)
        self.nworld = nworld

    def states(self, seed=0):
        """States of a rollout of the plugin in waves of control, one a world, from a start that turns and drifts."""
        rng = np.random.default_rng(seed)
        data = mujoco.MjData(self.model)
        data.qvel[:] = rng.normal(0, 0.4, self.model.nv)
        turn = rng.normal(size=4)
        data.qpos[3:7] = turn / np.linalg.norm(turn)
        found = []
        for _ in range(self.nworld):
            data.qvel[:] += rng.normal(0, 0.3, self.model.nv)
            for _ in range(10):
                data.ctrl[:] = control(self.model, data.time)
                mujoco.mj_step(self.model, data)
            found.append((data.time, data.qpos.copy(), data.qvel.copy()))
        return found

    def compare(self, states, later=0.0):
        """Greatest differences at the states, relative to the greatest value: passive force, inertia, sensor.

        later: by which the time is greater than that of the states [s].
        """
        plugin, bare = [], []
        for time, qpos, qvel in states:
            for model, into in ((self.model, plugin), (self.plain, bare)):
                data = mujoco.MjData(model)
                data.time, data.qpos[:], data.qvel[:] = time + later, qpos, qvel
                mujoco.mj_forward(model, data)
                into.append(data)
        d = mjw.put_data(self.plain, bare[0], nworld=self.nworld)
        for name in FIELDS:
            values = np.array([getattr(data, name) for data in bare])
            into = getattr(d, name)
            into.assign(values.reshape(into.numpy().shape).astype(np.float32))
        d.time.assign(np.array([data.time for data in bare], dtype=np.float32))
        self.water.passive(self.m, d)
        self.water.sensor(self.m, d, mjw._src.types.Stage.VEL)
        place = self.model.sensor("water").adr[0]
        expected = {
            "qfrc_passive": np.array([data.qfrc_passive for data in plugin]),
            "M": np.array([data.M for data in plugin]),
            "sensor": np.array([data.sensordata[place : place + 6] for data in plugin]),
        }
        found = {
            "qfrc_passive": d.qfrc_passive.numpy(),
            "M": d.M.numpy(),
            "sensor": d.sensordata.numpy()[:, place : place + 6],
        }
        return {
            name: np.abs(found[name] - value).max() / (np.abs(value).max() or 1.0) for name, value in expected.items()
        }


def control(model, time):
    """Controls that differ by actuator and wave in time, within their ranges."""
    half = np.abs(model.actuator_ctrlrange[:, 1])
    return half * 0.5 * np.sin(5 * time + np.arange(model.nu))


def together(pair, steps, step=None):
    """Steps of the plugin and of MuJoCo Warp under the same controls; the plugin's data and Warp's."""
    step = step or mjw.step
    data, d = mujoco.MjData(pair.model), mjw.make_data(pair.plain, nworld=pair.nworld)
    for _ in range(steps):
        now = control(pair.model, data.time)
        data.ctrl[:] = now
        d.ctrl.assign(np.tile(now, (pair.nworld, 1)).astype(np.float32))
        mujoco.mj_step(pair.model, data)
        step(pair.m, d)
    return data, d
