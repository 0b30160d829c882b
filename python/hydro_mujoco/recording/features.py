"""The inputs and outputs of a force model, by name, unit and formula.

Base frame: the frame of the body that the water's wrench acts on. Quaternion `world_from_base`, w x y z. Every function
works on stacks: leading axes are free, the component axis is the last.
"""

from dataclasses import dataclass

import numpy as np

OUTPUTS = ("force.x", "force.y", "force.z", "torque.x", "torque.y", "torque.z")
OUTPUT_UNITS = ("N", "N", "N", "N m", "N m", "N m")
FRAMES = {
    "wrench": "base",
    "angular_velocity": "base",
    "linear_velocity": "base, relative to the water",
    "quaternion": "world_from_base, w x y z",
}


@dataclass(frozen=True)
class Joint:
    """A hinge or slide: its name, its places in qpos and qvel."""

    name: str
    position: int
    velocity: int
    is_slide: bool = False


@dataclass(frozen=True)
class FreeBase:
    """A base with a free joint, whose numbers start at `position` in qpos and at `velocity` in qvel.

    Its qvel is the linear velocity in the world frame, then the angular velocity in the base frame.
    """

    position: int
    velocity: int

    #: All components of velocity and wrench are known.
    axes = (0, 1, 2)
    outputs = (0, 1, 2, 3, 4, 5)

    @property
    def translating(self) -> tuple[int, ...]:
        """Its places in qvel that translate it."""
        return tuple(range(self.velocity, self.velocity + 3))

    def names(self) -> list[str]:
        """Names of its features."""
        return [
            *(f"quaternion.{axis}" for axis in "wxyz"),
            *(f"angular_velocity.{axis}" for axis in "xyz"),
            *(f"linear_velocity.{axis}" for axis in "xyz"),
        ]

    def units(self) -> list[str]:
        """Unit of each."""
        return ["1"] * 4 + ["rad/s"] * 3 + ["m/s"] * 3

    def quaternion(self, qpos: np.ndarray) -> np.ndarray:
        """The attitude [..., 4]."""
        return qpos[..., self.position + 3 : self.position + 7]

    def velocity_of(self, qvel: np.ndarray) -> np.ndarray:
        """Velocity of its origin in the world [..., 3]."""
        return qvel[..., self.velocity : self.velocity + 3]

    def features(self, qpos: np.ndarray, qvel: np.ndarray) -> list[np.ndarray]:
        """Its features of trajectories, time on axis -2."""
        quaternion = self.quaternion(qpos)
        angular = qvel[..., self.velocity + 3 : self.velocity + 6]
        return [continuous(quaternion), angular, base_from_world(quaternion, self.velocity_of(qvel))]

    def wrench(self, qpos: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Wrench [..., 6] of a generalised force [..., nv]."""
        return base_wrench(self.quaternion(qpos), force[..., self.velocity : self.velocity + 6])


@dataclass(frozen=True)
class Carriage:
    """A base that only slides, as under a towing carriage: it keeps its attitude, and has no angular velocity.

    dofs: its slides' places in qvel; directions: their orthogonal unit axes in the base frame, a row each.
    axes: the axes of the base that these span.
    """

    dofs: tuple[int, ...]
    directions: tuple[tuple[float, float, float], ...]
    axes: tuple[int, ...]

    @property
    def outputs(self) -> tuple[int, ...]:
        """The components of the wrench that the slides feel."""
        return self.axes

    def names(self) -> list[str]:
        """Names of its features."""
        return [f"linear_velocity.{'xyz'[axis]}" for axis in self.axes]

    def units(self) -> list[str]:
        """Unit of each."""
        return ["m/s"] * len(self.axes)

    @property
    def translating(self) -> tuple[int, ...]:
        """Its places in qvel that translate it."""
        return self.dofs

    def velocity_of(self, qvel: np.ndarray) -> np.ndarray:
        """Velocity of its origin, in the base frame [..., 3]."""
        return self._in_base(qvel)

    def _in_base(self, values: np.ndarray) -> np.ndarray:
        """A vector [..., 3] of the base frame from its parts along the slides, in an array of all dofs [..., nv]."""
        return sum(values[..., dof, None] * np.array(way) for dof, way in zip(self.dofs, self.directions))

    def features(self, qpos: np.ndarray, qvel: np.ndarray) -> list[np.ndarray]:
        """Its features of trajectories."""
        return [self._in_base(qvel)[..., list(self.axes)]]

    def wrench(self, qpos: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Wrench [..., 6] of a generalised force [..., nv]; what the slides do not feel is 0."""
        along = self._in_base(force)
        return np.concatenate((along, np.zeros_like(along)), axis=-1)


@dataclass(frozen=True)
class Layout:
    """The features of one robot, in order: its joints' positions and velocities, its base, the density if it varies."""

    joints: tuple[Joint, ...]
    base: FreeBase | Carriage
    has_density: bool

    def names(self) -> list[str]:
        """Names of the features."""
        return [
            *(f"position.{joint.name}" for joint in self.joints),
            *(f"velocity.{joint.name}" for joint in self.joints),
            *self.base.names(),
            *(["density"] if self.has_density else []),
        ]

    def units(self) -> list[str]:
        """Unit of each feature."""
        return [
            *("m" if joint.is_slide else "rad" for joint in self.joints),
            *("m/s" if joint.is_slide else "rad/s" for joint in self.joints),
            *self.base.units(),
            *(["kg/m^3"] if self.has_density else []),
        ]

    def features(self, qpos: np.ndarray, qvel: np.ndarray, density: np.ndarray) -> np.ndarray:
        """Features [..., T, n] of trajectories qpos [..., T, nq], qvel [..., T, nv], density [..., T].

        The water is at rest.
        """
        return np.concatenate(
            (
                qpos[..., [joint.position for joint in self.joints]],
                qvel[..., [joint.velocity for joint in self.joints]],
                *self.base.features(qpos, qvel),
                *([density[..., None]] if self.has_density else []),
            ),
            axis=-1,
        )


def base_from_world(quaternion: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Rotate world vectors [..., 3] into the base frame of unit `world_from_base` [..., 4].

    Written out in sums and products, each rounded alone, so that the bytes do not depend on how
    many vectors are rotated at once.
    """
    w, x, y, z = (quaternion[..., i] for i in range(4))
    a, b, c = (vector[..., i] for i in range(3))
    return np.stack(
        (
            (w * w + x * x - y * y - z * z) * a + 2 * (x * y + w * z) * b + 2 * (x * z - w * y) * c,
            2 * (x * y - w * z) * a + (w * w - x * x + y * y - z * z) * b + 2 * (y * z + w * x) * c,
            2 * (x * z + w * y) * a + 2 * (y * z - w * x) * b + (w * w - x * x - y * y + z * z) * c,
        ),
        axis=-1,
    )


def base_wrench(quaternion: np.ndarray, free_joint_force: np.ndarray) -> np.ndarray:
    """Wrench [..., 6] on the base, in the base frame, about the base origin [N, N m].

    `free_joint_force` are the free joint's six rows of a qfrc array: a force in the world frame,
    then a torque about the base origin that is already in the base frame.
    """
    force = base_from_world(quaternion, free_joint_force[..., :3])
    return np.concatenate((force, free_joint_force[..., 3:6]), axis=-1)


def continuous(quaternion: np.ndarray) -> np.ndarray:
    """Choose signs along time, axis -2: w >= 0 at the first sample, no jumps after it."""
    q = quaternion
    dot = sum(q[..., 1:, i] * q[..., :-1, i] for i in range(4))
    sign = np.ones(q.shape[:-1])
    sign[..., 0] = np.where(q[..., 0, 0] < 0, -1.0, 1.0)
    sign[..., 1:] = np.where(dot < 0, -1.0, 1.0)
    return q * np.cumprod(sign, axis=-1)[..., None]
