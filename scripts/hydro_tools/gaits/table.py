"""Gaits beside each other: what each keeps of its speed in the truth."""

from pathlib import Path
from typing import Any

import numpy as np

from hydro_mujoco.recording.progress import Progress

from . import gait_file, replay
from .waters import LEARNT_IN, WATERS

#: Waters in which every gait is swum, besides the one that it was learnt in.
JUDGED_IN = ("truth", "strip")
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
        for name in dict.fromkeys((gait.water, *JUDGED_IN)):
            track = replay.replay(gait, WATERS[name], seconds=seconds, starts=starts, threads=threads)
            row[name] = replay.summary(track)
        found.append(row)
        progress.advance()
    return sorted(found, key=lambda row: (LEARNT_IN.index(row["water"]), row["seed"]))


def markdown(rows: list[dict[str, Any]]) -> list[str]:
    """A row a gait, and one of the means of those of a water."""
    best = [row["truth"]["speed"] for row in rows if row["water"] == "truth"]
    able = float(np.mean(best)) if best else 0.0
    head = [
        "learnt in",
        "seed",
        "speed there",
        "in the truth",
        "kept",
        "of the truth's",
        "depth",
        "tilt",
        "heading",
        "cost",
    ]
    head += ["swam", "in strip theory"]
    table = [head, ["---"] * len(head)]
    for name in LEARNT_IN:
        own = [row for row in rows if row["water"] == name]
        for row in own:
            truth = row["truth"]
            cells = [name, str(row["seed"]), *_speeds(row[name]["speed"], truth["speed"], able)]
            cells += [_number(truth["depth_worst"], 2), _number(truth["tilt_worst"], 0)]
            cells += [_number(truth["heading_drift"], 0), _number(truth["cost"], 2), _number(truth["swam"], 0)]
            table.append([*cells, _number(row["strip"]["speed"], 3)])
        if own:
            there, truth, strip = (float(np.mean([row[water]["speed"] for row in own])) for water in (name, *JUDGED_IN))
            means = [f"**{cell}**" for cell in _speeds(there, truth, able)]
            table.append([name, "**mean**", *means, "", "", "", "", "", f"**{strip:.3f}**"])
    return [f"| {' | '.join(cells)} |" for cells in table]


def _speeds(there: float, truth: float, able: float) -> list[str]:
    """Speeds where a gait was learnt and in the truth; the share kept, and the share of a gait learnt in the truth."""
    return [f"{there:.3f}", f"{truth:.3f}", _share(truth, there), _share(truth, able)]


def _share(part: float, whole: float) -> str:
    return f"{part / whole:.0%}" if whole >= SLOWEST else "-"


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
