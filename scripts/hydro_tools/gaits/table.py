"""Gaits beside each other: what each keeps of its speed in the truth."""

from pathlib import Path
from typing import Any

import numpy as np

from . import gait_file, replay
from .waters import LEARNT_IN, WATERS

#: Waters in which every gait is swum, besides the one that it was learnt in.
JUDGED_IN = ("truth", "strip")
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
    for path in paths:
        gait = gait_file.read(path, model)
        row: dict[str, Any] = {"water": gait.water, "seed": gait.seed, "episodes": gait.episodes, "score": gait.score}
        for name in dict.fromkeys((gait.water, *JUDGED_IN)):
            track = replay.replay(gait, WATERS[name], seconds=seconds, starts=starts, threads=threads)
            row[name] = replay.summary(track)
        found.append(row)
    return sorted(found, key=lambda row: (LEARNT_IN.index(row["water"]), row["seed"]))


def markdown(rows: list[dict[str, Any]]) -> list[str]:
    """The table of single gaits, then that of their means by water; share: of the speed where it was learnt."""
    head = ["learnt in", "seed", "speed there", "in the truth", "kept", "depth worst", "tilt worst", "heading", "cost"]
    head += ["swam", "in strip theory", "kept"]
    table = [head, ["---"] * len(head)]
    for row in rows:
        there, truth, strip = row[row["water"]], row["truth"], row["strip"]
        cells = [row["water"], str(row["seed"]), _number(there["speed"], 3), _number(truth["speed"], 3)]
        cells += [kept(truth, there), _number(truth["depth_worst"], 2), _number(truth["tilt_worst"], 0)]
        cells += [_number(truth["heading_drift"], 0), _number(truth["cost"], 2), _number(truth["swam"], 0)]
        cells += [_number(strip["speed"], 3), kept(strip, there)]
        table.append(cells)
    for name in LEARNT_IN:
        own = [row for row in rows if row["water"] == name]
        if own:
            means = [np.mean([row[water]["speed"] for row in own]) for water in (name, "truth", "strip")]
            ends = ["**mean**", f"{means[0]:.3f}", f"{means[1]:.3f}", f"{means[1] / means[0]:.0%}"]
            table.append([name, *ends, "", "", "", "", "", f"{means[2]:.3f}", f"{means[2] / means[0]:.0%}"])
    return [f"| {' | '.join(cells)} |" for cells in table]


def kept(found: dict[str, Any], there: dict[str, Any]) -> str:
    """Share of the speed where a gait was learnt."""
    return f"{found['speed'] / there['speed']:.0%}" if there["speed"] > 0 else "-"


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
