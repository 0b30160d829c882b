"""Many plans through water of strips.

The added mass M_a joins MuJoCo's own mass matrix, whose pattern it has, between the stages of a step: acceleration,
joint limits and the integrator then see M + M_a, so the solution is exact at any ratio of the two. Only numpy and the
stages of one simulation are used, so its numbers do not depend on its neighbours.
"""

import copy
from collections.abc import Sequence
from dataclasses import replace

import mujoco
import numpy as np

from hydro_mujoco.recording.features import Layout
from hydro_mujoco.recording.plan import Plan
from hydro_mujoco.recording.simulation import Recording

from . import wake
from .forces import Forces, Water
from .kinematics import Reader

#: A speed or rate beyond which a simulation has exploded [m/s, rad/s].
EXPLODED = 1e3


def dry(model: mujoco.MjModel) -> mujoco.MjModel:
    """A copy of the model in which MuJoCo has no water: no fluid, no `gravcomp`."""
    out = copy.copy(model)
    out.opt.density = out.opt.viscosity = 0.0
    out.body_gravcomp[:] = 0.0
    return out


class Simulation:
    """m simulations of one dry model in one water."""

    def __init__(self, model: mujoco.MjModel, water: Water, m: int):
        self.model, self.water = model, water
        self.datas = [mujoco.MjData(model) for _ in range(m)]
        self.reader = Reader(model, self.datas, water.strips.ids(model))
        self.wakes = np.zeros((m, len(water.strips.owner), 3))
        self.density = np.full(m, 1000.0)
        rows = np.repeat(np.arange(model.nv), model.M_rownnz)
        self.place = rows, np.array(model.M_colind)
        self.qacc = [data.qacc for data in self.datas]

    def evaluate(self, ids: Sequence[int]) -> Forces:
        """The water's forces at the present state; MuJoCo's stages up to the acceleration see them."""
        model, datas = self.model, self.datas
        for i in ids:
            mujoco.mj_fwdPosition(model, datas[i])
            mujoco.mj_fwdVelocity(model, datas[i])
        forces = self.water.forces(self.reader.read(ids), self.wakes[ids], self.density[ids])
        applied = forces.drag + forces.lift + forces.drift
        mass = forces.mass[:, self.place[0], self.place[1]]
        velocity_stage = mujoco.mjtStage.mjSTAGE_VEL.value
        for row, i in enumerate(ids):
            data = datas[i]
            data.M[:] += mass[row]
            mujoco.mj_factorM(model, data)
            mujoco.mj_projectConstraint(model, data)
            data.qfrc_applied[:] = applied[row]
            mujoco.mj_forwardSkip(model, data, velocity_stage, 1)
        return forces

    def settle(self, ids: Sequence[int]) -> None:
        """Give the wakes what steady motion at the present velocity would."""
        for i in ids:
            mujoco.mj_fwdPosition(self.model, self.datas[i])
            mujoco.mj_fwdVelocity(self.model, self.datas[i])
        at = self.reader.read(ids)
        strips = self.water.strips
        self.wakes[ids] = wake.SHARE * np.einsum("sij,msj->msi", strips.rows, at.velocity[:, strips.owner])

    def advance(self, ids: Sequence[int], forces: Forces) -> None:
        """One step from the state that was evaluated."""
        for i in ids:
            mujoco.mj_Euler(self.model, self.datas[i])
        step = self.model.opt.timestep
        self.wakes[ids] = wake.follow(self.water.strips, self.wakes[ids], forces.velocity, forces.pace, step)

    def step(self, ids: Sequence[int]) -> None:
        """Evaluate and advance."""
        self.advance(ids, self.evaluate(ids))

    def accelerations(self, ids: Sequence[int]) -> np.ndarray:
        """qacc [m,nv] of the last evaluation."""
        return np.stack([self.qacc[i] for i in ids])


def simulate(
    model: mujoco.MjModel,
    water: Water,
    plans: Sequence[Plan],
    *,
    base: int,
    layout: Layout,
    substeps: int,
    apart: bool = False,
    every_step: bool = False,
) -> Recording:
    """Run the plans in a model; every plan must have the same number of samples after its warm-up.

    base: the body that plans push; substeps: physics steps a sample; apart: the force of the added mass, -(M_a qacc +
    gyroscopic terms), is no part of `wrench` and `generalised`, since another model has M_a in its inertia.

    Besides the usual arrays `extra` has `generalised` [M,T,nv], the water's force on every degree of freedom [N, N m];
    `generalised_hydrostatic` [M,T,nv], the buoyancy in it; `added_mass` [M,T,6], the force of the added mass on the
    base as a wrench; with every_step also `gyroscopic` [M,T,6], the part of that which remains at qacc = 0, and
    `step_force` [M,T-1,substeps nv], the whole generalised force in each physics step, added mass included.
    """
    run = Simulation(dry(model), water, len(plans))
    samples = len(plans[0].condition)
    longest = max(plan.warm_up for plan in plans)
    joins = np.array([longest - plan.warm_up for plan in plans])
    names = ("qvel", "total", "lift", "added", "drift")
    widths = {"qpos": model.nq} | dict.fromkeys(names, model.nv)
    record = {name: np.zeros((len(plans), samples, width)) for name, width in widths.items()}
    steps = np.zeros((len(plans), samples - 1, substeps, model.nv)) if every_step else None
    fault = np.full(len(plans), "", dtype=object)
    for i, plan in enumerate(plans):
        run.datas[i].qpos[:], run.datas[i].qvel[:] = plan.qpos, plan.qvel

    for row in range(longest + samples):
        starting = [int(i) for i in np.flatnonzero(joins == row)]
        if starting:
            run.settle(starting)
        ids = [int(i) for i in np.flatnonzero(joins <= row) if not fault[i]]
        if not ids:
            continue
        for i in ids:
            local, data = row - int(joins[i]), run.datas[i]
            data.ctrl[:], data.xfrc_applied[base] = plans[i].ctrl[local], plans[i].push[local]
            run.density[i] = plans[i].density[local]
        forces = run.evaluate(ids)
        if row >= longest:
            _note(record, row - longest, ids, run, forces)
        if row + 1 == longest + samples:
            break
        for step in range(substeps):
            if step > 0:
                forces = run.evaluate(ids)
            if steps is not None and row >= longest:
                steps[ids, row - longest, step] = forces.drag + forces.lift + forces.added(run.accelerations(ids))
            run.advance(ids, forces)
        for i in ids:
            if not np.abs(run.datas[i].qvel).max() < EXPLODED:
                fault[i] = f"quicker than {EXPLODED:.0f} m/s or rad/s, or not a number"
    recording = _recording(layout, plans, record, fault, apart)
    if steps is not None:
        gyroscopic = layout.base.wrench(record["qpos"], record["drift"])
        more = {"gyroscopic": gyroscopic, "step_force": steps.reshape(len(plans), samples - 1, -1)}
        recording = replace(recording, extra={**recording.extra, **more})
    return recording


def _note(record: dict[str, np.ndarray], k: int, ids: list[int], run: Simulation, forces: Forces) -> None:
    added = forces.added(run.accelerations(ids))
    record["qpos"][ids, k] = [run.datas[i].qpos for i in ids]
    record["qvel"][ids, k] = [run.datas[i].qvel for i in ids]
    record["lift"][ids, k], record["added"][ids, k], record["drift"][ids, k] = forces.lift, added, forces.drift
    record["total"][ids, k] = forces.drag + forces.lift + added


def _recording(
    layout: Layout, plans: Sequence[Plan], record: dict[str, np.ndarray], fault: np.ndarray, apart: bool
) -> Recording:
    along = np.stack([plan.density[plan.warm_up :] for plan in plans])
    label = record["total"] - record["added"] if apart else record["total"]
    wrench, lift, added = (layout.base.wrench(record["qpos"], v) for v in (label, record["lift"], record["added"]))
    return Recording(
        record["qpos"],
        record["qvel"],
        layout.features(record["qpos"], record["qvel"], along),
        wrench,
        lift,
        fault,
        {"generalised": label, "generalised_hydrostatic": record["lift"], "added_mass": added},
    )
