"""Weight, buoyancy and constant loads."""

import numpy as np

from ..frames import cross, turned_back
from .base import Effect, one_by_one

GRAVITY = 9.81


class NetBuoyancy(Effect):
    """A vertical force at the centre of the displaced volume; 0.4 % of it lost a metre of depth."""

    kind = "net_buoyancy"

    def __init__(self, target: str, body: int, force: float, centre: np.ndarray):
        super().__init__(target, {"force": (force, "N")})
        self.body, self.centre = body, np.asarray(centre, float)

    def force(self, plant):
        motion = plant.body(self.body)
        up = np.zeros((plant.members, 3))
        up[:, 2] = self.scale[:, 0] * self.value("force") * (1 + 0.004 * motion.position[:, 2])
        local = turned_back(motion.rotation, up)
        plant.add_wrench(self.body, local, cross(self.centre, local))


class ConstantForce(Effect):
    """A constant force in the world, at the middle of the hull."""

    kind = "constant_force"

    def __init__(self, target: str, body: int, force: np.ndarray):
        super().__init__(target, {axis: (float(f), "N") for axis, f in zip("xyz", force) if f != 0.0})
        self.body, self.vector_n = body, np.asarray(force, float)

    def parts(self):
        return [ConstantForce(self.target, self.body, 2.0 * axis) for axis in np.eye(3)]

    def force(self, plant):
        force = turned_back(plant.body(self.body).rotation, np.broadcast_to(self.vector_n, (plant.members, 3)))
        plant.add_hull_wrench(self.body, self.scale * force)


class BuoyancyOffset(Effect):
    """The centre of buoyancy off by r: a couple r x B up."""

    kind = "buoyancy_offset"

    def __init__(self, target: str, body: int, offset: np.ndarray, displaced_weight: float):
        super().__init__(target, {axis: (float(r), "m") for axis, r in zip("xyz", offset) if r != 0.0})
        self.body, self.offset, self.weight = body, np.asarray(offset, float), displaced_weight
        self.most = 0.05 / max(np.abs(offset).max(), 1e-9)

    def parts(self):
        return [BuoyancyOffset(self.target, self.body, part, self.weight) for part in one_by_one(self.offset)]

    def force(self, plant):
        motion = plant.body(self.body)
        up = self.weight * motion.rotation[:, 2, :]
        torque = cross(self.offset, up)
        plant.add_wrench(self.body, np.zeros((plant.members, 3)), self.scale * torque)


class Payload(Effect):
    """A small carried mass with a little extent: its inertia (implicit) and its weight in water."""

    kind = "payload"
    implicit = True

    def __init__(self, target: str, body: int, mass: float, place: np.ndarray):
        names = {"mass": (mass, "kg")} | {axis: (float(r), "m") for axis, r in zip("xyz", place)}
        super().__init__(target, names)
        self.body, self.mass, self.place = body, mass, np.asarray(place, float)
        skew = _skew(self.place)
        # A ball of 3 cm radius of gyration, not a point.
        rotary = np.eye(3) * 0.03**2 - skew @ skew
        self.unit = mass * np.block([[np.eye(3), -skew], [skew, rotary]])
        self.most = 4.0 / mass

    def fixed(self):
        return {"x", "y", "z"}

    def parts(self):
        places = np.concatenate([np.zeros((1, 3)), 0.2 * np.eye(3)])
        return [Payload(self.target, self.body, self.mass, place) for place in places]

    def force(self, plant):
        motion = plant.body(self.body)
        inertia = self.scale[:, :, None] * self.unit
        nu, omega = motion.nu_ground, motion.omega
        # Linear and angular momentum of the load, turned with the body.
        twist = np.concatenate([nu, omega], 1)
        momentum = np.matmul(inertia, twist[..., None])[..., 0]
        bias = np.concatenate(
            [cross(omega, momentum[:, :3]), cross(nu, momentum[:, :3]) + cross(omega, momentum[:, 3:])], 1
        )
        plant.add_inertia(self.body, np.broadcast_to(inertia, (plant.members, 6, 6)), bias)
        weight = np.zeros((plant.members, 3))
        weight[:, 2] = -self.scale[:, 0] * self.mass * GRAVITY
        local = turned_back(motion.rotation, weight)
        plant.add_wrench(self.body, local, cross(self.place, local))


def _skew(v: np.ndarray) -> np.ndarray:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
