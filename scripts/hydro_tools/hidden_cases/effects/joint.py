"""Forces in a hinge or slide that the nominal lacks."""

import numpy as np

from .base import Effect


class _Joint(Effect):
    """On the joint at `dof` (velocity index) and `at` (position index)."""

    def __init__(self, target: str, dof: int, at: int, parameters):
        super().__init__(target, parameters)
        self.dof, self.at = dof, at


class JointFriction(_Joint):
    """Coulomb friction smoothed over `smooth` [rad/s or m/s], 15 % more (Stribeck) below five times that speed."""

    kind = "joint_friction"

    def __init__(self, target, dof, at, coulomb: float, smooth: float = 0.02):
        super().__init__(target, dof, at, {"coulomb": (coulomb, "N m")})
        self.smooth = smooth

    def force(self, plant):
        v = plant.qvel[:, self.dof]
        friction = (
            self.value("coulomb") * np.tanh(v / self.smooth) * (1 + 0.15 * np.exp(-((v / (5 * self.smooth)) ** 2)))
        )
        torque = self.scale[:, 0] * friction
        self.note(("coulomb",), np.sign(v)[:, None], torque[:, None])
        plant.qfrc[:, self.dof] -= torque


class JointDamping(_Joint):
    """Viscous, with 5 % shear thinning a rad/s."""

    kind = "joint_damping"

    def __init__(self, target, dof, at, damping: float):
        super().__init__(target, dof, at, {"damping": (damping, "N m s/rad")})

    def force(self, plant):
        v = plant.qvel[:, self.dof]
        torque = self.scale[:, 0] * self.value("damping") * v / (1 + 0.05 * np.abs(v))
        self.note(("damping",), v[:, None], torque[:, None])
        plant.qfrc[:, self.dof] -= torque


class JointStiffness(_Joint):
    """A spring that stiffens a little: k d (1 + 0.15 d^2)."""

    kind = "joint_stiffness"

    def __init__(self, target, dof, at, stiffness: float, reference: float):
        super().__init__(target, dof, at, {"stiffness": (stiffness, "N m/rad"), "reference": (reference, "rad")})
        self.reference = reference

    def fixed(self):
        return {"reference"}

    def force(self, plant):
        d = plant.qpos[:, self.at] - self.reference
        torque = self.scale[:, 0] * self.value("stiffness") * d * (1 + 0.15 * d * d)
        self.note(("stiffness",), d[:, None], torque[:, None])
        plant.qfrc[:, self.dof] -= torque


class JointArmature(_Joint):
    """Inertia of a rotor through its gear, in the engine itself."""

    kind = "joint_armature"

    def __init__(self, target, dof, at, armature: float):
        super().__init__(target, dof, at, {"armature": (armature, "kg m^2")})

    def begin(self, plant):
        armature = plant.batch.expand("dof_armature").reshape(plant.members, -1)
        armature[:, self.dof] += self.scale[:, 0] * self.value("armature")
