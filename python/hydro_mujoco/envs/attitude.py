"""Rotations of arrays, by sums and products alone: a row's bits do not depend on how many rows there are."""

import numpy as np


def rotation(quaternion: np.ndarray) -> np.ndarray:
    """Matrices world_from_body, shape (n, 3, 3), of unit quaternions w x y z, shape (n, 4)."""
    w, x, y, z = quaternion.T
    rows = np.empty((len(quaternion), 3, 3))
    rows[:, 0, 0], rows[:, 0, 1], rows[:, 0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
    rows[:, 1, 0], rows[:, 1, 1], rows[:, 1, 2] = 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
    rows[:, 2, 0], rows[:, 2, 1], rows[:, 2, 2] = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)
    return rows


def to_body(world_from_body: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Vectors of the world, shape (n, 3), in the axes of bodies, world_from_body (n, 3, 3)."""
    return (
        world_from_body[:, 0] * vectors[:, :1]
        + world_from_body[:, 1] * vectors[:, 1:2]
        + world_from_body[:, 2] * vectors[:, 2:]
    )


def dot(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Scalar products, shape (n,), of vectors, shape (n, 3)."""
    return first[:, 0] * second[:, 0] + first[:, 1] * second[:, 1] + first[:, 2] * second[:, 2]


def length(vectors: np.ndarray) -> np.ndarray:
    """Euclidean lengths, shape (n,), of vectors, shape (n, 3)."""
    return np.sqrt(dot(vectors, vectors))


def about_z(angle: float) -> np.ndarray:
    """Quaternion w x y z of a turn about the vertical [rad], shape (4,)."""
    return np.array([np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2)])


def about_axis(axis: np.ndarray, angle: float) -> np.ndarray:
    """Quaternion w x y z of a turn about an axis of any length [rad], shape (4,)."""
    return np.array([np.cos(angle / 2), *(np.sin(angle / 2) * axis / np.sqrt(axis @ axis))])


def product(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Product of two quaternions w x y z, shape (4,): the second turn, then the first."""
    w, x, y, z = first
    a, b, c, d = second
    return np.array(
        [
            w * a - x * b - y * c - z * d,
            w * b + x * a + y * d - z * c,
            w * c - x * d + y * a + z * b,
            w * d + x * c - y * b + z * a,
        ]
    )
