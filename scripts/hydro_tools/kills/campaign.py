"""Cases by job, trouble and number; what came of them, in a file that a later run goes on with; the table."""

import json
import random
import shutil
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

from .. import outcomes
from . import KillsError
from .content import content, differences
from .jobs import Job
from .trouble import End, alone, full, killed, twice

#: Disturbances and what their columns count.
TROUBLES = ("kill", "full", "two")


@dataclass(frozen=True)
class Record:
    """A case. struck: it did not end well by itself; went_on: the second run said that it goes on."""

    job: str
    trouble: str
    number: int
    seed: int
    struck: bool
    went_on: bool
    broken: str


@dataclass(frozen=True)
class Undisturbed:
    """A run without trouble, and what it leaves."""

    end: End
    content: dict[str, str]


def undisturbed(job: Job, folder: Path) -> Undisturbed:
    """Run a job twice; both must leave the same."""
    ends, contents = [], []
    for number in range(2):
        place = begun(job, folder / str(number))
        ends.append(alone(job.command, place))
        if ends[-1].status or ends[-1].broken:
            raise KillsError(f"{job.command[:3]}: {ends[-1].broken or ends[-1].text.strip()[-400:]}")
        contents.append(content(place))
    if unlike := differences(*contents):
        raise KillsError(f"{job.command[:3]}: two undisturbed runs differ: {unlike}")
    return Undisturbed(max(ends, key=lambda end: end.seconds), contents[0])


def one(job: Job, trouble: str, expected: Undisturbed, folder: Path, chance: random.Random) -> tuple[bool, bool, str]:
    """Disturb a job and run it again to its end: whether it was struck, whether it went on, what is broken."""
    place = begun(job, folder)
    if trouble == "two":
        first = twice(job.command, place, expected.end, chance, job.again)
    else:
        first = {"kill": killed, "full": full}[trouble](job.command, place, expected.end, chance)
    if first.broken:
        return True, False, first.broken
    struck = first.status != 0
    # A run that ended well leaves what an undisturbed one does; then there is nothing to go on with.
    if not struck:
        return False, False, differences(expected.content, content(place))
    left = job.left(place)
    unlike = differences(expected.content, content(place))
    if trouble == "two" or not unlike:
        return True, False, unlike
    second = alone((*job.command, *job.again), place)
    went_on = bool(job.says.search(second.text))
    if second.broken or second.status:
        return True, went_on, second.broken or f"does not go on: {second.text.strip()[-300:]}"
    unlike = differences(expected.content, content(place))
    if not unlike and left and not went_on:
        unlike = "does not say that it goes on"
    return True, went_on, unlike


def go(jobs: dict[str, Job], work: Path, counts: dict[str, int], seed: int) -> Iterable[Record]:
    """Run the cases without an outcome; write and yield each. counts: cases of a job by trouble."""
    path = work / "outcomes.jsonl"
    done = {(record.job, record.trouble, record.number) for record in records(path) if record.seed == seed}
    for name, job in jobs.items():
        todo = [(t, n) for t in TROUBLES for n in range(counts[t]) if (name, t, n) not in done]
        if not todo:
            continue
        short = name.replace(" ", "-")
        expected = undisturbed(job, work / "undisturbed" / short)
        for trouble, number in todo:
            folder = work / "cases" / f"{short}-{trouble}-{number}"
            chance = random.Random(f"{seed}/{name}/{trouble}/{number}")
            found = Record(name, trouble, number, seed, *one(job, trouble, expected, folder, chance))
            if not found.broken:
                shutil.rmtree(folder)
            with open(path, "a") as file:
                file.write(json.dumps(asdict(found)) + "\n")
            yield found


def records(path: Path) -> list[Record]:
    """Outcomes so far; a last line that was cut short is left out."""
    return outcomes.read(path, Record)


def table(found: list[Record]) -> str:
    """Cases by job and trouble, as Markdown."""
    lines = [
        "| command | trouble | cases | struck | said that it goes on | same bytes at the end | broken |",
        "|---|---|---|---|---|---|---|",
    ]
    pairs = dict.fromkeys((record.job, record.trouble) for record in found)
    for job, trouble in pairs:
        of = [record for record in found if (record.job, record.trouble) == (job, trouble)]
        counts = (
            len(of),
            sum(record.struck for record in of),
            sum(record.went_on for record in of),
            sum(not record.broken for record in of),
            sum(bool(record.broken) for record in of),
        )
        lines.append(f"| `{job}` | {trouble} | " + " | ".join(map(str, counts)) + " |")
    return "\n".join(lines)


def begun(job: Job, folder: Path) -> Path:
    """A folder as it is before a job's first run."""
    shutil.rmtree(folder, ignore_errors=True)
    if job.given:
        shutil.copytree(job.given, folder)
    else:
        folder.mkdir(parents=True)
    return folder
