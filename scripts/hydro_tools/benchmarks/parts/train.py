"""A training step: 400 steps of the ODE, 32 trajectories, forward, backward through the solver, AdamW."""

import numpy as np

from .. import commands, data
from ..alternation import Entry, elementwise, run
from ..markdown import digits, mebibytes, named, timings
from ..spread import ratio, spread
from ..target import Target

TITLE = "A training step"
OURS, OURS_CONTINUOUS = "hydro", "hydro, continuous adjoint"
HAND, ONE, DIFFEQ = "PyTorch, loop by hand", "PyTorch, by hand, 1 thread", "PyTorch, torchdiffeq"
ADJOINT, CANDLE = "PyTorch, continuous adjoint", "Candle, unrolled graph"
SOLVERS = {"euler": "Euler", "rk4": "RK4"}
#: How far the first loss and the first gradient's norm may lie from ours; None: another gradient or method by design.
TOLERANCE = 1e-3
#: How far the mean losses of the last steps may lie apart, relatively. Rounding grows from step to step.
CURVE, CURVE_END = 0.01, 20


def entries(training_case: dict, *, count: int, slow: int, slow_rounds: int) -> list[Entry]:
    """All ways to train on a case, 2 threads but where it says so; slow ways have few blocks, of `slow` steps."""

    def rust(name, task, tolerance=TOLERANCE, **more):
        return Entry(
            name, [*commands.rust()], {"training_case": training_case, **task}, threads=2, tolerance=tolerance, **more
        )

    def torch(name, way, tolerance=TOLERANCE, threads=2, **more):
        task = {"kind": "training", "training_case": training_case, "way": way, "threads": threads}
        return Entry(name, commands.python("pytorch_training"), task, threads=threads, tolerance=tolerance, **more)

    rare = {"count": slow, "rounds": slow_rounds}
    # torchdiffeq's rk4 is Kutta's 3/8 rule, so its losses are its own.
    same = TOLERANCE if training_case["solver"] == "euler" else None
    return [
        rust(OURS, {"kind": "ours", "adjoint": "discrete"}, count=count),
        torch(HAND, "by hand", count=count),
        torch(ONE, "by hand", threads=1, **rare),
        torch(DIFFEQ, "torchdiffeq", same, **rare),
        torch(ADJOINT, "continuous adjoint", None, count=1, rounds=1),
        rust(OURS_CONTINUOUS, {"kind": "ours", "adjoint": "continuous"}, None, **rare),
        rust(CANDLE, {"kind": "unrolled"}, **rare),
    ]


def measure(settings) -> dict:
    """Time every implementation; outcomes by group."""
    groups = {}
    samples = settings.pick(data.SAMPLES, 51)
    for solver in SOLVERS:
        print(f"training step, {solver}")
        training_case = data.training_case(solver, samples=samples)
        chosen = entries(
            training_case, count=settings.pick(10, 1), slow=settings.pick(2, 1), slow_rounds=settings.pick(4, 1)
        )
        groups[solver] = run(chosen, settings.pick(20, 2), warm_up=0, compare=elementwise)
        print(f"training step of the field alone, {solver}")
        chosen = entries(
            data.training_case(solver, samples=samples, field_alone=True),
            count=settings.pick(4, 1),
            slow=settings.pick(2, 1),
            slow_rounds=settings.pick(3, 1),
        )
        groups[f"{solver}, field alone"] = run(chosen, settings.pick(8, 2), warm_up=0, compare=elementwise)
    return groups


def _settled(outcomes: list[dict]) -> list[dict]:
    """Without the first block, in which libraries allocate and compile, where there are others."""
    return [outcome | {"seconds": outcome["seconds"][1:] or outcome["seconds"]} for outcome in outcomes]


def curves(outcomes: list[dict]) -> tuple[np.ndarray, np.ndarray]:
    """Losses of ours and of PyTorch, as many as both have."""
    one, two = named(outcomes, OURS)["values"], named(outcomes, HAND)["values"]
    steps = min(len(one), len(two))
    return np.array(one[:steps]), np.array(two[:steps])


def _apart(outcomes: list[dict]) -> str:
    one, two = curves(outcomes)
    away = np.abs(one - two) / two
    last = min(20, len(one))
    return (
        f"{len(one)} steps: the losses are at most {away.max():.1e} apart, relatively, and {away[:10].max():.1e} in the first "
        f"ten; mean of the last {last}: {one[-last:].mean():.4g} and {two[-last:].mean():.4g}."
    )


def render(groups: dict) -> str:
    """The section of the page, in Markdown."""
    extra = {
        "first loss": lambda outcome: f"{outcome['check'][0]:.6g}",
        "gradient norm": lambda outcome: f"{outcome['check'][1]:.6g}",
        "core seconds": lambda outcome: digits(spread(outcome["core_seconds"]).median),
        "peak MiB": lambda outcome: mebibytes(outcome["peak_bytes"]),
    }
    lines = [
        "Attention-ODE of the paper's sizes (window 8, embedding 64, h in R^6, field 512-512-512 that sees F, no linear part) on "
        "Task 2: 400 steps, 32 trajectories, 35 features; forward, mean squared error, backward through the solver, clipping at "
        "norm 1, AdamW with a rate of 3e-4 (at 1e-3 such a field runs away at first, in every implementation). Two threads each; same first weights, same batches in the same order. torchdiffeq's `rk4` is Kutta's "
        "3/8 rule. The continuous adjoint keeps no activations and has another gradient. Losses and norms are those of the first step. "
        "Core seconds: what the process took of all cores.\n"
    ]
    for solver, title in SOLVERS.items():
        for name, about in (
            (solver, f"{title}, the whole model:"),
            (f"{solver}, field alone", f"{title}, the field alone, driven by a given h:"),
        ):
            if name in groups:
                lines += [
                    about + "\n",
                    timings(
                        _settled(groups[name]), "s", {HAND: "of the loop by hand", DIFFEQ: "of torchdiffeq"}, extra
                    ),
                ]
        if solver in groups:
            lines += [f"Loss curves, {title}, ours and PyTorch's, {_apart(groups[solver])}\n"]
    return "\n".join(lines + ["![losses of ours and of PyTorch](loss.svg)\n"])


def targets(groups: dict) -> list[Target]:
    """The figures that have a target."""
    found = []
    for name, title in {**SOLVERS, **{f"{s}, field alone": f"{t}, field alone" for s, t in SOLVERS.items()}}.items():
        if name in groups:
            settled = _settled(groups[name])
            fastest = min((HAND, ONE, DIFFEQ), key=lambda name: np.median(named(settled, name)["seconds"]))
            value = ratio(named(settled, OURS)["seconds"], named(settled, fastest)["seconds"]).median
            found.append(Target(f"a training step, {title}, of {fastest}", value, 0.6))
    for solver, title in SOLVERS.items():
        if solver in groups:
            one, two = curves(groups[solver])
            last = min(CURVE_END, len(one))
            apart = abs(one[-last:].mean() / two[-last:].mean() - 1)
            found.append(
                Target(
                    f"distance of our loss from PyTorch's, {title}, mean of the last {last} of {len(one)} steps",
                    apart,
                    CURVE,
                    timed=False,
                )
            )
    return found
