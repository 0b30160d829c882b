"""Many plans at once: states, features and labels, sampled in a `mujoco.batch`.

The label is the water's wrench at the very state of the features. `mj_step` leaves the forces of the state before it,
so every sample calls `forward` first. A simulation's numbers do not depend on its neighbours in the batch.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from functools import partial, reduce

import mujoco
import numpy as np
from mujoco.batch import Batch, SimulationError

from ..errors import DataError
from .plan import Plan
from .system import System

#: Warnings by which MuJoCo says that it has reset a simulation.
RESETS = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC)


@dataclass(frozen=True)
class Recording:
    """M simulations of T samples, f64. Wrenches in the base frame about its origin [N, N m].

    qpos [M,T,nq]; qvel [M,T,nv]; x [M,T,n]; wrench [M,T,6] of the water; hydrostatic [M,T,6], the buoyancy in it;
    fault [M]: why a simulation is no data, or ""; extra: more arrays [M,T,..] by the name that they have in a shard.
    """

    qpos: np.ndarray
    qvel: np.ndarray
    x: np.ndarray
    wrench: np.ndarray
    hydrostatic: np.ndarray
    fault: np.ndarray
    extra: Mapping[str, np.ndarray] = field(default_factory=dict)

    def put(self, rows: Sequence[int] | np.ndarray, other: "Recording") -> None:
        """Replace the simulations `rows` by those of another recording."""
        for each in fields(self):
            if each.name != "extra":
                getattr(self, each.name)[rows] = getattr(other, each.name)
        for name, values in self.extra.items():
            values[rows] = other.extra[name]


@contextmanager
def _silence() -> Iterator[None]:
    """MuJoCo's warnings are counted by the batch; printed and logged they would be told once a trajectory."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda text: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def simulate(system: System, plans: Sequence[Plan], *, threads: int = 1) -> Recording:
    """Run the plans; every plan must have the same number of samples after its warm-up."""
    with _silence():
        return _simulate(system, plans, threads)


def _simulate(system: System, plans: Sequence[Plan], threads: int) -> Recording:
    model = system.model
    m, samples = len(plans), len(plans[0].condition)
    longest = max(plan.warm_up for plan in plans)
    # Every plan ends with the last row; shorter warm-ups join later.
    joins = np.array([longest - plan.warm_up for plan in plans])

    batch = Batch(model, m, threads)
    batch.reset(stage=mujoco.mjtStage.mjSTAGE_NONE.value)
    qpos, qvel, ctrl = batch.bind("qpos"), batch.bind("qvel"), batch.bind("ctrl")
    push = batch.bind("xfrc_applied")[:, system.base]
    read = _readers(system, batch, m)
    density, gravcomp = np.empty(m), None
    if system.layout.has_density:
        density = batch.expand("opt.density").reshape(m)
        if system.lift is not None:
            gravcomp = batch.expand("body_gravcomp")
    for i, plan in enumerate(plans):
        qpos[i], qvel[i] = plan.qpos, plan.qvel

    shape = (m, samples)
    record = {"qpos": np.empty((*shape, model.nq)), "qvel": np.empty((*shape, model.nv))}
    record |= {name: np.empty((*shape, width)) for name, (width, _) in read.items()}
    try:
        for row in range(longest + samples):
            active = np.flatnonzero(joins <= row)
            if not active.size:
                continue
            for i in active.tolist():
                local = row - int(joins[i])
                ctrl[i], push[i], density[i] = plans[i].ctrl[local], plans[i].push[local], plans[i].density[local]
            if gravcomp is not None and system.lift is not None:
                gravcomp[:] = system.lift.at(density)
            if row >= longest:
                batch.forward(stage=mujoco.mjtStage.mjSTAGE_VEL.value)
                k = row - longest
                record["qpos"][:, k], record["qvel"][:, k] = qpos, qvel
                for name, (_, values) in read.items():
                    record[name][:, k] = values()
            if row + 1 < longest + samples:
                batch.step(ids=active, nstep=system.substeps)
    except SimulationError as error:
        raise DataError(f"MuJoCo ended the simulation: {error}") from error
    fault = _faults(system, batch, record)

    hydrostatic = np.zeros((*shape, 6))
    wrench = np.zeros((*shape, 6))
    joint_space = [record[name] for name in ("fluid", "lift") if name in record]
    if joint_space:
        wrench = system.layout.base.wrench(record["qpos"], reduce(np.add, joint_space))
    if "lift" in record:
        hydrostatic = system.layout.base.wrench(record["qpos"], record["lift"])
    if "meter" in record:
        wrench = wrench + record["meter"]
    if "still" in record:
        hydrostatic = hydrostatic + record["still"]
    along = np.stack([plan.density[plan.warm_up :] for plan in plans])
    x = system.layout.features(record["qpos"], record["qvel"], along)
    return Recording(record["qpos"], record["qvel"], x, wrench, hydrostatic, fault)


def _readers(system: System, batch: Batch, m: int) -> dict:
    """What is read at every sample, beside the state: (numbers, how) by name."""
    out = {}
    if system.has_fluid:
        fluid = batch.bind("qfrc_fluid")
        out["fluid"] = (system.model.nv, lambda: fluid)
    if system.lift is not None:
        lift = batch.bind("qfrc_gravcomp")
        out["lift"] = (system.model.nv, lambda: lift)
    state = {name: batch.bind(name) for name in ("qpos", "qvel", "ctrl", "time", "plugin_state")}
    for name, make in (("meter", system.meter), ("still", system.still_meter)):
        if make is not None:
            out[name] = (6, partial(make(m).read, state))
    return out


def _faults(system: System, batch: Batch, record: dict[str, np.ndarray]) -> np.ndarray:
    """Why simulations are no data [m]. MuJoCo resets one that diverges, and counts a warning."""
    out = np.full(len(record["qpos"]), "", dtype=object)
    bounds = system.bounds
    if bounds is not None:
        rate = np.abs(record["qvel"][..., system.turning]).max(axis=(1, 2), initial=0.0)
        speed = np.sqrt(np.sum(system.layout.base.velocity_of(record["qvel"]) ** 2, axis=-1)).max(axis=1)
        out[rate > bounds.rate] = f"a joint or the base turns quicker than {bounds.rate:.3g} rad/s"
        out[speed > bounds.speed] = f"the base quicker than {bounds.speed:.3g} m/s"
    finite = np.all([np.isfinite(values).all(axis=(1, 2)) for values in record.values()], axis=0)
    out[~finite] = "a number that is not finite"
    warned = np.asarray(batch.warning)[:, [int(w) for w in RESETS]].reshape(len(out), -1).any(axis=1)
    out[warned] = "reset by MuJoCo (huge or not a number)"
    return out
