"""Gaits beside each other: what each keeps of its speed in the truth."""

from pathlib import Path
from typing import Any

import numpy as np

from hydro_mujoco.recording.progress import Progress

from . import gait_file, replay
from .waters import TRUTHS, WATERS

#: Speed below which a share of it says nothing [m/s].
SLOWEST = 0.05
#: Name -> what it is, its unit, digits.
MEASURES = {
    "speed": ("speed", "m/s", 3),
    "depth_drift": ("depth after", "m", 2),
    "depth_worst": ("greatest error of depth", "m", 2),
    "tilt_worst": ("greatest tilt", "degrees", 0),
    "heading_drift": ("heading after", "degrees", 0),
    "cost": ("cost of transport", "1", 2),
    "swam": ("swam", "s", 0),
}


def lines(found: dict[str, float | None]) -> list[str]:
    """A summary in words."""
    return [
        f"  {what}: {_number(found[name], digits)}{'' if unit == '1' else f' {unit}'}"
        for name, (what, unit, digits) in MEASURES.items()
    ]


def rows(paths: list[Path], *, seconds: float, starts: int, threads: int) -> list[dict[str, Any]]:
    """Each gait's water, seed and its summaries by water."""
    found = []
    model = WATERS["truth"].model()
    progress = Progress(len(paths), "gaits")
    for path in paths:
        gait = gait_file.read(path, model)
        row: dict[str, Any] = {"water": gait.water, "seed": gait.seed, "episodes": gait.episodes, "score": gait.score}
        for name in dict.fromkeys((gait.water, *TRUTHS)):
            track = replay.replay(gait, WATERS[name], seconds=seconds, starts=starts, threads=threads)
            row[name] = replay.summary(track)
        found.append(row)
        progress.advance()
    return sorted(found, key=lambda row: (list(WATERS).index(row["water"]), row["seed"]))


def markdown(rows: list[dict[str, Any]]) -> list[str]:
    """A table a truth: a row a gait of the waters that stand for it, and one of the means of those of a water."""
    lines = []
    for truth in TRUTHS:
        waters = [name for name, water in WATERS.items() if water.stands_for == truth]
        own = [[row for row in rows if row["water"] == name] for name in waters]
        if any(own):
            lines += [*([""] if lines else []), *_of_truth(truth, own)]
    return lines


def _of_truth(truth: str, waters: list[list[dict[str, Any]]]) -> list[str]:
    """The table of one truth; `waters`: the rows of each water."""
    best = [row[truth]["speed"] for rows in waters for row in rows if row["water"] == truth]
    able = float(np.mean(best)) if best else 0.0
    (other,) = TRUTHS.keys() - {truth}
    head = ["learnt in", "seed", "speed there", "in the truth", "kept", "of the truth's", "depth", "tilt", "heading"]
    head += ["cost", "swam", f"in {TRUTHS[other]}"]
    table = [head, ["---"] * len(head)]
    for rows in filter(None, waters):
        name = rows[0]["water"]
        for row in rows:
            there = row[truth]
            cells = [name, str(row["seed"]), *_speeds(row[name]["speed"], there["speed"], able)]
            cells += [_number(there["depth_worst"], 2), _number(there["tilt_worst"], 0)]
            cells += [_number(there["heading_drift"], 0), _number(there["cost"], 2), _number(there["swam"], 0)]
            table.append([*cells, _number(row[other]["speed"], 3)])
        means = [float(np.mean([row[water]["speed"] for row in rows])) for water in (name, truth, other)]
        speeds = [f"**{cell}**" for cell in _speeds(*means[:2], able)]
        table.append([name, "**mean**", *speeds, "", "", "", "", "", f"**{means[2]:.3f}**"])
    return [f"| {' | '.join(cells)} |" for cells in table]


def _speeds(there: float, truth: float, able: float) -> list[str]:
    """Speeds where a gait was learnt and in the truth; the share kept, and the share of a gait learnt in the truth."""
    return [f"{there:.3f}", f"{truth:.3f}", _share(truth, there), _share(truth, able)]


def _share(part: float, whole: float) -> str:
    return f"{part / whole:.0%}" if whole >= SLOWEST else "-"


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
