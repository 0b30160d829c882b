"""Closed meshes in NumPy, without the plugin: what of them is under water, and the mass of what they hold.

Everything is a sum over triangles, by the divergence theorem. The surface is z = 0: the cut there adds nothing to a
volume that is counted from the origin of the plane, and the projection of the wet faces on it is the waterplane.
"""

from typing import NamedTuple

import numpy as np


class Wet(NamedTuple):
    """The part of a solid below z = 0."""

    volume: float
    #: Centre [3] m.
    centre: np.ndarray
    #: Of the waterplane [m^2], and its centre [2] m.
    area: float
    middle: np.ndarray
    #: Second moments of the waterplane about the axes along x and y through its centre [m^4].
    across: float
    along: float


def below(corners: np.ndarray) -> list[np.ndarray]:
    """The triangles [3, 3] of what is below z = 0 of one triangle."""
    kept = []
    for one, other in zip(corners, np.roll(corners, -1, axis=0)):
        if one[2] < 0:
            kept.append(one)
        if (one[2] < 0) != (other[2] < 0):
            kept.append(one + one[2] / (one[2] - other[2]) * (other - one))
    return [np.array([kept[0], kept[k], kept[k + 1]]) for k in range(1, len(kept) - 1)]


def wet(points: np.ndarray, faces: np.ndarray) -> Wet:
    """What is under water of the solid with these corners [n, 3] m in the world and outward faces [m, 3]."""
    triangles = np.array([part for face in faces for part in below(points[face])])
    a, b, c = triangles.transpose(1, 0, 2)
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6
    centre = volumes @ (a + b + c) / 4 / volumes.sum()
    # The wet faces from above: those that look down count, those that look up are taken off.
    areas = -np.cross(b - a, c - a)[:, 2] / 2
    x, y = (a + b + c)[:, :2].T
    area = areas.sum()
    middle = np.array([areas @ x, areas @ y]) / 3 / area
    squares = np.array([areas @ (total**2 + (triangles[:, :, k] ** 2).sum(1)) / 12 for k, total in ((0, x), (1, y))])
    along, across = squares - area * middle**2
    return Wet(volumes.sum(), centre, area, middle, across, along)


def solid(points: np.ndarray, faces: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Volume, centre [3] and inertia [3, 3] about the centre of a solid of density 1."""
    a, b, c = points[faces].transpose(1, 0, 2)
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6
    centre = volumes @ (a + b + c) / 4 / volumes.sum()
    a, b, c = a - centre, b - centre, c - centre
    products = sum(np.einsum("k,ki,kj->ij", volumes, one, one) for one in (a, b, c, a + b + c)) / 20
    return volumes.sum(), centre, np.trace(products) * np.eye(3) - products


def wigley(length: float, breadth: float, draught: float, freeboard: float, stations: int, lines: int):
    """Corners and outward faces of a Wigley hull: y = B/2 (1 - (2x/L)^2) (1 - (z/T)^2) below z = 0, wall-sided above."""
    # Finer towards the ends and the keel, where the sides turn.
    x = 0.5 * length * np.sin(np.linspace(-0.5 * np.pi, 0.5 * np.pi, stations))
    z = np.append(-draught * np.cos(np.linspace(0, 0.5 * np.pi, lines)), freeboard)
    half = 0.5 * breadth * np.outer(1 - (2 * x / length) ** 2, np.append(1 - (z[:-1] / draught) ** 2, 1))
    half[[0, -1]] = half[:, 0] = 0  # stems and keel
    known, points = {}, []

    def corner(i: int, j: int, side: int) -> int:
        place = (x[i], side * half[i, j] + 0.0, z[j])
        if place not in known:
            known[place] = len(points)
            points.append(place)
        return known[place]

    faces = []

    def quad(forward: int, *corners: int) -> None:
        # Ends mirror each other, their diagonals too.
        corners = corners[forward:] + corners[:forward]
        for face in (corners[:3], (corners[0], *corners[2:])):
            if len(set(face)) == 3:
                faces.append(face)

    for i in range(stations - 1):
        forward = int(x[i] + x[i + 1] > 0)
        for j in range(lines):
            quad(forward, corner(i, j, 1), corner(i, j + 1, 1), corner(i + 1, j + 1, 1), corner(i + 1, j, 1))
            quad(forward, corner(i, j, -1), corner(i + 1, j, -1), corner(i + 1, j + 1, -1), corner(i, j + 1, -1))
        deck = [corner(i, lines, -1), corner(i + 1, lines, -1), corner(i + 1, lines, 1), corner(i, lines, 1)]
        quad(forward, *deck)
    return np.array(points), np.array(faces)
