"""The tank's pictures: one run's raw traces, and force against speed by direction."""

import csv
import os
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import numpy as np

from hydro_tools.figure_style import STYLE

from . import conditions
from .recording import Run

matplotlib.use("svg")
plt.rcParams.update(STYLE)
COLOURS = {"x": "#1b6ca8", "y": "#d1495b"}
#: Drawn points a second of a trace.
DRAWN_RATE = 20.0


def save(figure, path: Path) -> None:
    """Write a figure beside and rename it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(path.name + ".tmp")
    figure.savefig(beside, format="svg", metadata={"Date": None})
    plt.close(figure)
    os.replace(beside, path)


def raw(run: Run, path: Path) -> None:
    """Readings of the load cell along x and y, tow after tow, unprocessed."""
    stride = round(run.rate / DRAWN_RATE)
    time = np.arange(len(run.reading))[::stride] / run.rate
    figure, axis = plt.subplots(figsize=(9, 3.4), layout="constrained")
    for column, name in enumerate(COLOURS):
        axis.plot(time, run.reading[::stride, column], color=COLOURS[name], lw=0.6, label=f"force {name}")
    axis.axhline(0.0, color="black", lw=0.6)
    top = axis.get_ylim()[1]
    for index, (leave, _, _, stop) in zip(run.condition, run.marks):
        condition = conditions.Condition(int(index))
        axis.axvspan(leave, stop, color="black", alpha=0.05, lw=0)
        axis.text((leave + stop) / 2, top, f"tow along {condition.stance.direction}", ha="center", va="bottom")
    stance = conditions.Condition(int(run.condition[0])).stance
    speed = conditions.Condition(int(run.condition[0])).speed
    axis.set(xlabel="time [s]", ylabel="load cell [N]", xlim=(0, time[-1]))
    axis.set_title(
        f"raw, {speed} m/s, thigh {stance.thigh} rad, calf {stance.calf} rad", loc="left", pad=18, fontsize=9
    )
    axis.legend(frameon=False, loc="lower left", ncols=2)
    save(figure, path)


def speeds(table: Path, path: Path) -> None:
    """Mean force of every tow against its speed, a panel a direction, a line a leg configuration."""
    with table.open(newline="") as file:
        rows = list(csv.DictReader(file))
    figure, axes = plt.subplots(1, len(conditions.DIRECTIONS), figsize=(9, 3.2), sharey=True, layout="constrained")
    for axis, direction in zip(axes, conditions.DIRECTIONS):
        for number in range(conditions.CONFIGURATIONS):
            chosen = [row for row in rows if row["direction"] == direction and int(row["configuration"]) == number]
            chosen.sort(key=lambda row: float(row["speed"]))
            at = [float(row["speed"]) for row in chosen]
            for name, colour in COLOURS.items():
                axis.errorbar(
                    at,
                    [float(row[f"force_{name}"]) for row in chosen],
                    [2 * float(row[f"error_{name}"]) for row in chosen],
                    color=colour,
                    lw=0.7,
                    elinewidth=0.7,
                    marker=".",
                    ms=3,
                    label=f"force {name}" if number == 0 else None,
                )
        axis.set(title=f"along {direction}", xlabel="speed [m/s]", xticks=conditions.SPEEDS)
    axes[0].set_ylabel("mean force of the water [N]")
    axes[0].legend(frameon=False)
    save(figure, path)
