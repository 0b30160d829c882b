"""The pictures beside the page: loss curves, and cost against size."""

from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt

from hydro_tools.figure_style import STYLE

from .parts import scaling, train

matplotlib.use("svg")
plt.rcParams.update(STYLE)
COLOURS = ("#1b6ca8", "#d1495b", "#5c946e", "#edae49")


def _save(figure, path: Path) -> None:
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


def losses(groups: dict, path: Path) -> None:
    """Losses of ours and of PyTorch, a panel a solver."""
    found = [solver for solver in train.SOLVERS if solver in groups]
    figure, axes = plt.subplots(1, len(found), figsize=(4.5 * len(found), 3), squeeze=False, layout="constrained")
    for axis, solver in zip(axes[0], found):
        ours, theirs = train.curves(groups[solver])
        axis.semilogy(theirs, color=COLOURS[1], lw=3, alpha=0.5, label="PyTorch")
        axis.semilogy(ours, color=COLOURS[0], lw=1, label="hydro")
        axis.set(title=train.SOLVERS[solver], xlabel="step", ylabel="loss [squared standard deviations]")
        axis.legend(frameon=False)
    _save(figure, path)


def sizes(groups: dict, path: Path) -> None:
    """A panel a sweep, both axes logarithmic."""
    found = [name for name in scaling.SWEEPS if name in groups]
    figure, axes = plt.subplots(2, 3, figsize=(12, 7), layout="constrained")
    for axis in axes.flat[len(found) :]:
        axis.set_axis_off()
    for axis, name in zip(axes.flat, found):
        varied, shown, unit, _ = scaling.SWEEPS[name]
        lines = scaling.series(groups[name])
        for (label, (at, seconds)), colour in zip(lines.items(), COLOURS):
            axis.loglog(at, [unit * each for each in seconds], "o-", ms=3, color=colour, label=label)
        at = next(iter(lines.values()))[0]
        axis.set_xticks(at, [str(each) for each in at])
        axis.minorticks_off()
        ticks = matplotlib.ticker
        axis.yaxis.set_major_locator(ticks.LogLocator(subs=(1, 2, 5)))
        axis.yaxis.set_major_formatter(ticks.FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set(xlabel=varied, ylabel=shown)
        axis.legend(frameon=False, fontsize=8)
    _save(figure, path)
