"""Strength of a hidden part: the whitened norm of its change of the readings, as in hidden_cases/strength.py.

The same truth without the part starts anew from the truth's own state every second, under the same commands.
`projected` is what the nominal's uncertain numbers cannot explain, linear about the truth without the part.
"""

from dataclasses import dataclass

import numpy as np

from ..hidden_cases.frames import difference
from ..hidden_cases.strength import SLOPE, remainder
from . import fossen, nominal
from .fossen import Recording, Vehicle
from .parts import Hidden, Part, small, uncertain, without

#: Seconds of a window; windows that stand for all where slopes are needed; step of these short runs [s].
WINDOW, MOST, STEP = 1.0, 24, 0.004


@dataclass(frozen=True)
class Outputs:
    """Sensors that are logged: columns of fossen's readings and their noise."""

    suite: str
    noise: float

    def whitened(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """(a - b) / noise [..., n] of readings [..., 19]; attitudes as rotation vectors."""
        parts = []
        for name in nominal.SUITES[self.suite]:
            columns = nominal.COLUMNS[name]
            if name == "attitude":
                change = difference(a[..., columns], b[..., columns])
            else:
                change = a[..., columns] - b[..., columns]
            logged = nominal.LOGGED[self.suite].get(name)
            change = change if logged is None else change[..., list(logged)]
            parts.append(change / (nominal.NOISE[name] * self.noise))
        return np.concatenate(parts, -1)


class Windows:
    """Windows of a second along a recorded truth. `kept`: rows of readings [M, K, 19] at the rows' instants."""

    def __init__(self, record: Recording, kept: np.ndarray, period: float, most: int | None = None):
        self.record, self.kept, self.period = record, kept, period
        self.rows = round(WINDOW / period)
        trials, total = kept.shape[:2]
        firsts = np.arange(0, total - self.rows + 1, self.rows)
        trial, first = np.repeat(np.arange(trials), len(firsts)), np.tile(firsts, trials)
        self.whole = len(trial)
        if most is not None and len(trial) > most:
            pick = np.linspace(0, len(trial) - 1, most).astype(int)
            trial, first = trial[pick], first[pick]
        self.trial, self.first = trial, first

    def truth(self) -> np.ndarray:
        """The truth's own readings [W, rows, 19]."""
        return self.kept[self.trial[:, None], self.first[:, None] + np.arange(self.rows)]

    def outputs(self, vehicles: list[Vehicle]) -> np.ndarray:
        """Readings [V, W, rows, 19] of vehicles that start as the truth was."""
        count, windows = len(vehicles), len(self.trial)
        rows = self.first[:, None] + np.arange(self.rows + 1)
        commands = np.tile(self.record.commands[self.trial[:, None], rows], (count, 1, 1))
        run = fossen.run(
            vehicles[0].stacked(vehicles[1:], windows),
            np.tile(self.record.states[self.trial, self.first], (count, 1)),
            lambda row, *_: commands[:, row],
            rows=self.rows,
            period=self.period,
            hold=nominal.STEP,
            step=STEP,
            start=np.tile(self.first * self.period, count),
        )
        per_row, lead = round(self.period / STEP), round(nominal.STEP / STEP)
        at = np.arange(1, self.rows + 1) * per_row - lead
        return run.readings[:, at].reshape(count, windows, self.rows, 19)


def measure(
    record: Recording,
    kept: np.ndarray,
    period: float,
    truth: Vehicle,
    hidden: Hidden,
    had: frozenset[Part],
    outputs: Outputs,
    *,
    rivals: bool,
) -> tuple[dict[str, float], dict[str, float]]:
    """Strength of a part, and its distances to the others where `rivals` are asked for.

    `raw` and `projected` as in the module; `form` is what is left of it when the nominal has the part in the
    catalogue's form with the best numbers: a strong part in a form of its own leaves a gap that others may fill.
    """
    part = hidden.part
    shadow = without(truth, part)
    every = Windows(record, kept, period)
    change = outputs.whitened(every.truth(), every.outputs([shadow])[0])
    raw = float(np.linalg.norm(change))
    few = Windows(record, kept, period, MOST)
    share = float(np.sqrt(few.whole / len(few.trial)))
    change = outputs.whitened(few.truth(), few.outputs([shadow])[0])
    nuisances = [(number.moved, SLOPE) for number in uncertain(had, truth.configuration)]
    others = [other for other in Part if other is not part] if rivals else []
    ways = nuisances + [(way, 0.05) for other in others for way in small(other)]
    slopes = share * _slopes(few, outputs, shadow, ways)
    known, free = slopes[..., : len(nuisances)], 1e3 * slopes[..., len(nuisances) :]
    norm = share * float(np.linalg.norm(change))
    projected = raw * remainder(share * change, known) / norm if norm > 1e-9 else 0.0
    plain = hidden.plain(truth)
    left = share * outputs.whitened(few.truth(), few.outputs([plain])[0])
    own = share * _slopes(few, outputs, plain, nuisances + [(way, 0.02) for way in small(part)])
    own[..., len(nuisances) :] *= 1e3
    distances = {}
    for other in others:
        # Free coefficients: a prior a thousand times wider.
        mine, free = free[..., : len(small(other))], free[..., len(small(other)) :]
        distances[other.value] = remainder(share * change, np.concatenate([known, mine], -1))
    strengths = {"projected": projected, "raw": raw, "form": remainder(left, own)}
    return strengths, dict(sorted(distances.items(), key=lambda pair: pair[1]))


def _slopes(windows: Windows, outputs: Outputs, vehicle: Vehicle, ways: list) -> np.ndarray:
    """Change of the whitened readings by each (way of moving a vehicle, step of it) [W, rows, n, p], a unit of it."""
    # A coefficient that is negative for a second does no harm.
    found = windows.outputs([way(vehicle, sign * step) for way, step in ways for sign in (1, -1)])
    pairs = zip(found[::2], found[1::2], (step for _, step in ways))
    return np.stack([outputs.whitened(up, down) / (2 * step) for up, down, step in pairs], -1)
