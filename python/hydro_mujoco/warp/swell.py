"""Bodies that waves push though no effect floats them."""

import mujoco

from .hull import geoms_of
from .instances import Instance, carriers

#: A body displaces water that counts from this part of its tree's mass on.
WEIGHTY = 0.02


def bodies_in_waves(model: mujoco.MjModel, instance: Instance) -> list[int]:
    """Bodies in the water of an instance that displace some of it, floating by hydrostatics or not."""
    return [
        body
        for body in range(1, model.nbody)
        if _moves(model, body) and _weighs(model, body) and _is_in(model, body, instance)
        if geoms_of(model, [body], instance.hull)
    ]


def _moves(model: mujoco.MjModel, body: int) -> bool:
    return int(model.body_weldid[body]) != 0


def _weighs(model: mujoco.MjModel, body: int) -> bool:
    return bool(model.body_mass[body] > WEIGHTY * model.body_subtreemass[model.body_rootid[body]])


def _is_in(model: mujoco.MjModel, body: int, instance: Instance) -> bool:
    """True where the instance is that of the nearest carrier at or above a body, or else of its tree's first."""
    carrying = carriers(model)
    above = body
    while above:
        if above in carrying:
            return above == instance.body
        above = int(model.body_parentid[above])
    root = model.body_rootid[body]
    in_tree = [carrier for carrier in sorted(carrying) if model.body_rootid[carrier] == root]
    return bool(in_tree) and in_tree[0] == instance.body
