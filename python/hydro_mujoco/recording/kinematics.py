"""A robot's links as the tree in a manifest: centre and longest axis of each, joint to its parent.

A link is a body that water acts on. SI units; vectors in the link's frame, `origin` and `rotation` (w x y z) in the
parent's.
"""

from collections.abc import Mapping

import mujoco
import numpy as np

from ..errors import DataError

KINDS = {int(mujoco.mjtJoint.mjJNT_HINGE): "hinge", int(mujoco.mjtJoint.mjJNT_SLIDE): "slide"}
#: Share of the robot's mass below which a body has no water of its own.
NEGLIGIBLE = 1e-4
#: Links of a tree at most (crates/model/src/kinematics.rs).
MOST_LINKS = 64


def tree(model: mujoco.MjModel, base: int, wet: Mapping[int, tuple[list[float], list[float]]]) -> dict:
    """The manifest's `kinematics`, of the bodies at and below `base` that are `wet`.

    wet: by body, the point where its water acts and its long axis, as `hulls` or `boxes` give them.
    """
    links: list[dict] = []
    places: dict[int, int] = {}
    for body in below(model, base):
        if body not in wet:
            continue
        centre, along = wet[body]
        link = {
            "name": model.body(body).name,
            "origin": [0.0, 0.0, 0.0],
            "rotation": [1.0, 0.0, 0.0, 0.0],
            "centre": centre,
            "along": along,
        }
        if body != base:
            link |= _hung(model, body, base, places)
        places[body] = len(links)
        links.append(link)
    if len(links) > MOST_LINKS:
        raise DataError(f"{len(links)} links, {MOST_LINKS} at most")
    return {"links": links}


def below(model: mujoco.MjModel, base: int) -> list[int]:
    """The bodies at and below a body."""
    found = {base}
    for body in range(base + 1, model.nbody):
        if int(model.body_parentid[body]) in found:
            found.add(body)
    return sorted(found)


def hulls(model: mujoco.MjModel, base: int) -> dict[int, tuple[list[float], list[float]]]:
    """The bodies with a geom in MuJoCo's ellipsoid fluid; of several geoms the largest counts."""
    found = {}
    for body in below(model, base):
        first, count = model.body_geomadr[body], model.body_geomnum[body]
        geoms = [g for g in range(first, first + count) if model.geom_fluid[g, 0] > 0]
        if geoms:
            hull = max(geoms, key=lambda g: np.prod(model.geom_size[g]))
            along = _axis(model.geom_quat[hull], int(np.argmax(model.geom_size[hull])))
            found[body] = (model.geom_pos[hull].tolist(), along)
    return found


def boxes(model: mujoco.MjModel, base: int) -> dict[int, tuple[list[float], list[float]]]:
    """The bodies with a mass worth the name, each as the box of its inertia."""
    least = NEGLIGIBLE * model.body_subtreemass[base]
    return {
        body: (
            model.body_ipos[body].tolist(),
            _axis(model.body_iquat[body], int(np.argmin(model.body_inertia[body]))),
        )
        for body in below(model, base)
        if model.body_mass[body] > least
    }


def _axis(quaternion: np.ndarray, which: int) -> list[float]:
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, quaternion)
    return turn.reshape(3, 3)[:, which].tolist()


def _hung(model: mujoco.MjModel, body: int, base: int, places: dict[int, int]) -> dict:
    """The joint or weld that holds a body on its parent."""
    name = model.body(body).name
    parent = int(model.body_parentid[body])
    if parent != base and parent not in places:
        raise DataError(f"body `{name}` hangs on `{model.body(parent).name}`, which has no hull")
    out = {"origin": model.body_pos[body].tolist(), "rotation": model.body_quat[body].tolist()}
    if parent != base:
        out["parent"] = places[parent]
    first, count = model.body_jntadr[body], model.body_jntnum[body]
    if count > 1 or (count and (int(model.jnt_type[first]) not in KINDS or np.any(model.jnt_pos[first]))):
        raise DataError(f"body `{name}`: expected at most one hinge or slide, at the body's origin")
    if count:
        out["joint"] = {
            "name": model.joint(first).name,
            "kind": KINDS[int(model.jnt_type[first])],
            "axis": model.jnt_axis[first].tolist(),
        }
    return out
