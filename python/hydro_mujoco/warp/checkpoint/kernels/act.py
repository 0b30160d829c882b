"""The force of a checkpoint between its samples, and where it acts: Warp kernels."""

import warp as wp

from ..lanes import LANES
from ..robot import Limits, Places
from .clock import FAULTED, WARM

wp.set_module_options({"enable_backward": False})


@wp.kernel
def hold(
    due: wp.array3d[float],
    limits: Limits,
    drag: wp.array3d[float],
    predicts_next: bool,
    # In and out
    now: wp.array3d[float],
    next: wp.array3d[float],
    phase: wp.array[int],
):
    """Holds the forces at a sample and one later to their range; a world with one that is no number is at fault."""
    world = wp.tid()
    group, lane = world // LANES, world % LANES
    if due[group, 0, lane] == 0.0:
        return
    for i in range(limits.least_force.shape[0]):
        if not predicts_next:
            next[group, i, lane] = now[group, i, lane]
        # An infinite force would become a large one.
        if not wp.isfinite(now[group, i, lane] + next[group, i, lane] + drag[group, i, lane]):
            phase[world] = FAULTED
        now[group, i, lane] = wp.clamp(now[group, i, lane], limits.least_force[i], limits.most_force[i])
        next[group, i, lane] = wp.clamp(next[group, i, lane], limits.least_force[i], limits.most_force[i])


@wp.kernel
def act(
    phase: wp.array[int],
    since: wp.array[wp.float64],
    period: wp.float64,
    now: wp.array3d[float],
    next: wp.array3d[float],
    drag: wp.array3d[float],
    places: Places,
    row: int,
    water: int,
    share: wp.array2d[float],
    # Out
    wrench: wp.array2d[wp.spatial_vector],
    qfrc_passive: wp.array2d[float],
):
    """The force at the present time, on the line between two samples: torques to their joints, the rest to `wrench`.

    share: of the robot that is under water.
    """
    world = wp.tid()
    group, lane = world // LANES, world % LANES
    found = wp.spatial_vector()
    if phase[world] == WARM:
        part = float(wp.clamp(since[world] / period, wp.float64(0.0), wp.float64(1.0)))
        for i in range(places.dof.shape[0]):
            here = now[group, i, lane]
            value = here + part * (next[group, i, lane] - here) + drag[group, i, lane]
            value *= share[world, water]
            if places.component[i] >= 0:
                found[places.component[i]] = places.scale[i] * value
            elif places.dof[i] >= 0:
                qfrc_passive[world, places.dof[i]] += value
    wrench[world, row] = found
