"""Frames of vectors and of attitudes."""

import mujoco
import numpy as np

from ..errors import DataError

#: Frame -> the rotation from it into ENU, for frames of the world, or into FLU, for frames of a body.
WORLD = {
    "ENU": np.eye(3),
    "NED": np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]),
    "NWU": np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
}
BODY = {"FLU": np.eye(3), "FRD": np.diag([1.0, -1.0, -1.0])}
#: Latitude, longitude and height: a position in the world, but no axes.
GEODETIC = "WGS84"
#: The frame of a body that goes with one of the world.
PAIRS = {"ENU": "FLU", "NWU": "FLU", "NED": "FRD"}


def rotation(frame: str, into: str) -> np.ndarray:
    """The matrix that turns a vector's components in `frame` into those in `into`; both of the world, or of a body."""
    frames = WORLD if frame in WORLD else BODY
    return frames[into].T @ frames[frame]


def pair(frame: str) -> tuple[str, str]:
    """Frames of world and body of an attitude: `NED/FRD`, or `NED` for the usual one."""
    world, _, body = frame.partition("/")
    return world, body or PAIRS[world]


def check(frame: str, kind: str | None, where: str) -> None:
    """Refuse a frame that is none of its kind: `world`, `body`, `attitude`, or None for what has no frame."""
    if kind == "attitude":
        world, _, body = frame.partition("/")
        fits, expected = world in WORLD and (not body or body in BODY), "NED, ENU, NED/FRD, ENU/FLU, NWU/FLU"
    else:
        frames = {"world": WORLD, "body": BODY}.get(kind or "", {})
        fits, expected = frame in frames, " or ".join(frames)
    if fits:
        return
    if kind is None:
        raise DataError(f"{where}: frame `{frame}` given, and a single number has none; `scale = -1` turns its sign")
    what = {"world": "reads in the world", "body": "reads in the frame of a body", "attitude": "is an attitude"}[kind]
    raise DataError(f"{where}: frame `{frame}`, but this {what}; expected {expected}")


def matrices(quaternions: np.ndarray) -> np.ndarray:
    """Rotation matrices (n, 3, 3) of unit quaternions w x y z, (n, 4)."""
    w, x, y, z = quaternions.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def product(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Products of quaternions w x y z, (..., 4)."""
    a, b = np.moveaxis(one, -1, 0), np.moveaxis(other, -1, 0)
    return np.stack(
        [
            a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
            a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
        ],
        axis=-1,
    )


def inverse(quaternions: np.ndarray) -> np.ndarray:
    """The inverse of unit quaternions."""
    return quaternions * np.array([1.0, -1.0, -1.0, -1.0])


def from_matrix(matrix: np.ndarray) -> np.ndarray:
    """The quaternion w x y z of a rotation matrix (3, 3)."""
    found = np.zeros(4)
    mujoco.mju_mat2Quat(found, np.ascontiguousarray(matrix).ravel())
    return found


def from_euler(angles: np.ndarray) -> np.ndarray:
    """Quaternions of roll, pitch and yaw [rad], (n, 3): yaw about z first, then pitch about y, then roll about x."""
    half = 0.5 * angles
    (cr, cp, cy), (sr, sp, sy) = np.cos(half).T, np.sin(half).T
    return np.stack(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ],
        axis=-1,
    )


def attitude(quaternions: np.ndarray, frame: str, into: tuple[str, str]) -> np.ndarray:
    """Quaternions of `frame` in the model's frames `into`, of world and body; unit, continuous, w >= 0 at first."""
    world, body = pair(frame)
    outer, inner = from_matrix(rotation(world, into[0])), from_matrix(rotation(body, into[1]).T)
    turned = product(product(outer, quaternions), inner)
    return continuous(turned / np.linalg.norm(turned, axis=-1, keepdims=True))


def continuous(quaternions: np.ndarray) -> np.ndarray:
    """The same rotations, each quaternion on the side of the one before it; w >= 0 at first. Rows that are NaN stay."""
    found = quaternions.copy()
    make_continuous(found)
    return found


def make_continuous(found: np.ndarray) -> None:
    """`continuous`, in place."""
    rows = np.flatnonzero(np.isfinite(found).all(1))
    if rows.size:
        whole = found[rows]
        signs = np.where((whole[1:] * whole[:-1]).sum(1) < 0, -1.0, 1.0)
        first = -1.0 if whole[0, 0] < 0 else 1.0
        found[rows] = whole * (first * np.concatenate([[1.0], np.cumprod(signs)]))[:, None]
