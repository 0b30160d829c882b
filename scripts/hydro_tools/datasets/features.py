"""The 35 inputs and 6 outputs of a B1 force model, by name, unit and formula.

Base frame: the frame of `trunk`. Quaternion `world_from_base`, w x y z. Every function works on
stacks: leading axes are free, the component axis is the last.
"""

import numpy as np

OUTPUTS = ("force.x", "force.y", "force.z", "torque.x", "torque.y", "torque.z")
OUTPUT_UNITS = ("N", "N", "N", "N m", "N m", "N m")
FRAMES = {
    "wrench": "base",
    "angular_velocity": "base",
    "linear_velocity": "base, relative to the water",
    "quaternion": "world_from_base, w x y z",
}


def names(joints: tuple[str, ...]) -> list[str]:
    """Feature names in order, for a floating robot with these joints."""
    return [
        *(f"position.{joint}" for joint in joints),
        *(f"velocity.{joint}" for joint in joints),
        *(f"quaternion.{axis}" for axis in "wxyz"),
        *(f"angular_velocity.{axis}" for axis in "xyz"),
        *(f"linear_velocity.{axis}" for axis in "xyz"),
        "density",
    ]


def units(joints: tuple[str, ...]) -> list[str]:
    """Unit of each feature."""
    nj = len(joints)
    return ["rad"] * nj + ["rad/s"] * nj + ["1"] * 4 + ["rad/s"] * 3 + ["m/s"] * 3 + ["kg/m^3"]


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


def features(qpos: np.ndarray, qvel: np.ndarray, density: np.ndarray) -> np.ndarray:
    """Features [..., T, 35] of trajectories qpos [..., T, 19], qvel [..., T, 18], density [..., T].

    The free joint comes first: its qvel is the linear velocity in the world frame, then the
    angular velocity in the base frame. The water is at rest.
    """
    quaternion = qpos[..., 3:7]
    return np.concatenate(
        (
            qpos[..., 7:],
            qvel[..., 6:],
            continuous(quaternion),
            qvel[..., 3:6],
            base_from_world(quaternion, qvel[..., :3]),
            density[..., None],
        ),
        axis=-1,
    )
