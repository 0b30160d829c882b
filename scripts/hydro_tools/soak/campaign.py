"""All cases in an order, the memory that they leave, and the table."""

import ctypes
import itertools
import math
import random
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco

from ..released import RELEASED
from . import energy
from .case import Case, Outcome, run
from .catalogue import Effect
from .motion import MOTIONS
from .scenes import INTEGRATORS, allows

#: Effects that push without end: in ten minutes a body beside no other is too fast for any integrator; what stops it.
PUSHES, BRAKE = ("constant_force",), "linear_drag"


@dataclass(frozen=True)
class Record:
    """A case, its outcome, and the resident memory after it [MB]."""

    kind: str
    case: Case
    outcome: Outcome
    memory: float


def cases(effects: Sequence[Effect], seed: int) -> Iterator[tuple[str, Case]]:
    """All cases of a seed: single ones first, then pairs, each in every integrator and motion."""
    singles = alone(effects, seed) + _calm(effects, 1, seed)
    random.Random(seed).shuffle(singles)
    yield from singles
    ways = list(itertools.product(INTEGRATORS, MOTIONS))
    pairs = []
    for pair, (integrator, motion) in itertools.product(itertools.combinations(effects, 2), ways):
        pairs.append(("pair", Case("", pair, integrator, motion, False, seed)))
    on_trunk = [effect for effect in effects if effect.target == "hull"]
    for name, effect, (integrator, motion) in itertools.product(RELEASED, on_trunk, ways):
        if allows(name, effect):
            pairs.append(("checkpoint and effect", Case(name, (effect,), integrator, motion, False, seed)))
    pairs += _calm(effects, 2, seed)
    random.Random(seed + 1).shuffle(pairs)
    yield from pairs


def alone(effects: Sequence[Effect], seed: int) -> list[tuple[str, Case]]:
    """Every checkpoint and effect by itself, in every integrator and motion; energy is compared in shorter runs."""
    ways = list(itertools.product(INTEGRATORS, MOTIONS))
    singles = []
    for name, (integrator, motion) in itertools.product(RELEASED, ways):
        singles.append(("checkpoint", Case(name, (), integrator, motion, False, seed)))
    brakes = tuple(effect for effect in effects if effect.effect == BRAKE)
    for effect, (integrator, motion) in itertools.product(effects, ways):
        beside = brakes if effect.effect in PUSHES else ()
        singles.append(("effect", Case("", (effect, *beside), integrator, motion, False, seed)))
    return singles


def _calm(effects: Sequence[Effect], count: int, seed: int) -> list[tuple[str, Case]]:
    """So many effects at once that only take energy, which is compared."""
    chosen = itertools.product(itertools.combinations(effects, count), INTEGRATORS)
    return [
        ("energy", Case("", each, integrator, "violent", True, seed))
        for each, integrator in chosen
        if energy.only_takes(each)
    ]


def endless(effects: Sequence[Effect], seed: int) -> Iterator[tuple[str, Case]]:
    """All cases, with other seeds once all are done."""
    for turn in itertools.count(seed):
        yield from cases(effects, turn)


def go(
    listed: Iterable[tuple[str, Case]], steps: int, *, seconds: float = math.inf, most: int | None = None
) -> Iterator[Record]:
    """Run cases, `most` of them and until the time is over."""
    warnings: Counter = Counter()
    mujoco.set_mju_user_warning(lambda text: warnings.update([text]))
    end = time.monotonic() + seconds
    for kind, case in itertools.islice(listed, most):
        if time.monotonic() > end:
            return
        yield Record(kind, case, run(case, steps, warnings), resident())


def resident() -> float:
    """Resident memory of this process, after what is free went back to the system [MB]."""
    ctypes.CDLL(None).malloc_trim(0)
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6


def growth(memory: Sequence[float]) -> float:
    """Growth of memory over the second half of the cases [MB]: of the means of its quarters."""
    half = memory[len(memory) // 2 :]
    if len(half) < 2:
        return 0.0
    middle = len(half) // 2
    earlier, later = half[:middle], half[middle:]
    return sum(later) / len(later) - sum(earlier) / len(earlier)


@dataclass
class Tally:
    """Cases of a kind under an integrator. energy: the greatest over its bound."""

    cases: int = 0
    steps: int = 0
    asleep: int = 0
    energy: float = 0.0
    broken: int = 0

    def add(self, outcome: Outcome) -> None:
        """Count a case."""
        self.cases += 1
        self.steps += outcome.steps
        self.asleep += outcome.asleep
        self.energy = max(self.energy, outcome.energy)
        self.broken += bool(outcome.broken)


def table(tallies: Mapping[tuple[str, str], Tally]) -> str:
    """Tallies by kind and integrator, as Markdown."""
    lines = [
        "| what acts | integrator | cases | steps | with a tree asleep | greatest energy over its bound | broken |",
        "|---|---|---|---|---|---|---|",
    ]
    for (kind, integrator), of in sorted(tallies.items()):
        energy = f"{of.energy:.4f}" if of.energy else ""
        columns = (kind, integrator, of.cases, f"{of.steps:,}", of.asleep, energy, of.broken)
        lines.append(f"| {' | '.join(map(str, columns))} |")
    return "\n".join(lines)
