"""Effects that no catalogue entry describes: the right answer is `unknown`, or a marked surrogate."""

import numpy as np

from ..frames import turned_back
from .base import Effect


class _Outside(Effect):
    def __init__(self, target: str, parameters):
        super().__init__(target, parameters, comparable=False)


class ThrusterInteraction(_Outside):
    """Neighbouring thrusters spoil each other: u_i loses a part of |u_j| sign(u_i) while both push."""

    kind = "thruster_interaction"

    def __init__(self, target: str, pairs: list[tuple[int, int]], loss: float):
        super().__init__(target, {"loss": (loss, "1")})
        self.pairs, self.loss = pairs, loss
        self.most = 1.2 / loss

    def command(self, plant, asked):
        out = asked.copy()
        for i, j in self.pairs:
            both = np.abs(asked[:, i] * asked[:, j])
            cut = self.scale[:, 0] * self.loss * both / (0.1 + np.abs(asked[:, i]))
            out[:, i] -= np.sign(asked[:, i]) * np.minimum(cut, np.abs(asked[:, i]))
        return out


class SpinSway(_Outside):
    """A side force from yaw rate times surge speed, well beyond any added mass (a Magnus-like force)."""

    kind = "spin_sway"

    def __init__(self, target: str, body: int, coefficient: float):
        super().__init__(target, {"coefficient": (coefficient, "kg")})
        self.body, self.coefficient = body, coefficient

    def force(self, plant):
        motion = plant.hull(self.body)
        force = np.zeros((plant.members, 3))
        force[:, 1] = self.coefficient * motion.omega[:, 2] * motion.nu[:, 0] * np.abs(motion.omega[:, 2]) / 0.4
        plant.add_hull_wrench(self.body, self.scale * force)


class VortexShedding(_Outside):
    """A side force at the Strouhal frequency of the present speed."""

    kind = "vortex_shedding"

    def __init__(self, target: str, body: int, coefficient: float, diameter: float):
        super().__init__(target, {"coefficient": (coefficient, "N s^2/m^2"), "diameter": (diameter, "m")})
        self.body, self.coefficient, self.diameter = body, coefficient, diameter

    def fixed(self):
        return {"diameter"}

    def begin(self, plant):
        self.phase = np.zeros(plant.members)

    def force(self, plant):
        motion = plant.hull(self.body)
        speed = np.linalg.norm(motion.nu[:, :2], axis=1)
        self.phase += 2 * np.pi * 0.2 * speed / self.diameter * plant.step_length
        size = self.scale[:, 0] * self.coefficient * speed * np.sin(self.phase)
        force = np.zeros((plant.members, 3))
        force[:, 0], force[:, 1] = -size * motion.nu[:, 1], size * motion.nu[:, 0]
        plant.add_hull_wrench(self.body, force)


class LopsidedDrag(_Outside):
    """Drag that acts only astern (the hull's blunt end first)."""

    kind = "lopsided_drag"

    def __init__(self, target: str, body: int, coefficient: float, axis: int = 0):
        super().__init__(target, {"coefficient": (coefficient, "N s^2/m^2")})
        self.body, self.coefficient, self.axis = body, coefficient, axis

    def force(self, plant):
        u = plant.hull(self.body).nu[:, self.axis]
        force = np.zeros((plant.members, 3))
        force[:, self.axis] = self.coefficient * (u * u * (u < 0) - 0.7 * u * u * (u > 0))
        plant.add_hull_wrench(self.body, self.scale * force)


class DriftingGain(_Outside):
    """Actuators that weaken as they warm up: a gain that falls over a trial and returns when they rest."""

    kind = "drifting_gain"

    def __init__(self, target: str, loss: float, settle: float = 6.0):
        super().__init__(target, {"loss": (loss, "1"), "settle": (settle, "s")})
        self.loss, self.settle = loss, settle
        self.most = 0.8 / loss

    def fixed(self):
        return {"settle"}

    def begin(self, plant):
        self.heat = np.zeros((plant.members, plant.model.nu))

    def command(self, plant, asked):
        load = np.abs(asked - asked.mean(1, keepdims=True)) / (np.abs(asked).max() + 1e-9)
        self.heat += plant.step_length / self.settle * (load - self.heat)
        return asked * (1 - self.scale * self.loss * np.minimum(self.heat * 3, 1.0))


class Tether(_Outside):
    """A tether that pulls only when it is taut: spring beyond its slack length, with a little damping."""

    kind = "tether"

    def __init__(self, target: str, body: int, anchor: np.ndarray, slack: float, stiffness: float):
        super().__init__(target, {"stiffness": (stiffness, "N/m"), "slack": (slack, "m")})
        self.body, self.anchor, self.slack, self.stiffness = body, np.asarray(anchor, float), slack, stiffness

    def fixed(self):
        return {"slack"}

    def force(self, plant):
        reach = plant.xpos[:, self.body] - self.anchor
        length = np.linalg.norm(reach, axis=1, keepdims=True) + 1e-9
        taut = np.maximum(length - self.slack, 0.0)
        plant.add_world_force(self.body, -self.scale * self.stiffness * taut * reach / length)


class DensityGradient(_Outside):
    """Stratified water: buoyancy that grows with depth below a halocline."""

    kind = "density_gradient"

    def __init__(self, target: str, body: int, strength: float, depth: float):
        super().__init__(target, {"strength": (strength, "N"), "depth": (depth, "m")})
        self.body, self.strength, self.depth = body, strength, depth

    def fixed(self):
        return {"depth"}

    def force(self, plant):
        below = -plant.xpos[:, self.body, 2] - self.depth
        up = np.zeros((plant.members, 3))
        up[:, 2] = self.strength * np.tanh(below / 0.25)
        plant.add_world_force(self.body, self.scale * up)


class GearRipple(_Outside):
    """A torque with the joint angle: the cogging of a gear."""

    kind = "gear_ripple"

    def __init__(self, target: str, dof: int, at: int, torque: float, teeth: int):
        super().__init__(target, {"torque": (torque, "N m"), "teeth": (float(teeth), "1")})
        self.dof, self.at, self.torque, self.teeth = dof, at, torque, teeth

    def fixed(self):
        return {"teeth"}

    def force(self, plant):
        plant.qfrc[:, self.dof] += self.scale[:, 0] * self.torque * np.sin(self.teeth * plant.qpos[:, self.at])


class CrossCoupling(_Outside):
    """A joint that feels the other's speed: a hose between two links."""

    kind = "joint_cross_coupling"

    def __init__(self, target: str, dof: int, other: int, torque: float):
        super().__init__(target, {"torque": (torque, "N m s/rad")})
        self.dof, self.other, self.torque = dof, other, torque

    def force(self, plant):
        v = plant.qvel[:, self.other]
        plant.qfrc[:, self.dof] += self.scale[:, 0] * self.torque * v * np.abs(v) / (0.5 + np.abs(v))


class GravityTilt(_Outside):
    """A base that rocks slowly: a horizontal pull on the body that turns with time."""

    kind = "rocking_base"

    def __init__(self, target: str, body: int, force: float, period: float):
        super().__init__(target, {"force": (force, "N"), "period": (period, "s")})
        self.body, self.size, self.period = body, force, period

    def fixed(self):
        return {"period"}

    def force(self, plant):
        angle = 2 * np.pi * plant.time / self.period
        world = np.stack([np.cos(angle), np.sin(2.3 * angle + 0.7), np.zeros_like(angle)], 1) * self.size
        motion = plant.hull(self.body)
        plant.add_hull_wrench(self.body, self.scale * turned_back(motion.rotation, world))
