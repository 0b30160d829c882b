"""Thigh and calf of B1 under water, hung from a force and torque cell."""

import mujoco
import numpy as np

from .. import excitation
from ..effects import actuator, drag, inertial, joint, memory, outside, sensor, water, weight
from ..effects.backlash import JointBacklash
from ..scenes import GAP, with_noise
from .base import Drive, Schedule, System

#: Middle of the motion and its reach [rad], thigh and calf.
MIDDLE, REACH = np.array([0.1, -1.1]), np.array([0.7, 0.8])
MODES = {
    "normal": ["multisine", "steps", "chirp", "slow", "outer", "multisine", "pulses", "steps", "slow", "outer"],
}


class Leg(System):
    """See the module."""

    name, base = "leg", "thigh"

    def nominal_xml(self, noise):
        return with_noise((GAP / "leg.xml").read_text(), noise)

    def truth_step(self, rng):
        # The servos are stiff: at 1 ms a first-order integrator is off by a whitened distance of 80.
        return 0.001, int(mujoco.mjtIntegrator.mjINT_RK4)

    def schedule(self, rng, *, small):
        return Schedule(4, 300, 0.01) if small else Schedule(10, int(rng.integers(9, 12)) * 100, 0.01)

    def drive(self, rng, model, schedule, style):
        m, rows = schedule.trials, schedule.rows
        # The joints' reach is what it is: faster is the same table in less time.
        period = schedule.period * schedule.speed
        table = np.zeros((m, rows + 1, 2))
        outer = np.zeros(m)
        modes = []
        cycle = MODES.get(style, MODES["normal"])
        for i in range(m):
            mode = cycle[i % len(cycle)]
            modes.append(mode)
            size = schedule.size(rng, 0.35, 1.0)
            reach = REACH * size
            if mode == "multisine" or mode == "outer":
                table[i] = excitation.multisine(rng, rows + 1, period, 2, lowest=0.15, highest=2.5) * reach
                outer[i] = mode == "outer"
            elif mode == "steps":
                table[i] = _smooth(excitation.steps(rng, rows + 1, period, 2, hold=0.9), period) * reach
            elif mode == "chirp":
                which = int(rng.integers(2))
                table[i, :, which] = (
                    excitation.chirp(rng, rows + 1, period, lowest=0.1, highest=2.5) * reach[which] * 0.7
                )
            elif mode == "slow":
                table[i] = excitation.multisine(rng, rows + 1, period, 2, lowest=0.06, highest=0.25, tones=3) * REACH
            elif mode == "pulses":
                table[i] = _smooth(excitation.pulses(rng, rows + 1, period, 2), period) * reach
        policy = _Servo(model, table + MIDDLE, outer, rng.normal(0, 0.002, (m, rows + 1, 2)))
        # From rest at the first target: a jump of the servo would shake everything.
        start = table[:, 0] + MIDDLE
        return Drive(start, np.zeros((m, 2)), policy, modes)

    def singles(self, model):
        calf = model.body("calf").id
        joints = [("thigh_joint", 0, 0), ("calf_joint", 1, 1)]
        servos = ["thigh_servo", "calf_servo"]

        def one_joint(rng):
            return joints[int(rng.integers(2))]

        def servo(rng):
            i = int(rng.integers(2))
            return servos[i], [i]

        def vary(rng, values):
            return np.asarray(values, float) * rng.uniform(0.7, 1.3, len(values))

        def sign(rng):
            return rng.choice([-1.0, 1.0])

        def bias(rng):
            name = str(rng.choice(["cell_force", "calf_position", "thigh_position", "cell_torque"]))
            size, unit, width = {"cell_force": (1.0, "N", 3), "cell_torque": (0.3, "N m", 3)}.get(
                name, (0.01, "rad", 1)
            )
            return sensor.SensorBias(name, sign(rng) * size * rng.uniform(0.5, 1.5, width), unit)

        def backlash(rng):
            name, dof, _ = one_joint(rng)
            return JointBacklash(name, model.joint(name).id, 0.02, dof)

        return {
            "added_mass": lambda rng: inertial.AddedMass("calf", calf, vary(rng, [1.0, 0.6, 0.05, 0.08, 0.12, 0.001])),
            "linear_drag": lambda rng: drag.LinearDrag("calf", calf, vary(rng, [4, 3, 1, 0.05, 0.1, 0.02])),
            "quadratic_drag": lambda rng: drag.QuadraticDrag("calf", calf, vary(rng, [12, 8, 2, 0.05, 0.1, 0.02])),
            "cross_flow_drag": lambda rng: drag.CrossFlowDrag(
                "calf", calf, along=2, length=0.4, diameter=0.06, coefficient=1.0, centre=-0.165
            ),
            "current": lambda rng: water.Current(
                "calf", calf, np.array([sign(rng) * 0.2, rng.normal(0, 0.08), 0.0]), rng.uniform(0, 6)
            ),
            "net_buoyancy": lambda rng: weight.NetBuoyancy("calf", calf, sign(rng) * 1.5, np.array([0.005, 0, -0.17])),
            "payload": lambda rng: weight.Payload("calf", calf, 0.2, np.array([0.02, 0.0, -rng.uniform(0.2, 0.36)])),
            "constant_force": lambda rng: weight.ConstantForce(
                "calf", calf, np.array([sign(rng) * 1.5, rng.normal(0, 0.5), 0])
            ),
            "wake_memory": lambda rng: memory.WakeMemory(
                "calf", calf, vary(rng, [5, 4, 1, 0.05, 0.2, 0.02]), rng.uniform(1.0, 4.0)
            ),
            "basset_history": lambda rng: memory.BassetHistory("calf", calf, 3.0, axes=vary(rng, [1.0, 0.8, 0.3])),
            "waves": lambda rng: water.Waves(
                "calf",
                calf,
                amplitude=0.1,
                frequency=rng.uniform(0.3, 0.7),
                phase=rng.uniform(0, 6.28),
                direction=rng.choice([0.0, 0.5]),
                displaced_mass=0.74,
            ),
            "actuator_gain": lambda rng: actuator.ActuatorGain(*servo(rng), sign(rng) * 0.15),
            "actuator_lag": lambda rng: actuator.ActuatorLag(*servo(rng), 0.03),
            "actuator_delay": lambda rng: actuator.ActuatorDelay(*servo(rng), 0.02),
            "joint_friction": lambda rng: joint.JointFriction(*one_joint(rng), 0.8),
            "joint_damping": lambda rng: joint.JointDamping(*one_joint(rng), 0.8),
            "joint_armature": lambda rng: joint.JointArmature(*one_joint(rng), 0.02),
            "joint_stiffness": lambda rng: joint.JointStiffness(*one_joint(rng), 4.0, rng.uniform(-0.4, 0.4) - 0.5),
            "joint_backlash": backlash,
            "sensor_bias": bias,
            "sensor_delay": lambda rng: sensor.SensorDelay(str(rng.choice(["cell_force", "calf_position"])), 0.015),
            "sensor_scale": lambda rng: sensor.SensorScale(
                str(rng.choice(["cell_force", "cell_torque", "calf_velocity"])), sign(rng) * 0.03
            ),
        }

    def outside(self, model):
        calf = model.body("calf").id

        def ripple(rng):
            i = int(rng.integers(2))
            return outside.GearRipple(["thigh_joint", "calf_joint"][i], i, i, 1.0, int(rng.integers(15, 30)))

        return {
            "gear_ripple": ripple,
            "joint_cross_coupling": lambda rng: outside.CrossCoupling("calf_joint", 1, 0, 0.8),
            "vortex_shedding": lambda rng: outside.VortexShedding("calf", calf, 10.0, 0.06),
            "lopsided_drag": lambda rng: outside.LopsidedDrag("calf", calf, 8.0, 0),
            "tether": lambda rng: outside.Tether("calf", calf, np.array([0.5, 0.2, -0.6]), 0.45, 15.0),
            "rocking_base": lambda rng: outside.GravityTilt("calf", calf, 1.0, rng.uniform(3, 6)),
        }

    def twins(self, model):
        return {}


def _smooth(table: np.ndarray, period: float) -> np.ndarray:
    """Edges of a quarter of a second, as a trajectory generator would give them."""
    kernel = np.hanning(max(int(0.25 / period), 3))
    kernel /= kernel.sum()
    return np.stack([np.convolve(column, kernel)[: len(column)] for column in table.T], 1)


class _Servo:
    """Servo targets from a table; where `outer` is 1, corrected by what the joints (noisily) say."""

    def __init__(self, model, table, outer, noise):
        self.table, self.outer, self.noise = table, outer[:, None], noise
        self.low, self.high = model.actuator_ctrlrange.T

    def tiled(self, count: int) -> "_Servo":
        """The same trials `count` times over."""
        other = object.__new__(_Servo)
        other.__dict__ = dict(self.__dict__)
        other.table, other.noise = np.tile(self.table, (count, 1, 1)), np.tile(self.noise, (count, 1, 1))
        other.outer = np.tile(self.outer, (count, 1))
        return other

    def __call__(self, row, plant):
        error = self.table[:, row] - plant.qpos[:, :2] - self.noise[:, row]
        return np.clip(self.table[:, row] + 0.35 * self.outer * error, self.low, self.high)
