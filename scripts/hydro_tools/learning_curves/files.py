"""Curves as csv and as a figure."""

import csv
import io
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
from matplotlib.ticker import MaxNLocator, ScalarFormatter

from hydro_mujoco.recording.files import write_beside
from hydro_tools.figure_style import STYLE

from .curve import FIELDS, Curve

matplotlib.use("svg")


def write_csv(curves: list[Curve], path: Path) -> None:
    """A row a pass: the run's name, then FIELDS; six significant digits."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["run", *FIELDS])
    for curve in curves:
        table.writerows([curve.name, *(f"{row[field]:.6g}" for field in FIELDS)] for row in curve.rows)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_beside(path, text.getvalue().encode())


def draw(curves: list[Curve], path: Path) -> None:
    """Validation error against the pass, logarithmic, a line a training."""
    with plt.rc_context(STYLE):
        figure, axis = plt.subplots(figsize=(8, 4.2), layout="constrained")
        colours = plt.get_cmap("tab20")
        for index, curve in enumerate(curves):
            passes = [row["epoch"] + 1 for row in curve.rows]
            axis.plot(passes, curve.validation, marker=".", ms=4, lw=1.2, color=colours(index % 20), label=curve.name)
        axis.set(xlabel="passes over the training split", ylabel="validation nRMSE", yscale="log")
        axis.xaxis.set_major_locator(MaxNLocator(integer=True))
        for formatter in (axis.yaxis.set_major_formatter, axis.yaxis.set_minor_formatter):
            formatter(ScalarFormatter())
        figure.legend(frameon=False, loc="outside right upper")
        text = io.BytesIO()
        figure.savefig(text, format="svg", metadata={"Date": None})
        plt.close(figure)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_beside(path, text.getvalue())
