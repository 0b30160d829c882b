"""Cases on random systems: what is hidden, how strongly; a seed and a number say everything."""

import json
from pathlib import Path

import numpy as np

from ..hidden_cases import HiddenCaseError, plan
from ..hidden_cases.case import Case, Spec
from ..hidden_cases.systems.generic import Generic
from . import build

#: Shares of one, two and three hidden effects among cases that hide any.
COUNTS = (0.6, 0.25, 0.15)
#: Projected strengths that are aimed at, evenly in their logarithm.
LEAST, MOST = 3.5, 200.0
#: Systems that are drawn for a number before it is given up.
TRIES = 6


def make(seed: int, index: int, out: Path, *, null_share: float, small: bool) -> str:
    """Make the case of a number; returns its id. A system that does not run is drawn again."""
    faults = []
    for attempt in range(TRIES):
        rng = np.random.default_rng([seed, index, attempt, 77])
        system = Generic(build.robot(rng))
        try:
            spec = draw(rng, seed, index, system, null_share=null_share, small=small)
            case = Case(spec, system)
            case.make(out)
        except HiddenCaseError as error:
            faults.append(str(error))
            continue
        path = out / "sealed" / spec.case_id / "answer.json"
        answer = json.loads(path.read_text())
        answer |= {"attempt": attempt, "noise_declared": system.robot.noise_declared}
        path.write_text(json.dumps(answer, indent=1) + "\n")
        return spec.case_id
    raise HiddenCaseError(f"case {index} of seed {seed}: {TRIES} systems failed: {'; '.join(faults)}")


def draw(rng: np.random.Generator, seed: int, index: int, system: Generic, *, null_share: float, small: bool) -> Spec:
    """What is hidden in a system."""
    noise = float(rng.choice(plan.NOISES))
    if rng.random() < null_share:
        return Spec(index, seed, "null", system.name, (), (), noise, small)
    menu = sorted(system.singles(system.model))
    count = min(1 + int(rng.choice(3, p=COUNTS)), len(menu))
    chosen: list[str] = []
    for kind in rng.permutation(menu):
        if len(chosen) < count and all({str(kind), other} not in plan.TOO_CLOSE for other in chosen):
            chosen.append(str(kind))
    # One of several below the weakest noise would not be there.
    least = LEAST if len(chosen) == 1 else 12.0
    targets = tuple(float(np.exp(rng.uniform(np.log(least), np.log(MOST)))) for _ in chosen)
    kind = {1: "single", 2: "pair"}.get(len(chosen), "several")
    return Spec(index, seed, kind, system.name, tuple(chosen), targets, noise, small)


def case_id(seed: int, index: int, *, small: bool) -> str:
    """The id of a number, made or not."""
    return Spec(index, seed, "null", "", (), (), 1.0, small).case_id
