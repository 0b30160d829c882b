"""Rollouts of the plugin, replayed in the water of MuJoCo Warp: for tests of what has a memory."""

import mujoco
import numpy as np

import hydro_mujoco as hydro
from warp_scenes import FIELDS, control, mjw, with_sensor

#: Numbers of the sensor of the water.
SIX = 6


def swimmer(checkpoint, timestep=0.002, **attributes):
    """The spec of B1 in the water of a released checkpoint, without contacts, with a sensor of its water."""
    spec = mujoco.MjSpec.from_file(hydro.scene("b1_swim"))
    folder = hydro.checkpoint(checkpoint) if isinstance(checkpoint, str) else checkpoint
    config = {"checkpoint": str(folder)} | {name: str(value) for name, value in attributes.items()}
    spec.plugins[0].config = dict(spec.plugins[0].config) | config
    spec.option.timestep = timestep
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    return with_sensor(spec)


class Rollout:
    """States of the plugin from a start that turns and drifts, under waves of control, and its forces at them."""

    def __init__(self, model, steps, seed=0, speed=0.3):
        self.states, self.sensor, self.passive, self.inertia = [], [], [], []
        data, rng = mujoco.MjData(model), np.random.default_rng(seed)
        data.qvel[:] = rng.normal(0, speed, model.nv)
        turn = rng.normal(size=4)
        data.qpos[3:7] = turn / np.linalg.norm(turn)
        place = model.sensor("water").adr[0]
        for _ in range(steps):
            mujoco.mj_forward(model, data)
            self.states.append((data.time, data.qpos.copy(), data.qvel.copy()))
            self.sensor.append(data.sensordata[place : place + SIX].copy())
            self.passive.append(data.qfrc_passive.copy())
            self.inertia.append(data.M.copy())
            data.ctrl[:] = 0.6 * control(model, data.time)
            mujoco.mj_step(model, data)


def replay(pair, worlds):
    """Sensor, passive force and inertia matrix in MuJoCo Warp at the states of a list of rollouts in each world, one after the other.

    Shapes (steps, worlds, ..). A rollout after another is a reset of its world alone.
    """
    bare = mujoco.MjData(pair.plain)
    mujoco.mj_forward(pair.plain, bare)
    d = mjw.put_data(pair.plain, bare, nworld=pair.nworld)
    fields = {name: np.zeros(getattr(d, name).numpy().shape, dtype=np.float32) for name in ("qpos", *FIELDS)}
    times, place = np.zeros(pair.nworld, dtype=np.float32), pair.model.sensor("water").adr[0]
    tracks = [[state for rollout in rollouts for state in rollout.states] for rollouts in worlds]
    sensor, passive, inertia = [], [], []
    for now in zip(*tracks, strict=True):
        for world, (time, qpos, qvel) in enumerate(now):
            times[world], bare.time, bare.qpos[:], bare.qvel[:] = time, time, qpos, qvel
            mujoco.mj_forward(pair.plain, bare)
            for name, into in fields.items():
                into[world] = getattr(bare, name).reshape(into[world].shape)
        for name, values in fields.items():
            getattr(d, name).assign(values)
        d.time.assign(times)
        pair.water.passive(pair.m, d)
        pair.water.sensor(pair.m, d, mjw._src.types.Stage.VEL)
        sensor.append(d.sensordata.numpy()[:, place : place + SIX].copy())
        passive.append(d.qfrc_passive.numpy().copy())
        inertia.append(d.M.numpy().reshape(pair.nworld, -1).copy())
    return np.array(sensor), np.array(passive), np.array(inertia)


def differences(pair, worlds):
    """Greatest differences of a replay from the rollouts, relative to the greatest of each number.

    Of sensor, passive force and inertia matrix.
    """
    found = replay(pair, worlds)
    expected = [
        np.stack([np.concatenate([getattr(each, name) for each in rollouts]) for rollouts in worlds], axis=1)
        for name in ("sensor", "passive", "inertia")
    ]
    scale = [np.abs(values).max(axis=(0, 1)) for values in expected]
    return [
        float((np.abs(ours - theirs).max(axis=(0, 1)) / np.maximum(size, max(1e-2 * size.max(), 1e-12))).max())
        for ours, theirs, size in zip(found, expected, scale, strict=True)
    ]
