"""Where trials begin and end in a log."""

from dataclasses import dataclass

import numpy as np

from ..errors import DataError
from .mapping.schema import Mapping, Trials
from .report import Report
from .scratch import blocks
from .signals import Signals
from .words import counted, seconds

#: Trials of a log at most.
MOST = 1000
#: Share of a piece's length that is enough.
NEARLY = 0.9


@dataclass(frozen=True)
class Window:
    """A piece of the log, in its time [s]."""

    start: float
    stop: float

    @property
    def seconds(self) -> float:
        """Its length."""
        return self.stop - self.start


def windows(signals: Signals, mapping: Mapping, report: Report) -> list[Window]:
    """The trials of a log: no gap within, every actuator commanded, as windows or a mode say, cut to length.

    Raises:
        DataError: none is long enough; what is suspected of the log is said too.
    """
    trials = mapping.trials
    measured = {**signals.sensors, **signals.joints}
    pieces = _without_gaps([signal.times for signal in measured.values()], trials.gap)
    start, end = pieces[0].start, pieces[-1].stop
    if len(pieces) > 1:
        report.note(
            f"{counted(len(pieces) - 1, 'gap')} of more than {seconds(trials.gap)} in all sensors: trials end there"
        )
    commanded = max((signal.times[0] for signal in signals.actuators.values()), default=-np.inf)
    late = [piece for piece in pieces if piece.start < commanded]
    pieces = [Window(max(p.start, commanded), p.stop) for p in pieces if p.stop > commanded]
    if late and np.isfinite(commanded) and commanded - start > trials.gap:
        name = max(signals.actuators, key=lambda key: signals.actuators[key].times[0])
        report.note(f"dropped what is before {commanded:.3f} s, the first command of `{name}`")
    if trials.windows:
        asked = [Window(*pair) for pair in trials.windows]
        if outside := [w for w in asked if not any(w.start < p.stop and w.stop > p.start for p in pieces)]:
            raise DataError(
                f"{mapping.name}, [trials]: nothing was measured in the window {outside[0].start:g} to "
                f"{outside[0].stop:g} s; "
                f"the log has {_spans(pieces)}"
            )
        pieces = _both(pieces, asked)
    if signals.mode is not None:
        pieces = _both(pieces, _on(signals.mode.times, signals.mode.values[:, 0], end))
    if trials.length:
        pieces = [part for piece in pieces for part in _cut(piece, trials.length)]
    least = shortest(trials)
    kept = [piece for piece in pieces if piece.seconds >= least]
    if dropped := len(pieces) - len(kept):
        longest = max(piece.seconds for piece in pieces if piece.seconds < least)
        report.note(
            f"{counted(dropped, 'piece')} shorter than {seconds(least)} dropped, the longest of {seconds(longest)}"
        )
    if not kept:
        raise DataError(_nothing(signals, mapping, pieces, Window(start, end), report))
    if len(kept) > MOST:
        raise DataError(f"{len(kept)} trials; expected {MOST} at most: set gap, windows or length in [trials]")
    return kept


def shortest(trials: Trials) -> float:
    """The least length of a trial [s]; pieces of a given length are not too short."""
    return min(trials.shortest, NEARLY * trials.length) if trials.length else trials.shortest


def _nothing(signals: Signals, mapping: Mapping, pieces: list[Window], whole: Window, report: Report) -> str:
    longest = f", the longest of {seconds(max(p.seconds for p in pieces))}" if pieces else ""
    text = (
        f"no trial: {counted(len(pieces), 'piece')}{longest}, expected one of {seconds(shortest(mapping.trials))} "
        f"at least; sensors from {whole.start:.3f} s to {whole.stop:.3f} s"
    )
    if signals.actuators:
        first = max(signal.times[0] for signal in signals.actuators.values())
        text += f", all commands from {first:.3f} s"
    return "\nsuspected: ".join([text, *report.suspicions[:2]])


def _without_gaps(series: list[np.ndarray], gap: float) -> list[Window]:
    """The pieces in which no two neighbours of all times together are more than `gap` apart.

    series: of times, each increasing.
    """
    pieces: list[Window] = []
    for times in series:
        at = [np.flatnonzero(np.diff(times[b.start : b.stop + 1]) > gap) + b.start for b in blocks(len(times))]
        ends = np.concatenate(at)
        starts = np.concatenate([[0], ends + 1])
        pieces += [Window(float(times[a]), float(times[b])) for a, b in zip(starts, [*ends, times.size - 1])]
    pieces.sort(key=lambda piece: piece.start)
    found = pieces[:1]
    for piece in pieces[1:]:
        if piece.start - found[-1].stop > gap:
            found.append(piece)
        else:
            found[-1] = Window(found[-1].start, max(found[-1].stop, piece.stop))
    return found


def _both(one: list[Window], other: list[Window]) -> list[Window]:
    """The parts that are in a window of each list."""
    met = [Window(max(a.start, b.start), min(a.stop, b.stop)) for a in one for b in other]
    return [window for window in met if window.seconds > 0]


def _on(times: np.ndarray, values: np.ndarray, end: float) -> list[Window]:
    """Where a held signal is not zero."""
    found: list[Window] = []
    start = None
    for block in blocks(len(times)):
        is_on = values[block] != 0
        for place in np.flatnonzero(np.diff(is_on, prepend=start is not None)):
            time = float(times[block.start + place])
            if start is None:
                start = time
            else:
                found.append(Window(start, time))
                start = None
    return [*found, Window(start, float(end))] if start is not None else found


def _cut(piece: Window, length: float) -> list[Window]:
    """A window in equal parts of about `length` seconds."""
    parts = max(round(piece.seconds / length), 1)
    ends = np.linspace(piece.start, piece.stop, parts + 1)
    return [Window(float(a), float(b)) for a, b in zip(ends, ends[1:])]


def _spans(pieces: list[Window]) -> str:
    shown = ", ".join(f"{piece.start:.3f} to {piece.stop:.3f} s" for piece in pieces[:6])
    return (
        shown + (f", ... ({len(pieces)} pieces)" if len(pieces) > 6 else "") if pieces else "nothing with all commands"
    )
