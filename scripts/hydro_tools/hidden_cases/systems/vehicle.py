"""A six-degree vehicle with eight thrusters."""

from pathlib import Path

import mujoco
import numpy as np

from .. import excitation
from ..effects import actuator, boundary, drag, inertial, lift, memory, outside, sensor, water, weight
from ..frames import exponential, product, rotation, turned_back
from ..scenes import GAP, with_noise
from .base import Drive, Schedule, System, Twin

#: Largest wrench that the excitation asks for [N, N m].
REACH = np.array([38.0, 34.0, 28.0, 1.0, 1.2, 3.5])
#: Volume [m^3], displaced mass [kg] and semi-axes [m] of the hull.
DISPLACED = 25.0
#: Drag areas of the hull times half the density [N s^2/m^2].
AREAS = np.array([45.0, 80.0, 150.0])


class Vehicle(System):
    """See the module."""

    name, base = "vehicle", "hull"

    def nominal_xml(self, noise: float) -> str:
        return with_noise(Path(GAP / "vehicle.xml").read_text(), noise)

    def truth_step(self, rng):
        # First-order steps of 1 ms would already leave a whitened distance of 3 to the nominal's own motion.
        if rng.random() < 0.5:
            return 0.0005, int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)
        return 0.001, int(mujoco.mjtIntegrator.mjINT_RK4)

    def schedule(self, rng, *, small):
        if small:
            return Schedule(4, 300, 0.02)
        return Schedule(10, int(rng.integers(18, 22)) * 50, 0.02)

    def drive(self, rng, model, schedule, style):
        m, rows, period = schedule.trials, schedule.rows, schedule.period
        wrench = np.zeros((m, rows + 1, 6))
        direct = np.zeros((m, rows + 1, model.nu))
        goals = np.zeros((m, rows + 1, 4))  # x y z yaw
        position_gain, depth_gain = np.zeros(m), np.ones(m)
        depth = _depths(rng, m, style)
        modes = []
        cycle = _MODES.get(style, _MODES["normal"])
        for i in range(m):
            mode = cycle[i % len(cycle)]
            modes.append(mode)
            size = schedule.size(rng, 0.35, 1.0) * schedule.speed
            goals[i, :, 2] = depth[i] + (_depth_walk(rng, rows + 1, period, style))
            if mode == "multisine":
                wrench[i] = excitation.multisine(rng, rows + 1, period, 6) * REACH * size
            elif mode == "steps":
                wrench[i] = excitation.steps(rng, rows + 1, period, 6) * REACH * size
            elif mode == "chirp":
                axis = int(rng.choice([0, 1, 2, 5]))
                wrench[i, :, axis] = excitation.chirp(rng, rows + 1, period, highest=1.0) * REACH[axis] * size
                other = int(rng.choice([a for a in (0, 1, 5) if a != axis]))
                wrench[i, :, other] += excitation.multisine(rng, rows + 1, period, 1)[:, 0] * REACH[other] * 0.4
            elif mode == "pulses":
                direct[i] = 0.35 * schedule.speed * excitation.pulses(rng, rows + 1, period, model.nu)
            elif mode == "free":
                wrench[i] = excitation.multisine(rng, rows + 1, period, 6) * REACH * size * 0.8
                depth_gain[i] = 0.0
            elif mode in ("waypoint", "keep"):
                position_gain[i] = 1.0
                goals[i, :, [0, 1, 3]] = _way(rng, rows + 1, period, still=mode == "keep") * schedule.speed
                if mode == "keep":
                    goals[i, :, 2] = depth[i]
            elif mode in ("gentle", "slow"):
                reach = REACH * size * (0.25 if mode == "gentle" else 0.8) * [1, 1, 1, 0, 0, 1]
                wrench[i] = excitation.multisine(rng, rows + 1, period, 6, lowest=0.04, highest=0.2, tones=4) * reach
        noise = {
            "position": rng.normal(0, 0.008, (m, rows + 1, 3)),
            "turn": rng.normal(0, 0.003, (m, rows + 1, 3)),
            "nu": rng.normal(0, 0.008, (m, rows + 1, 6)),
        }
        hold = _Hold(model, wrench, direct, goals, position_gain, depth_gain, noise, period)
        qpos = np.zeros((m, 7))
        qpos[:, 2] = depth
        turn = np.zeros((m, 3))
        turn[:, :2] = rng.normal(0, 0.03, (m, 2))
        heading = rng.uniform(-np.pi, np.pi, m)
        yaw = np.zeros((m, 3))
        yaw[:, 2] = heading
        goals[..., 3] += heading[:, None]
        qpos[:, 3:] = product(exponential(yaw), exponential(turn))
        return Drive(qpos, rng.normal(0, 0.01, (m, 6)), hold, modes)

    def singles(self, model):
        body = model.body("hull").id
        thrusters = [f"thruster_{i}" for i in range(1, 9)]

        def one(rng):
            i = int(rng.integers(8))
            return thrusters[i], [i]

        def some(rng):
            return ("all", list(range(8))) if rng.random() < 0.5 else one(rng)

        def direction(rng, spread=0.25):
            a = rng.uniform(0, 2 * np.pi)
            return np.array([np.cos(a), np.sin(a), rng.normal(0, spread * 0.3)])

        def vary(rng, values):
            return np.asarray(values, float) * rng.uniform(0.7, 1.3, len(values))

        def push(rng):
            i = int(rng.integers(8))
            matrix = model.site_quat[model.site(thrusters[i]).id]
            axis = rotation(matrix)[:, 2]
            return thrusters[i], [i], axis[None], model.site_pos[model.site(thrusters[i]).id][None]

        def inflow(rng):
            if rng.random() < 0.6:
                sites = [model.site(name).id for name in thrusters]
                return actuator.InflowThrustLoss(
                    "all",
                    list(range(8)),
                    0.3,
                    body=body,
                    directions=rotation(model.site_quat[sites])[:, :, 2],
                    places=model.site_pos[sites],
                )
            name, index, axes, places = push(rng)
            return actuator.InflowThrustLoss(name, index, 0.3, body=body, directions=axes, places=places)

        def sensor_name(rng, names):
            return str(rng.choice(names))

        # Not the position's: nothing depends on where the vehicle is, so its start takes such a bias up.
        biases = {"imu_gyro": (0.005, "rad/s"), "dvl": (0.01, "m/s"), "imu_accelerometer": (0.05, "m/s^2")}

        def bias(rng):
            name = sensor_name(rng, list(biases))
            size, unit = biases[name]
            return sensor.SensorBias(name, rng.normal(0, size, 3), unit)

        signs = lambda rng: rng.choice([-1.0, 1.0])  # noqa: E731
        return {
            "added_mass": lambda rng: inertial.AddedMass("hull", body, vary(rng, [6, 12, 18, 0.12, 0.35, 0.35])),
            "linear_drag": lambda rng: drag.LinearDrag("hull", body, vary(rng, [5, 8, 10, 0.3, 0.4, 0.5])),
            "quadratic_drag": lambda rng: drag.QuadraticDrag("hull", body, vary(rng, [18, 30, 40, 0.5, 0.7, 0.8])),
            "cross_flow_drag": lambda rng: drag.CrossFlowDrag(
                "hull", body, along=0, length=0.66, diameter=rng.uniform(0.2, 0.3), coefficient=0.6
            ),
            "current": lambda rng: water.Current("hull", body, 0.1 * direction(rng), rng.uniform(0, 6)),
            "munk_moment": lambda rng: inertial.MunkMoment("hull", body, vary(rng, [2, 10, 16, 0, 0, 0])),
            "lift": lambda rng: lift.Lift("hull", body, area=0.08, slope=rng.uniform(0.8, 1.4)),
            "net_buoyancy": lambda rng: weight.NetBuoyancy("hull", body, signs(rng) * 2.0, np.array([0, 0, 0.02])),
            "buoyancy_offset": lambda rng: weight.BuoyancyOffset(
                "hull", body, rng.normal(0, 1, 3) * [0.006, 0.004, 0.004], DISPLACED * weight.GRAVITY
            ),
            "payload": lambda rng: weight.Payload(
                "hull",
                body,
                0.4,
                np.array([signs(rng) * rng.uniform(0.15, 0.3), rng.uniform(-0.15, 0.15), rng.uniform(-0.15, 0.1)]),
            ),
            "wake_memory": lambda rng: memory.WakeMemory(
                "hull", body, vary(rng, [8, 14, 16, 0.3, 0.4, 0.6]), rng.uniform(0.5, 2.5)
            ),
            "basset_history": lambda rng: memory.BassetHistory("hull", body, 5.0, axes=vary(rng, [0.6, 1.0, 1.3])),
            "free_surface": lambda rng: boundary.FreeSurface(
                "hull", body, coefficient=0.8, length=rng.uniform(0.3, 0.6), drag=AREAS, suction=0.0
            ),
            "wall_proximity": lambda rng: boundary.WallProximity(
                "hull", body, bed=-6.0, coefficient=0.8, length=rng.uniform(0.3, 0.6), drag=AREAS, suction=-10.0
            ),
            "waves": lambda rng: water.Waves(
                "hull",
                body,
                amplitude=0.05,
                frequency=rng.uniform(0.12, 0.35),
                phase=rng.uniform(0, 6.28),
                direction=rng.uniform(0, 6.28),
                displaced_mass=DISPLACED,
            ),
            "actuator_gain": lambda rng: actuator.ActuatorGain(*one(rng), signs(rng) * 0.08),
            "actuator_deadband": lambda rng: actuator.ActuatorDeadband(*some(rng), 0.04),
            "actuator_lag": lambda rng: actuator.ActuatorLag(*some(rng), 0.08),
            "actuator_delay": lambda rng: actuator.ActuatorDelay(*some(rng), 0.05),
            "inflow_thrust_loss": inflow,
            "sensor_bias": bias,
            "sensor_delay": lambda rng: sensor.SensorDelay(sensor_name(rng, ["dvl", "position"]), 0.03),
            "sensor_scale": lambda rng: sensor.SensorScale(sensor_name(rng, ["dvl", "imu_gyro"]), signs(rng) * 0.03),
            "constant_force": lambda rng: weight.ConstantForce("hull", body, 1.5 * direction(rng) * [1, 1, 0]),
        }

    def outside(self, model):
        body = model.body("hull").id
        return {
            "thruster_interaction": lambda rng: outside.ThrusterInteraction(
                "all", [(0, 1), (1, 0), (2, 3), (3, 2), (4, 6), (5, 7)], 0.15
            ),
            "spin_sway": lambda rng: outside.SpinSway("hull", body, 12.0),
            "vortex_shedding": lambda rng: outside.VortexShedding("hull", body, 20.0, rng.uniform(0.15, 0.3)),
            "lopsided_drag": lambda rng: outside.LopsidedDrag("hull", body, 15.0, int(rng.choice([0, 1]))),
            "drifting_gain": lambda rng: outside.DriftingGain("all", 0.1, rng.uniform(4, 9)),
            "tether": lambda rng: outside.Tether("hull", body, np.array([0, 0, -1.0]), rng.uniform(1.0, 1.6), 5.0),
            "density_gradient": lambda rng: outside.DensityGradient("hull", body, 2.0, 2.2),
            "rocking_base": lambda rng: outside.GravityTilt("hull", body, 1.5, rng.uniform(5, 9)),
        }

    def twins(self, model):
        body = model.body("hull").id
        every = list(range(8))
        return {
            # Speeds of one size: a slope and a square differ by a third harmonic.
            "linear_drag": Twin(
                lambda rng: drag.LinearDrag("hull", body, np.array([5, 8, 10, 0, 0, 0])), "gentle", "quadratic_drag"
            ),
            "quadratic_drag": Twin(
                lambda rng: drag.QuadraticDrag("hull", body, np.array([18, 30, 40, 0, 0, 0])), "gentle", "linear_drag"
            ),
            # Slow commands see of a lag only its delay.
            "actuator_lag": Twin(lambda rng: actuator.ActuatorLag("all", every, 0.08), "slow", "actuator_delay"),
            "actuator_delay": Twin(lambda rng: actuator.ActuatorDelay("all", every, 0.05), "slow", "actuator_lag"),
        }

    def style_for(self, kind):
        return {"free_surface": "shallow", "waves": "shallow", "wall_proximity": "deep"}.get(kind, "normal")


#: Which manoeuvres a style cycles through.
_MODES = {
    "normal": ["multisine", "waypoint", "steps", "pulses", "chirp", "multisine", "waypoint", "free", "steps", "keep"],
    "shallow": ["multisine", "waypoint", "chirp", "keep", "waypoint"],
    "deep": ["multisine", "waypoint", "chirp", "keep", "waypoint"],
    "gentle": ["gentle", "keep"],
    "slow": ["slow"],
}


def _depths(rng, trials: int, style: str) -> np.ndarray:
    """World z at which each trial is held [m]."""
    if style == "shallow":
        return -rng.uniform(0.35, 1.3, trials)
    if style == "deep":
        return -6.0 + rng.uniform(0.3, 1.2, trials)
    return -rng.uniform(1.5, 3.0, trials)


def _depth_walk(rng, rows: int, period: float, style: str) -> np.ndarray:
    """Slow changes of the depth to be held [rows] m."""
    size = {"shallow": 0.25, "deep": 0.25, "gentle": 0.1, "slow": 0.2}.get(style, 0.4)
    return size * np.sin(2 * np.pi * np.arange(rows) * period / rng.uniform(7, 14) + rng.uniform(0, 6))


def _way(rng, rows: int, period: float, *, still: bool) -> np.ndarray:
    """x, y, yaw to follow [3, rows], smoothed."""
    out = np.zeros((3, rows))
    if still:
        return out
    at, place = 0, np.zeros(3)
    while at < rows:
        length = int(rng.uniform(3, 5.5) / period)
        place = place + rng.uniform(-1, 1, 3) * [1.4, 1.2, 1.3]
        out[:, at:] = place[:, None]
        at += length
    kernel = np.hanning(int(1.6 / period))
    kernel /= kernel.sum()
    padded = np.concatenate([np.zeros((3, len(kernel))), out], 1)
    return np.stack([np.convolve(row, kernel)[len(kernel) : len(kernel) + rows] for row in padded])


class _Hold:
    """Excitation plus depth hold plus, where wanted, position and heading control from noisy readings."""

    def __init__(self, model, wrench, direct, goals, position_gain, depth_gain, noise, period):
        self.wrench, self.direct, self.goals, self.noise, self.period = wrench, direct, goals, noise, period
        self.position_gain, self.depth_gain = position_gain[:, None], depth_gain
        self.low, self.high = model.actuator_ctrlrange.T
        sites = model.actuator_trnid[:, 0]
        axes = rotation(model.site_quat[sites])[:, :, 2] * model.actuator_gear[:, 2:3]
        allocation = np.concatenate([axes, np.cross(model.site_pos[sites], axes)], 1).T
        self.inverse = np.linalg.pinv(allocation)
        self.sum = np.zeros((len(wrench), 3))

    def tiled(self, count: int) -> "_Hold":
        """The same trials `count` times over."""
        other = object.__new__(_Hold)
        other.__dict__ = dict(self.__dict__)
        for name in ("wrench", "direct", "goals", "position_gain", "depth_gain", "sum"):
            value = getattr(self, name)
            setattr(other, name, np.tile(value, (count,) + (1,) * (value.ndim - 1)))
        other.noise = {name: np.tile(value, (count, 1, 1)) for name, value in self.noise.items()}
        return other

    def __call__(self, row: int, plant) -> np.ndarray:
        goal, noise = self.goals[:, row], self.noise
        position = plant.qpos[:, :3] + noise["position"][:, row]
        turn = rotation(plant.qpos[:, 3:7])
        error = goal[:, :3] - position
        error = np.clip(error, -0.8, 0.8)
        velocity = plant.qvel[:, :3] + noise["nu"][:, row, :3]
        spin = plant.qvel[:, 3:6] + noise["nu"][:, row, 3:]
        gate = np.concatenate([np.repeat(self.position_gain, 2, 1), self.depth_gain[:, None]], 1)
        self.sum = np.clip(self.sum + error * self.period * gate, -1.2, 1.2)
        push = gate * (24 * error + 10 * self.sum - 30 * velocity)
        yaw = np.arctan2(turn[:, 1, 0], turn[:, 0, 0]) + noise["turn"][:, row, 2]
        off = (goal[:, 3] - yaw + np.pi) % (2 * np.pi) - np.pi
        wrench = self.wrench[:, row].copy()
        wrench[:, :3] += turned_back(turn, push)
        wrench[:, 5] += self.position_gain[:, 0] * (5 * np.clip(off, -0.8, 0.8) - 4 * spin[:, 2])
        command = self.direct[:, row] + wrench @ self.inverse.T
        return np.clip(command, self.low, self.high)
