"""Peak memory: training on a batch of 256 here, that of every other implementation as its part noted it."""

from .. import data
from ..alternation import run
from ..markdown import mebibytes, table
from ..target import Target
from . import train

TITLE = "Peak memory"
BATCH = 256


def measure(settings) -> dict:
    """Time every implementation; outcomes by group."""
    groups = {}
    for solver in train.SOLVERS:
        print(f"memory of a training step, batch {BATCH}, {solver}")
        training_case = data.training_case(solver, batch=BATCH, steps=2, samples=settings.pick(data.SAMPLES, 51))
        entries = train.entries(training_case, count=1, slow=1, slow_rounds=1)
        # One after the other. RK4's activations of 400 steps would take PyTorch beyond a common machine.
        chosen = [
            entry
            for entry in entries
            if entry.name == train.OURS
            or (solver == "euler" and entry.name in (train.HAND, train.DIFFEQ, train.ADJOINT))
        ]
        groups[solver] = [run([entry], 1, warm_up=0)[0] for entry in chosen[: settings.pick(None, 1)]]
    return groups


def render(groups: dict, others: dict) -> str:
    """others: part -> groups of the parts that were run, whose implementations noted their peak."""
    rows = []
    for solver, outcomes in groups.items():
        rows += [
            [
                f"training step, {train.SOLVERS[solver]}, 400 x 35, batch {BATCH}",
                outcome["name"],
                mebibytes(outcome["idle_bytes"]),
                mebibytes(outcome["peak_bytes"]),
            ]
            for outcome in outcomes
        ]
    about = {
        ("train", "euler"): "training step, Euler, batch 32",
        ("train", "rk4"): "training step, RK4, batch 32",
        ("evaluate", "field"): "one evaluation, 12-512-512-512-6",
        ("evaluate", "sample"): "a sample, released model",
        ("step", "euler"): "a step of the simulation, Euler",
    }
    for (part, group), title in about.items():
        rows += [
            [title, outcome["name"], mebibytes(outcome["idle_bytes"]), mebibytes(outcome["peak_bytes"])]
            for outcome in others.get(part, {}).get(group, [])
        ]
    return (
        "The largest resident size of each process (`VmHWM`), MiB: with its libraries loaded and nothing done, and at the end.\n\n"
        + table(["", "implementation", "idle", "peak"], rows)
    )


def targets(groups: dict) -> list[Target]:
    """The figures that have a target."""
    return [
        Target(
            f"GiB at the peak of our training step, {train.SOLVERS[solver]}, batch {BATCH}",
            outcome["peak_bytes"] / 2**30,
            2.0,
            timed=False,
        )
        for solver, outcomes in groups.items()
        for outcome in outcomes
        if outcome["name"] == train.OURS
    ]
