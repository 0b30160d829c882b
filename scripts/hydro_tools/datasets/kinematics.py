"""A scene's links as the tree in a manifest: centre and longest axis of each hull, joint to its parent.

A link is a body below the base that carries a hull, a geom in MuJoCo's ellipsoid fluid; of several hulls the largest
one counts. SI units; vectors in the link's frame, `origin` and `rotation` (w x y z) in the parent's.
"""

import mujoco
import numpy as np

from . import DataError, scene

KINDS = {int(mujoco.mjtJoint.mjJNT_HINGE): "hinge", int(mujoco.mjtJoint.mjJNT_SLIDE): "slide"}


def tree(loaded: scene.Scene) -> dict:
    """The manifest's `kinematics`."""
    model = loaded.model
    base = model.body(scene.BASE).id
    links, places = [], {}
    for body in range(base, model.nbody):
        if model.body_rootid[body] != model.body_rootid[base] or (hull := _largest_hull(model, body)) is None:
            continue
        link = {
            "name": model.body(body).name,
            "origin": [0.0, 0.0, 0.0],
            "rotation": [1.0, 0.0, 0.0, 0.0],
            "centre": model.geom_pos[hull].tolist(),
            "along": _longest_axis(model, hull),
        }
        if body != base:
            link |= _hung(loaded, body, base, places)
        places[body] = len(links)
        links.append(link)
    return {"links": links}


def _hung(loaded: scene.Scene, body: int, base: int, places: dict[int, int]) -> dict:
    """The joint or weld that holds a body on its parent."""
    model, name = loaded.model, loaded.model.body(body).name
    parent = int(model.body_parentid[body])
    if parent != base and parent not in places:
        raise DataError(f"model {loaded.path}: body `{name}` hangs on `{model.body(parent).name}`, which has no hull")
    out = {"origin": model.body_pos[body].tolist(), "rotation": model.body_quat[body].tolist()}
    if parent != base:
        out["parent"] = places[parent]
    first, count = model.body_jntadr[body], model.body_jntnum[body]
    if count > 1 or (count and (int(model.jnt_type[first]) not in KINDS or np.any(model.jnt_pos[first]))):
        raise DataError(
            f"model {loaded.path}: body `{name}`: expected at most one hinge or slide, at the body's origin"
        )
    if count:
        out["joint"] = {
            "name": model.joint(first).name,
            "kind": KINDS[int(model.jnt_type[first])],
            "axis": model.jnt_axis[first].tolist(),
        }
    return out


def _largest_hull(model: mujoco.MjModel, body: int) -> int | None:
    first, count = model.body_geomadr[body], model.body_geomnum[body]
    hulls = [g for g in range(first, first + count) if model.geom_fluid[g, 0] > 0]
    return max(hulls, key=lambda g: np.prod(model.geom_size[g]), default=None)


def _longest_axis(model: mujoco.MjModel, geom: int) -> list[float]:
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
    return turn.reshape(3, 3)[:, np.argmax(model.geom_size[geom])].tolist()
