"""The campaign: cases by kind and number, their outcomes in a file that a later run goes on with, the table."""

import errno
import json
import random
import shutil
from collections import Counter
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path

from .. import outcomes
from . import finding, learning, scenes
from .bases import Bases
from .limits import Limits
from .running import Outcome, run

#: What makes a case, by the name of its kind.
KINDS = {**learning.KINDS, **finding.KINDS, **scenes.KINDS}
RESULTS = ("refused", "accepted", "broken")


@dataclass(frozen=True)
class Plan:
    """Which cases, and under which limits."""

    seed: int
    count: int
    kinds: tuple[str, ...]
    limits: Limits
    jobs: int

    def cases(self) -> list[tuple[str, int]]:
        """Kind and number of every case."""
        return [(kind, number) for number in range(self.count) for kind in self.kinds]


@dataclass(frozen=True)
class Record:
    """A case and its outcome."""

    kind: str
    number: int
    seed: int
    result: str
    why: str


def records(path: Path) -> list[Record]:
    """Outcomes so far; a last line that was cut short is left out."""
    return outcomes.read(path, Record)


def one(bases: Bases, work: Path, plan: Plan, kind: str, number: int) -> Record:
    """Make and run a case. The folder of one that is broken stays."""
    folder = work / "cases" / f"{kind.replace(' ', '-')}-{number}"
    # On a busy machine the second that SIGINT may take is soon over: such a case is made and run again.
    for _ in range(2):
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        case = KINDS[kind](bases, folder, random.Random(f"{plan.seed}/{kind}/{number}"))
        try:
            outcome = run(case, plan.limits, folder)
        except (ValueError, OSError) as error:
            # A word that no command line can hold never reaches the program; any other failure is the campaign's own.
            if isinstance(error, OSError) and error.errno != errno.E2BIG:
                raise
            outcome = Outcome("refused", f"by the system: {error}")
        if "SIGINT took" not in outcome.why:
            break
    if outcome.result == "broken":
        words = [part.decode("utf-8", "replace") if isinstance(part, bytes) else str(part) for part in case.command]
        (folder / "command.json").write_text(json.dumps([word.encode("utf-8", "replace").decode() for word in words]))
    else:
        shutil.rmtree(folder, ignore_errors=True)
    return Record(kind, number, plan.seed, outcome.result, outcome.why.encode("utf-8", "replace").decode())


def go(bases: Bases, work: Path, plan: Plan) -> Iterable[Record]:
    """Run the cases without an outcome; write and yield each."""
    path = work / "outcomes.jsonl"
    done = {(record.kind, record.number) for record in records(path) if record.seed == plan.seed}
    todo = [case for case in plan.cases() if case not in done]
    with open(path, "a") as file, ThreadPoolExecutor(plan.jobs) as pool:
        waiting = [pool.submit(one, bases, work, plan, *case) for case in todo]
        try:
            for future in as_completed(waiting):
                record = future.result()
                file.write(json.dumps(asdict(record)) + "\n")
                file.flush()
                yield record
        finally:
            pool.shutdown(cancel_futures=True)


def table(found: list[Record]) -> str:
    """Inputs, refused, accepted and broken by kind, as Markdown."""
    counts = Counter((record.kind, record.result) for record in found)
    kinds = [kind for kind in KINDS if any(counts[kind, result] for result in RESULTS)]
    lines = ["| kind | inputs | refused | accepted | broken |", "|---|---|---|---|---|"]
    for kind in (*kinds, None):
        row = [
            sum(n for (of, result), n in counts.items() if kind in (None, of) and result == which) for which in RESULTS
        ]
        lines.append(f"| {kind or 'all'} | {sum(row)} | " + " | ".join(map(str, row)) + " |")
    return "\n".join(lines)
