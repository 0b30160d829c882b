"""Spheres as meshes."""

import numpy as np


def sphere(name: str, level: int) -> str:
    """An icosphere of radius 0.5 m as an MJCF asset; 20 * 4^level triangles."""
    t = (1 + 5**0.5) / 2
    points = [(-1, t, 0), (1, t, 0), (-1, -t, 0), (1, -t, 0), (0, -1, t), (0, 1, t)]
    points += [(0, -1, -t), (0, 1, -t), (t, 0, -1), (t, 0, 1), (-t, 0, -1), (-t, 0, 1)]
    points = [np.array(p) / np.linalg.norm(p) for p in points]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6)]
    faces += [(7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10)]
    faces += [(8, 6, 7), (9, 8, 1)]
    for _ in range(level):
        known, finer = {}, []

        def middle(a, b, known=known):
            key = (min(a, b), max(a, b))
            if key not in known:
                centre = points[a] + points[b]
                points.append(centre / np.linalg.norm(centre))
                known[key] = len(points) - 1
            return known[key]

        for a, b, c in faces:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        faces = finer
    vertices = " ".join(f"{0.5 * x:.6f}" for point in points for x in point)
    return f'<mesh name="{name}" vertex="{vertices}" face="{" ".join(str(i) for face in faces for i in face)}"/>'
