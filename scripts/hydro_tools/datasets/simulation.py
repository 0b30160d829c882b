"""Many plans at once: states, features and labels, sampled in a `mujoco.batch`.

The label is the water's generalised force on the free joint (`qfrc_fluid` plus `qfrc_gravcomp`)
at the very state of the features. `mj_step` leaves the forces of the state before it, so every
sample calls `forward` first. A simulation's numbers do not depend on its neighbours in the batch.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco.batch import Batch

from . import DataError, features
from .plan import Plan
from .scene import BASE, Scene, lift_at


@dataclass(frozen=True)
class Recording:
    """M simulations of T samples, f64. Wrenches in the base frame about its origin [N, N m].

    qpos [M,T,19]; qvel [M,T,18]; x [M,T,35];
    wrench [M,T,6] of the water; hydrostatic [M,T,6], the buoyancy in it.
    """

    qpos: np.ndarray
    qvel: np.ndarray
    x: np.ndarray
    wrench: np.ndarray
    hydrostatic: np.ndarray


def simulate(scene: Scene, plans: Sequence[Plan], *, threads: int = 1) -> Recording:
    """Run the plans; every plan must have the same number of samples after its warm-up."""
    model = scene.model
    m, samples = len(plans), len(plans[0].condition)
    longest = max(plan.warm_up for plan in plans)
    # Every plan ends with the last row; shorter warm-ups join later.
    joins = np.array([longest - plan.warm_up for plan in plans])

    batch = Batch(model, m, threads)
    batch.reset(stage=mujoco.mjtStage.mjSTAGE_NONE.value)
    qpos, qvel, ctrl = batch.bind("qpos"), batch.bind("qvel"), batch.bind("ctrl")
    push = batch.bind("xfrc_applied")[:, model.body(BASE).id]
    fluid, lift = batch.bind("qfrc_fluid"), batch.bind("qfrc_gravcomp")
    density, gravcomp = batch.expand("opt.density"), batch.expand("body_gravcomp")
    density = density.reshape(m)
    for i, plan in enumerate(plans):
        qpos[i], qvel[i] = plan.qpos, plan.qvel
    unit_lift = lift_at(model, np.float64(1.0))
    fixed_lift = lift_at(model, np.float64(0.0))

    shape = (m, samples)
    record = {
        "qpos": np.empty((*shape, model.nq)),
        "qvel": np.empty((*shape, model.nv)),
        "fluid": np.empty((*shape, 6)),
        "lift": np.empty((*shape, 6)),
    }
    for row in range(longest + samples):
        active = np.flatnonzero(joins <= row)
        if not active.size:
            continue
        for i in active:
            local = row - joins[i]
            ctrl[i], push[i], density[i] = plans[i].ctrl[local], plans[i].push[local], plans[i].density[local]
        gravcomp[:] = fixed_lift + density[:, None] * (unit_lift - fixed_lift)
        if row >= longest:
            batch.forward(stage=mujoco.mjtStage.mjSTAGE_VEL.value)
            k = row - longest
            record["qpos"][:, k], record["qvel"][:, k] = qpos, qvel
            record["fluid"][:, k], record["lift"][:, k] = fluid[:, :6], lift[:, :6]
        if row + 1 < longest + samples:
            batch.step(ids=active, nstep=scene.substeps)
    _refuse_divergence(batch, record)

    quaternion = record["qpos"][..., 3:7]
    hydrostatic = features.base_wrench(quaternion, record["lift"])
    wrench = features.base_wrench(quaternion, record["fluid"] + record["lift"])
    along = np.stack([plan.density[plan.warm_up :] for plan in plans])
    x = features.features(record["qpos"], record["qvel"], along)
    return Recording(record["qpos"], record["qvel"], x, wrench, hydrostatic)


def _refuse_divergence(batch: Batch, record: dict[str, np.ndarray]) -> None:
    """MuJoCo resets a simulation that diverges and counts a warning; such a trajectory is no data."""
    finite = np.all([np.isfinite(values).all(axis=(1, 2)) for values in record.values()], axis=0)
    bad = [mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC]
    warned = np.asarray(batch.warning)[:, [int(w) for w in bad]].reshape(len(finite), -1).any(axis=1)
    worst = np.flatnonzero(~finite | warned)
    if worst.size:
        raise DataError(f"simulation {worst[0]} of {len(finite)} diverged; nothing was written for this shard")
