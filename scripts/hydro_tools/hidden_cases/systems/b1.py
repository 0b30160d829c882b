"""B1 under a towing carriage, and B1 swimming freely in its learned water."""

import functools

import mujoco
import numpy as np

from ...repository import ROOT
from .. import excitation
from ..checkpoint_water import Checkpoint, LearnedWater
from ..effects import actuator, drag, inertial, joint, lift, memory, outside, sensor, water, weight
from ..scenes import GAP, with_noise, without_plugins
from .base import Drive, Schedule, System, Twin

#: Standing posture of a leg, and how far its targets move [rad]: hip, thigh, calf.
HOME, SWING = np.array([0.0, 0.75, -1.5]), np.array([0.12, 0.35, 0.35])
#: Displaced water [kg].
DISPLACED = 58.0
CHECKPOINT = "models/b1-task2"
LEGS = ("FR", "FL", "RR", "RL")


def _vary(rng, values):
    return np.asarray(values, float) * rng.uniform(0.7, 1.3, len(values))


def _sign(rng):
    return rng.choice([-1.0, 1.0])


def gait(rng: np.random.Generator, rows: int, period: float, mode: str) -> np.ndarray:
    """Joint targets [rows, 12] in B1's order."""
    t = np.arange(rows) * period
    out = np.tile(HOME, (rows, 4))
    if mode == "still":
        return out
    if mode == "random":
        return out + excitation.multisine(rng, rows, period, 12, lowest=0.2, highest=1.2) * np.tile(SWING, 4)
    if mode == "slow":
        return out + excitation.multisine(rng, rows, period, 12, lowest=0.08, highest=0.3, tones=3) * np.tile(SWING, 4)
    frequency, size = rng.uniform(0.5, 1.1), rng.uniform(0.5, 1.0)
    for leg in range(4):
        # Diagonal pairs in step (a trot), or left against right (a paddle).
        phase = np.pi * (leg in (1, 2)) if mode == "trot" else np.pi * (leg % 2)
        angle = 2 * np.pi * frequency * t + phase
        wave = np.stack([0.3 * np.sin(angle), np.sin(angle), np.cos(angle) - np.cos(phase)], 1)
        out[:, 3 * leg : 3 * leg + 3] += SWING * size * wave * excitation.ramp(rows, period, 1.0)[:, None]
    return out


class _Table:
    """Commands from a table; legs are held by their own servos."""

    def __init__(self, model, table):
        self.table = np.clip(
            table, *np.where(model.actuator_ctrllimited[:, None], model.actuator_ctrlrange, [-np.inf, np.inf]).T
        )

    def tiled(self, count: int) -> "_Table":
        """The same trials `count` times over."""
        other = object.__new__(_Table)
        other.table = np.tile(self.table, (count, 1, 1))
        return other

    def __call__(self, row, plant):
        return self.table[:, row]


class Tow(System):
    """Towed along prescribed runs; the legs held or moving."""

    name, base = "tow", "trunk"

    def nominal_xml(self, noise):
        return with_noise((GAP / "b1_tow.xml").read_text(), noise)

    def truth_step(self, rng):
        return 0.001, int(mujoco.mjtIntegrator.mjINT_RK4)

    def schedule(self, rng, *, small):
        return Schedule(4, 300, 0.01) if small else Schedule(10, int(rng.integers(8, 11)) * 100, 0.01)

    def drive(self, rng, model, schedule, style):
        m, rows, period = schedule.trials, schedule.rows, schedule.period * schedule.speed
        table = np.zeros((m, rows + 1, 14))
        modes = []
        t = np.arange(rows + 1) * period
        for i in range(m):
            run = ("ladder", "multisine", "ladder", "sine", "multisine")[i % 5]
            legs = ("still", "trot", "random", "still", "paddle")[i % 5]
            modes.append(f"{run} {legs}")
            size = schedule.size(rng, 0.3, 0.9) * schedule.speed
            if run == "ladder":
                levels = np.zeros((rows + 1, 2))
                at = int(0.5 / period)
                while at < rows:
                    length = int(rng.uniform(1.2, 2.2) / period)
                    levels[at : at + length] = rng.uniform(-1, 1, 2) * [size, 0.6 * size]
                    at += length
                kernel = np.hanning(int(0.8 / period))
                kernel /= kernel.sum()
                table[i, :, :2] = np.stack([np.convolve(c, kernel)[: rows + 1] for c in levels.T], 1)
            elif run == "multisine":
                table[i, :, :2] = excitation.multisine(rng, rows + 1, period, 2, lowest=0.1, highest=0.9) * [
                    size,
                    0.6 * size,
                ]
            elif run == "sine":
                table[i, :, 0] = (
                    size * np.sin(2 * np.pi * rng.uniform(0.2, 0.5) * t) * excitation.ramp(rows + 1, period)
                )
            table[i, :, 2:] = gait(rng, rows + 1, period, legs)
        start = np.concatenate([np.zeros((m, 2)), np.tile(HOME, (m, 4))], 1)
        return Drive(start, np.zeros((m, 14)), _Table(model, table), modes)

    def singles(self, model):
        trunk = model.body("trunk").id
        hinges = [i for i in range(model.njnt) if model.jnt_type[i] == mujoco.mjtJoint.mjJNT_HINGE]

        def hinge(rng):
            j = hinges[int(rng.integers(len(hinges)))]
            return model.joint(j).name, int(model.jnt_dofadr[j]), int(model.jnt_qposadr[j])

        def bias(rng):
            name, size, unit = (("gantry_force", 4.0, "N"), ("gantry_torque", 1.0, "N m"))[int(rng.integers(2))]
            return sensor.SensorBias(name, _sign(rng) * size * rng.uniform(0.5, 1.5, 3), unit)

        return {
            "added_mass": lambda rng: inertial.AddedMass("trunk", trunk, _vary(rng, [10, 25, 30, 0.5, 1.5, 1.5])),
            "linear_drag": lambda rng: drag.LinearDrag("trunk", trunk, _vary(rng, [15, 25, 30, 1, 2, 2])),
            "quadratic_drag": lambda rng: drag.QuadraticDrag("trunk", trunk, _vary(rng, [40, 70, 80, 2, 3, 3])),
            "current": lambda rng: water.Current(
                "trunk", trunk, np.array([_sign(rng) * 0.1, rng.normal(0, 0.05), 0.0]), rng.uniform(0, 6)
            ),
            "munk_moment": lambda rng: inertial.MunkMoment("trunk", trunk, _vary(rng, [3, 20, 25, 0, 0, 0])),
            "lift": lambda rng: lift.Lift("trunk", trunk, area=0.15, slope=rng.uniform(0.8, 1.4), planes=(1,)),
            "net_buoyancy": lambda rng: weight.NetBuoyancy(
                "trunk", trunk, _sign(rng) * 6.0, np.array([0.015, 0, 0.05])
            ),
            "constant_force": lambda rng: weight.ConstantForce(
                "trunk", trunk, np.array([_sign(rng) * 4.0, rng.normal(0, 2.0), 0.0])
            ),
            "wake_memory": lambda rng: memory.WakeMemory(
                "trunk", trunk, _vary(rng, [20, 30, 30, 1, 2, 2]), rng.uniform(0.8, 3.0)
            ),
            "joint_friction": lambda rng: joint.JointFriction(*hinge(rng), 1.5),
            "joint_damping": lambda rng: joint.JointDamping(*hinge(rng), 2.0),
            "sensor_bias": bias,
            "sensor_scale": lambda rng: sensor.SensorScale("gantry_force", _sign(rng) * 0.04),
            "sensor_delay": lambda rng: sensor.SensorDelay("gantry_force", 0.02),
        }

    def outside(self, model):
        trunk = model.body("trunk").id
        return {
            "lopsided_drag": lambda rng: outside.LopsidedDrag("trunk", trunk, 40.0, 0),
            "vortex_shedding": lambda rng: outside.VortexShedding("trunk", trunk, 40.0, 0.3),
            "rocking_base": lambda rng: outside.GravityTilt("trunk", trunk, 4.0, rng.uniform(3, 6)),
        }

    def twins(self, model):
        return {}


@functools.cache
def _checkpoint() -> Checkpoint:
    return Checkpoint(ROOT / CHECKPOINT)


class Swim(System):
    """Free, in the water of a checkpoint."""

    name, base = "swim", "trunk"

    def nominal_xml(self, noise):
        # The case lies elsewhere than the scene: its checkpoint is named by an absolute path.
        return with_noise((GAP / "b1_swim.xml").read_text(), noise).replace(f'"{CHECKPOINT}"', f'"{ROOT / CHECKPOINT}"')

    def plain_model(self, xml):
        return mujoco.MjModel.from_xml_string(without_plugins(xml))

    def truth_step(self, rng):
        # The checkpoint was made at this step, and the scene's Euler steps leave a whitened distance of 25
        # to those of half the length: a null is only a null at the scene's own.
        return 0.002, int(mujoco.mjtIntegrator.mjINT_EULER)

    def schedule(self, rng, *, small):
        return Schedule(4, 200, 0.01) if small else Schedule(10, int(rng.integers(5, 8)) * 100, 0.01)

    def water(self, members):
        return LearnedWater(_checkpoint(), 1)

    def plugin_state(self):
        # Phase, count, two times and whether it was out of range; two forces and the drag out there; the latest
        # features; the newest slot and the window of inputs. Zeros: cold.
        net = _checkpoint()
        return 5 + 18 + net.features + 1 + net.window * len(net.mean)

    def drive(self, rng, model, schedule, style):
        m, rows, period = schedule.trials, schedule.rows, schedule.period * schedule.speed
        table = np.zeros((m, rows + 1, 12))
        modes = []
        for i in range(m):
            mode = "slow" if style == "slow" else ("random", "trot", "paddle", "random", "still")[i % 5]
            modes.append(mode)
            table[i] = gait(rng, rows + 1, period, mode)
        qpos = np.zeros((m, 19))
        qpos[:, 2] = -2.0
        turn = rng.normal(0, [0.05, 0.05, 1.0], (m, 3))
        half = turn[:, 2] / 2
        qpos[:, 3], qpos[:, 6] = np.cos(half), np.sin(half)
        qpos[:, 7:] = np.tile(HOME, 4)
        qvel = np.zeros((m, 18))
        qvel[:, :3] = rng.normal(0, 0.15, (m, 3))
        qvel[:, 3:6] = rng.normal(0, 0.1, (m, 3))
        return Drive(qpos, qvel, _Table(model, table), modes)

    def singles(self, model):
        trunk = model.body("trunk").id

        def hinge(rng):
            j = int(rng.integers(1, 13))
            return model.joint(j).name, int(model.jnt_dofadr[j]), int(model.jnt_qposadr[j])

        def bias(rng):
            name, size, unit = (("imu_gyro", 0.01, "rad/s"), ("base_linear_velocity", 0.02, "m/s"))[
                int(rng.integers(2))
            ]
            return sensor.SensorBias(name, rng.normal(0, size, 3), unit)

        return {
            "added_mass": lambda rng: inertial.AddedMass("trunk", trunk, _vary(rng, [8, 20, 25, 0.4, 1.2, 1.2])),
            "linear_drag": lambda rng: drag.LinearDrag("trunk", trunk, _vary(rng, [12, 20, 25, 1, 2, 2])),
            "quadratic_drag": lambda rng: drag.QuadraticDrag("trunk", trunk, _vary(rng, [40, 70, 80, 2, 3, 3])),
            "current": lambda rng: water.Current(
                "trunk", trunk, np.array([rng.normal(0, 0.1), rng.normal(0, 0.1), 0.0]), rng.uniform(0, 6)
            ),
            "net_buoyancy": lambda rng: weight.NetBuoyancy(
                "trunk", trunk, _sign(rng) * 5.0, np.array([0.015, 0, 0.05])
            ),
            "buoyancy_offset": lambda rng: weight.BuoyancyOffset(
                "trunk", trunk, rng.normal(0, 1, 3) * [0.006, 0.004, 0.002], DISPLACED * weight.GRAVITY
            ),
            "payload": lambda rng: weight.Payload(
                "trunk",
                trunk,
                1.0,
                np.array([_sign(rng) * rng.uniform(0.1, 0.35), rng.uniform(-0.1, 0.1), rng.uniform(-0.05, 0.12)]),
            ),
            "constant_force": lambda rng: weight.ConstantForce(
                "trunk", trunk, np.array([rng.normal(0, 4), rng.normal(0, 4), 0.0])
            ),
            "wake_memory": lambda rng: memory.WakeMemory(
                "trunk", trunk, _vary(rng, [15, 25, 30, 1, 2, 2]), rng.uniform(0.8, 3.0)
            ),
            "actuator_lag": lambda rng: actuator.ActuatorLag("all", list(range(12)), 0.03),
            "actuator_delay": lambda rng: actuator.ActuatorDelay("all", list(range(12)), 0.02),
            "joint_friction": lambda rng: joint.JointFriction(*hinge(rng), 1.5),
            "joint_damping": lambda rng: joint.JointDamping(*hinge(rng), 2.0),
            "sensor_bias": bias,
            "sensor_delay": lambda rng: sensor.SensorDelay("base_linear_velocity", 0.03),
        }

    def outside(self, model):
        trunk = model.body("trunk").id
        return {
            "spin_sway": lambda rng: outside.SpinSway("trunk", trunk, 60.0),
            "tether": lambda rng: outside.Tether("trunk", trunk, np.array([0, 0, -1.0]), 0.9, 20.0),
            "rocking_base": lambda rng: outside.GravityTilt("trunk", trunk, 5.0, rng.uniform(3, 6)),
        }

    def twins(self, model):
        every = list(range(model.nu))
        return {
            # Slow commands see of a lag only its delay.
            "actuator_lag": Twin(lambda rng: actuator.ActuatorLag("all", every, 0.03), "slow", "actuator_delay"),
            "actuator_delay": Twin(lambda rng: actuator.ActuatorDelay("all", every, 0.02), "slow", "actuator_lag"),
        }
