"""Rotations of M bodies at once. Quaternions are `world_from_base`, w x y z."""

import numpy as np


def rotation(q: np.ndarray) -> np.ndarray:
    """`world_from_base` matrices [..., 3, 3] of unit quaternions [..., 4]."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    return np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], -1),
            np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], -1),
            np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], -1),
        ],
        -2,
    )


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Hamilton product of quaternions [..., 4]."""
    aw, ax, ay, az = np.moveaxis(a, -1, 0)
    bw, bx, by, bz = np.moveaxis(b, -1, 0)
    return np.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        -1,
    )


def exponential(v: np.ndarray) -> np.ndarray:
    """Quaternions [..., 4] of rotation vectors [..., 3] rad."""
    angle = np.linalg.norm(v, axis=-1, keepdims=True)
    return np.concatenate([np.cos(angle / 2), v * 0.5 * np.sinc(angle / (2 * np.pi))], -1)


def difference(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Rotation vector [..., 3] rad from attitude b to attitude a, in the body's frame; the short way."""
    conjugate = b * np.array([1.0, -1.0, -1.0, -1.0])
    d = product(conjugate, a)
    d = d * np.where(d[..., :1] < 0, -1.0, 1.0)
    length = np.linalg.norm(d[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(length, d[..., :1])
    return d[..., 1:] * np.where(length > 1e-12, angle / np.maximum(length, 1e-12), 2.0)


def turned(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """R v for R [M, 3, 3], v [M, 3]."""
    return np.matmul(matrix, vector[..., None])[..., 0]


def turned_back(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """R^T v for R [M, 3, 3], v [M, 3]."""
    return np.matmul(vector[..., None, :], matrix)[..., 0, :]


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a x b over the last axis; several times quicker than numpy's for small arrays."""
    a, b = np.broadcast_arrays(a, b)
    out = np.empty(a.shape)
    out[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    out[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    out[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return out
