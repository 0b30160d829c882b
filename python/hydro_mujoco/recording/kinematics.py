"""A robot's links as the tree in a manifest: centre and longest axis of each, joint to its parent.

A link is a body that water acts on. SI units; vectors in the link's frame, `origin` and `rotation` (w x y z) in the
parent's.
"""

from collections.abc import Mapping

import mujoco
import numpy as np

from ..errors import DataError

HINGE = int(mujoco.mjtJoint.mjJNT_HINGE)
KINDS = {HINGE: "hinge", int(mujoco.mjtJoint.mjJNT_SLIDE): "slide"}
#: Keys of a link, in their order.
KEYS = ("name", "origin", "rotation", "centre", "along", "parent", "joint")
#: Share of the robot's mass below which a body has no water of its own.
NEGLIGIBLE = 1e-6
#: Links of a tree at most (crates/model/src/kinematics.rs).
MOST_LINKS = 64


def tree(model: mujoco.MjModel, base: int, wet: Mapping[int, tuple[list[float], list[float]]]) -> dict:
    """The manifest's `kinematics`, of the bodies at and below `base` that are `wet`.

    wet: by body, the point where its water acts and its long axis, as `hulls` or `boxes` give them.
    """
    links: list[dict] = []
    places: dict[int, tuple[int, np.ndarray]] = {}
    for body in below(model, base):
        if body not in wet:
            continue
        centre, along = wet[body]
        chain: list[dict] = [{"origin": [0.0] * 3, "rotation": [1.0, 0.0, 0.0, 0.0]}]
        shift = np.zeros(3)
        if body != base:
            chain, shift = _hung(model, body, base, places)
        chain = [{"name": name_of(model, body)} | link for link in chain]
        # A body on several joints is a chain of links, its own the last.
        for number, link in enumerate(chain[:-1]):
            link |= {"name": f"{link['name']}:{link['joint']['name']}", "centre": [0.0] * 3, "along": along}
            chain[number + 1]["parent"] = len(links) + number
        moved = (np.array(centre) - shift).tolist() if np.any(shift) else centre
        chain[-1] |= {"centre": moved, "along": along}
        links += [{key: link[key] for key in KEYS if key in link} for link in chain]
        places[body] = len(links) - 1, shift
    if len(links) > MOST_LINKS:
        raise DataError(f"body `{name_of(model, base)}` has {len(links)} links; expected {MOST_LINKS} at most")
    return {"links": links}


def name_of(model: mujoco.MjModel, body: int) -> str:
    """Name of a body; unnamed ones are `body_N`, as in the lists of effects."""
    return model.body(body).name or f"body_{body}"


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


def _hung(
    model: mujoco.MjModel, body: int, base: int, places: dict[int, tuple[int, np.ndarray]]
) -> tuple[list[dict], np.ndarray]:
    """The joints or the weld that hold a body on its parent, a link each, and where its last joint is in its frame.

    A link's origin lies on its joint. places: index and such a shift of the links so far, by body.
    """
    parent = int(model.body_parentid[body])
    if parent != base and parent not in places:
        raise DataError(f"body `{name_of(model, body)}` hangs on `{name_of(model, parent)}`, which has no hull")
    index, shift = places.get(parent, (None, np.zeros(3)))
    first = model.body_jntadr[body]
    joints = [int(joint) for joint in range(first, first + model.body_jntnum[body])]
    for joint in joints:
        where = f"body `{name_of(model, body)}`, joint `{model.joint(joint).name or joint}`"
        if int(model.jnt_type[joint]) not in KINDS:
            kind = mujoco.mjtJoint(int(model.jnt_type[joint])).name.removeprefix("mjJNT_").lower()
            raise DataError(f"{where}: type is {kind}; expected {' or '.join(KINDS.values())}")
        if ref := float(model.qpos0[model.jnt_qposadr[joint]]):
            unit = "rad" if int(model.jnt_type[joint]) == HINGE else "m"
            raise DataError(f"{where}: ref is {ref:g} {unit}; expected 0")
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.body_quat[body])
    # The base frame is the root of the tree, whether water acts on the base or not.
    link = {"origin": model.body_pos[body], "rotation": model.body_quat[body].tolist()}
    link |= {"parent": index} if parent != base else {}
    chain, before, axes = [], -shift, turn.reshape(3, 3)
    here = np.zeros(3)
    for joint in joints:
        if int(model.jnt_type[joint]) == HINGE:
            here = np.array(model.jnt_pos[joint])
        moved = axes @ here + before
        if np.any(moved):
            link["origin"] = link["origin"] + moved
        kind = KINDS[int(model.jnt_type[joint])]
        link["joint"] = {"name": model.joint(joint).name, "kind": kind, "axis": model.jnt_axis[joint].tolist()}
        chain.append(link)
        link = {"origin": np.zeros(3), "rotation": [1.0, 0.0, 0.0, 0.0]}
        before, axes = -here, np.eye(3)
    if not joints:
        link["origin"] = link["origin"] - shift if np.any(shift) else link["origin"]
        chain.append(link)
    for link in chain:
        link["origin"] = link["origin"].tolist()
    return chain, here
