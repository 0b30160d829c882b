"""Closed shapes of geoms."""

from dataclasses import dataclass, field

import mujoco
import numpy as np

GEOM = mujoco.mjtGeom
#: Kinds of solids.
ELLIPSOID, TRIANGLES, CYLINDER, CAPSULE = 0, 1, 2, 3
#: Geoms that are one, with their kind; a mesh and a box are triangles.
KINDS = {
    GEOM.mjGEOM_SPHERE: ELLIPSOID,
    GEOM.mjGEOM_ELLIPSOID: ELLIPSOID,
    GEOM.mjGEOM_CYLINDER: CYLINDER,
    GEOM.mjGEOM_CAPSULE: CAPSULE,
}
#: Corners and outward triangles of a box of half sizes one.
_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
_FACES = np.array(
    [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ]
)  # fmt: skip


@dataclass(frozen=True)
class Solid:
    """A closed shape on a body, in its frame.

    Attributes:
        kind: `ELLIPSOID`, ... centre: [m], shape (3,). axes: the shape's own as columns, shape (3, 3).
        size: semi-axes of an ellipsoid; radius and half length about z of a cylinder, and of that in a capsule [m].
        triangles: corners [m], wound outwards, shape (n, 3, 3); none for the other kinds.
    """

    kind: int
    centre: np.ndarray
    axes: np.ndarray
    size: np.ndarray = field(default_factory=lambda: np.zeros(3))
    triangles: np.ndarray = field(default_factory=lambda: np.zeros((0, 3, 3)))

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        if self.kind == TRIANGLES:
            return float(np.linalg.det(self.triangles - self.centre).sum() / 6)
        if self.kind == ELLIPSOID:
            return float(4 / 3 * np.pi * np.prod(self.size))
        radius, half_length, _ = self.size
        ends = 4 / 3 * radius if self.kind == CAPSULE else 0.0
        return float(np.pi * radius**2 * (2 * half_length + ends))

    @property
    def centre_of_volume(self) -> np.ndarray:
        """Centre of its volume [m], shape (3,)."""
        if self.kind != TRIANGLES:
            return self.centre
        weights = np.linalg.det(self.triangles - self.centre)
        middles = (self.triangles.sum(axis=1) + self.centre) / 4
        return (weights[:, np.newaxis] * middles).sum(axis=0) / weights.sum()

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest coordinates [m]."""
        if self.kind == TRIANGLES:
            corners = self.triangles.reshape(-1, 3)
            return corners.min(axis=0), corners.max(axis=0)
        if self.kind == ELLIPSOID:
            reach = np.sqrt(((self.axes * self.size) ** 2).sum(axis=1))
        else:
            along = np.abs(self.axes[:, 2])
            rim = 1.0 if self.kind == CAPSULE else np.sqrt(np.maximum(1 - along**2, 0))
            reach = along * self.size[1] + rim * self.size[0]
        return self.centre - reach, self.centre + reach


def solid_of(model: mujoco.MjModel, geom: int, body: int) -> Solid | None:
    """The shape of a geom in a body's frame; None where it encloses nothing. An ellipsoid for an open mesh."""
    kind, size = GEOM(model.geom_type[geom]), np.array(model.geom_size[geom])
    place, axes = geom_pose(model, geom, body)
    if kind == GEOM.mjGEOM_SPHERE:
        size = np.full(3, size[0])
    if kind in KINDS:
        return Solid(KINDS[kind], place, axes, size)
    if kind == GEOM.mjGEOM_BOX:
        triangles = (_CORNERS * size)[_FACES]
    elif kind == GEOM.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        first, start = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]
        corners = model.mesh_vert[first : first + model.mesh_vertnum[mesh]].astype(float)
        faces = model.mesh_face[start : start + model.mesh_facenum[mesh]]
        if not _is_closed(faces):
            return Solid(ELLIPSOID, place, axes, size)
        triangles = corners[faces]
    else:
        return None
    return Solid(TRIANGLES, place, axes, triangles=place + triangles @ axes.T)


def geom_pose(model: mujoco.MjModel, geom: int, body: int) -> tuple[np.ndarray, np.ndarray]:
    """Place [m] and axes, as columns, of a geom in a body at or above its own, in the model's initial position."""
    place, axes = np.array(model.geom_pos[geom]), _rotation(model.geom_quat[geom])
    link = int(model.geom_bodyid[geom])
    while link not in (body, 0):
        turn = _rotation(model.body_quat[link])
        place, axes = model.body_pos[link] + turn @ place, turn @ axes
        link = int(model.body_parentid[link])
    return place, axes


def _rotation(quaternion: np.ndarray) -> np.ndarray:
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)


def _is_closed(faces: np.ndarray) -> bool:
    """True where every edge is there once in each direction."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    there = {(int(a), int(b)) for a, b in edges}
    return len(there) == len(edges) and all((b, a) in there for a, b in there)
