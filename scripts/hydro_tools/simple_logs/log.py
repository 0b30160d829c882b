"""One experiment: its nominal, its truth, and the logs that are written."""

import csv
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

#: Columns of a log by name, `time` [s] among them.
Columns = dict[str, np.ndarray]


@dataclass(frozen=True)
class Experiment:
    """A nominal that lacks the water, and runs of the truth."""

    #: MJCF.
    nominal: str
    #: Step of the nominal [s].
    step: float
    #: What is missing: effect and parameter, value.
    truth: dict[str, float]
    #: The columns of a run, from its number and a generator of random numbers; commands are those of a step later, for
    #: a row's label is that late.
    run: Callable[[int, np.random.Generator], Columns]
    runs: int

    def write(self, folder: Path, seed: int) -> None:
        """Writes FOLDER/nominal.xml, FOLDER/trials/*.csv and FOLDER/truth.json."""
        (folder / "trials").mkdir(parents=True, exist_ok=True)
        (folder / "nominal.xml").write_text(self.nominal)
        (folder / "truth.json").write_text(json.dumps(self.truth, indent=1) + "\n")
        for number in range(self.runs):
            columns = self.run(number, np.random.default_rng([seed, number]))
            columns["time"] = columns["time"] + self.step
            with open(folder / "trials" / f"run_{number}.csv", "w", newline="") as file:
                rows = csv.writer(file)
                rows.writerow(columns)
                rows.writerows([f"{value:.6g}" for value in row] for row in zip(*columns.values()))


def harmonics(rng: np.random.Generator, lowest: float, highest: float, width: int = 1) -> Callable[[float], np.ndarray]:
    """Commands between -1 and 1: sums of three sines each, of frequencies [Hz] between two."""
    frequencies = rng.uniform(lowest, highest, (3, width))
    phases = rng.uniform(0, 2 * np.pi, (3, width))
    amplitudes = rng.uniform(0.2, 0.45, (3, width))
    return lambda t: np.clip(np.sum(amplitudes * np.sin(2 * np.pi * frequencies * t + phases), 0), -1, 1)
