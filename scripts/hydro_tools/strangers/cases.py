"""The list of cases on others' robots, and what is added to their answers."""

import copy
import json
from pathlib import Path

import numpy as np

from ..hidden_cases.case import Case, Spec
from ..hidden_cases.plant import Plant
from ..hidden_cases.strength import Windows
from ..hidden_cases.systems.base import Schedule
from ..hidden_cases.systems.generic import Generic
from .robots import ROBOTS

#: Two effects that are hidden together, by what a robot has.
PAIRS = (("joint_friction", "joint_damping"), ("joint_friction", "payload"), ("actuator_gain", "joint_damping"))


def plan(
    name: str, effects: list[str], seed: int, factors: tuple[float, float] | None = None, *, small: bool
) -> list[Spec]:
    """A null, every effect alone, and one pair, of one robot; strengths from 10 to 100, or factors where given."""
    rng = np.random.default_rng([seed, list(ROBOTS).index(name)])
    hidden: list[tuple[str, ...]] = [(), *((effect,) for effect in effects)]
    hidden += [pair for pair in PAIRS if set(pair) <= set(effects)][:1]
    first = 1000 * list(ROBOTS).index(name)
    specs = []
    for i, kinds in enumerate(hidden):
        drawn = tuple(float(np.exp(rng.uniform(*np.log(factors or (10.0, 100.0))))) for _ in kinds)
        kind = {0: "null", 1: "single", 2: "pair"}[len(kinds)]
        target, taken = ((), drawn) if factors else (drawn, ())
        specs.append(Spec(first + i, seed, kind, name, kinds, target, 1.0, small, taken))
    return specs


def make(spec: Spec, system: Generic, out: Path) -> None:
    """A case, with the gap that the nominal's own step leaves written beside its answer."""
    Case(spec, system).make(out)
    path = out / "sealed" / spec.case_id / "answer.json"
    answer = json.loads(path.read_text())
    answer["stepping"] = stepping(system, spec.small)
    path.write_text(json.dumps(answer, indent=1) + "\n")


def stepping(system: Generic, small: bool) -> float:
    """Whitened norm of what the truth's finer step alone changes, all numbers alike, windows of a second."""
    model = system.model
    whole = system.schedule(np.random.default_rng(0), small=small)
    few = Schedule(2, min(whole.rows, round(4.0 / whole.period)), whole.period)
    drive = system.drive(np.random.default_rng(1), model, few, "normal")
    fine = copy.copy(model)
    fine.opt.timestep, fine.opt.integrator = system.truth_step(np.random.default_rng(0))
    plant = Plant(fine, [], qpos=drive.qpos, qvel=drive.qvel, start=np.zeros(2), act=drive.act)
    per_row = round(few.period / fine.opt.timestep)
    record = plant.run(few.rows, few.period, drive.policy, record_every=per_row, lead=model.opt.timestep)
    windows = Windows(record, few.period, model.opt.timestep)
    change = system.layout.whitened(windows.truth(record.sensors[:, : few.rows]), windows.outputs(model, []))
    return float(np.linalg.norm(change) * np.sqrt(whole.trials * whole.rows / (few.trials * few.rows)))
