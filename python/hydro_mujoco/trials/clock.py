"""Times of samples: which clock, in which unit, in which order."""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from ..errors import DataError
from .log import Log, Samples
from .mapping.schema import Time
from .report import Report
from .scratch import Table, blocks, some, steps
from .units import TIMES
from .words import counted, listed, seconds

#: The clock of the log itself.
LOG = "log"
#: Columns of a table that are its time where the mapping names none.
TIME_COLUMNS = ("time", "t", "timestamp", "Time", "stamp", "TimeUS", "time_s")
#: A median step between samples beyond these is in another unit than seconds [s].
SHORTEST_STEP, LONGEST_STEP = 2e-5, 5.0
#: Steps that a sensor of a vehicle has [s].
PLAUSIBLE_STEP = (5e-4, 2.5)
#: Difference between a message's stamp and its log time that is worth a word, and that is another clock [s].
SAID_OFFSET, OTHER_CLOCK = 0.02, 1.0
#: Spread of that difference [s], and of log times about even ones as a share of the step.
SPREAD, UNEVEN = 0.1, 0.5


@dataclass(frozen=True)
class Ordered:
    """Times of a topic's samples, strictly increasing, (n,), and the rows of the samples that they belong to, (n,)."""

    times: np.ndarray
    rows: np.ndarray


def clock_field(clock: str, log: Log, columns: Collection[str] | None) -> str | None:
    """The field of a clock; None for log time. columns: of a table, which has no log time."""
    if clock != LOG:
        return clock
    if columns is None:
        return None
    found = next((name for name in TIME_COLUMNS if name in columns), None)
    if found is None:
        raise DataError(
            f'{log.path}: which column is the time? `[time] clock = "..."` names it; the columns are {listed(columns)}'
        )
    return found


def ordered(topic: str, samples: Samples, field: str | None, time: Time, report: Report) -> Ordered:
    """Times of the samples by the clock `field`, put in order; what was wrong goes into the report."""
    if field is None:
        times, factor = samples.times, 1.0
        if not report.is_table:
            report.offsets[topic] = 0.0
    else:
        times, factor = samples.values[:, samples.fields.index(field)], TIMES[time.unit]
    shift = 0.0
    if field is not None and not report.is_table:
        shift = _compared(topic, times, factor, samples.times, field, time, report)
    table, last, back, worst = Table(2), -np.inf, 0, 0.0
    for block in blocks(len(times)):
        rows = block.start + np.flatnonzero(np.isfinite(times[block]))
        found = times[rows] * factor + shift
        later = np.diff(found, prepend=last)
        back, worst = back + int((later < 0).sum()), min(worst, float(later.min(initial=0.0)))
        last = float(found[-1]) if found.size else last
        table.append(np.column_stack([found, rows]))
    if len(table) < len(times):
        report.note(f"`{topic}`: {counted(len(times) - len(table), 'sample')} without a time dropped")
    if not len(table):
        raise DataError(f"topic `{topic}`: no sample has a time in `{field}`")
    pairs = table.array()
    if back:
        report.suspect(
            f"the times of `{topic}` run back {back} times, by up to {seconds(-worst)}: samples were put in "
            "order; clocks that were set, or messages of several senders"
        )
        # Complex numbers are sorted by their real part, then by the imaginary one, in place.
        pairs.view(complex).sort(axis=0)
    found = _distinct(topic, pairs, report)
    _suspect_unit(topic, found.times, time, report)
    if field is None:
        _suspect_uneven(topic, found.times, report)
    return found


def _distinct(topic: str, pairs: np.ndarray, report: Report) -> Ordered:
    """Of times and rows in order, the first of each time."""
    times, rows, last = Table(1), Table(1), -np.inf
    for block in blocks(len(pairs)):
        found = pairs[block]
        found = found[np.diff(found[:, 0], prepend=last) > 0]
        last = float(found[-1, 0]) if len(found) else last
        times.append(found[:, 0])
        rows.append(found[:, 1])
    if same := len(pairs) - len(times):
        report.note(f"`{topic}`: {counted(same, 'sample')} of {len(pairs)} have the stamp of another, dropped")
        if same > 0.05 * len(pairs):
            report.suspect(f"{100 * same / len(pairs):.0f} % of the stamps of `{topic}` are the same as the one before")
    return Ordered(times.array()[:, 0], rows.array()[:, 0])


def _compared(
    topic: str, times: np.ndarray, factor: float, logged: np.ndarray, field: str, time: Time, report: Report
) -> float:
    """Times beside the log's: their offset is said, or returned [s] where they are to be aligned."""
    at = some(len(times))
    late = logged[at] - times[at] * factor
    late = late[np.isfinite(late)]
    if not late.size:
        return 0.0
    middle, spread = float(np.median(late)), float(np.ptp(np.percentile(late, [2, 98])))
    if spread > SPREAD:
        report.suspect(
            f"`{field}` of `{topic}` and the log's time drift apart: their difference spreads over {seconds(spread)}; "
            "messages held up, or two clocks"
        )
    if time.align:
        least = min(
            float(np.nanmin(logged[block] - times[block] * factor, initial=np.inf)) for block in blocks(len(times))
        )
        report.note(f"`{topic}`: `{field}` moved by {seconds(least)}, its least delay against the log")
        return least
    if abs(middle) > SAID_OFFSET:
        report.note(
            f"`{topic}`: `{field}` is {seconds(abs(middle))} {'before' if middle > 0 else 'after'} the log's time"
        )
    report.offsets[topic] = middle
    return 0.0


def suspect_mixed(report: Report) -> None:
    """Say where topics are on different clocks."""
    if not report.offsets:
        return
    names = sorted(report.offsets, key=lambda topic: report.offsets[topic])
    first, last = names[0], names[-1]
    apart = report.offsets[last] - report.offsets[first]
    if apart > OTHER_CLOCK:
        report.suspect(
            f"mixed clocks: the stamps of `{last}` are {seconds(apart)} behind those of `{first}` against the "
            "log's time; "
            'set `align = true`, or `clock = "log"` for one of them'
        )


def _suspect_unit(topic: str, times: np.ndarray, time: Time, report: Report) -> None:
    if times.size < 3:
        return
    step = float(np.median(steps(times)))
    if SHORTEST_STEP <= step <= LONGEST_STEP:
        return
    raw = step / TIMES[time.unit]
    fits = [unit for unit, size in TIMES.items() if PLAUSIBLE_STEP[0] <= raw * size <= PLAUSIBLE_STEP[1]]
    repair = f'; is it in {fits[0]}? `[time] unit = "{fits[0]}"`' if fits else ""
    report.suspect(f"the samples of `{topic}` are {seconds(step)} apart{repair}")


def _suspect_uneven(topic: str, times: np.ndarray, report: Report) -> None:
    found = steps(times)
    if found.size < 20 or report.is_table:
        return
    middle = float(np.median(found))
    share = float((np.abs(found - middle) > UNEVEN * middle).mean())
    if share > 0.2:
        report.note(
            f"`{topic}`: {100 * share:.0f} % of its log times are uneven by more than half a step; stamps of the "
            "messages (`clock`) are better where it has them"
        )
