"""Pictures of a report (`result.report`): predicted against measured, residuals by condition, coefficients."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.lines import Line2D

from hydro_tools.tank import conditions
from hydro_tools.tank.figures import COLOURS, save

from .coefficients import OFFSETS
from .result import MODELS

#: One colour a speed, slow to fast.
SPEED_COLOURS = ("#9ecae1", "#4292c6", "#08519c", "#08203f")


def draw(report: dict, out: Path) -> None:
    """All pictures into the folder `out`."""
    before_after(report, out / "before_after.svg")
    residuals(report, out / "residuals.svg")
    coefficients(report, out / "coefficients.svg")


def before_after(report: dict, path: Path) -> None:
    """Force of every tow, predicted against measured, a panel a model; held-out tows ringed."""
    found = report["predictions"]
    measured, held = np.array(found["measured"]), np.array(found["held_out"])
    figure, axes = plt.subplots(1, len(MODELS), figsize=(9, 3.5), layout="constrained")
    for axis, (model, title) in zip(axes, MODELS.items()):
        predicted = np.array(found[model])
        low, high = min(measured.min(), predicted.min()) * 1.05, 2.0
        axis.plot((low, high), (low, high), color="black", lw=0.6)
        for k, (name, colour) in enumerate(COLOURS.items()):
            axis.plot(measured[:, k], predicted[:, k], ".", ms=4, color=colour, label=f"force {name}")
            axis.plot(measured[held, k], predicted[held, k], "o", ms=6, mfc="none", mec=colour, mew=0.7)
        rmse = report["errors"][model]["held_out"]["rmse"]["pooled"]["value"]
        axis.set(
            title=f"{title}\nheld-out RMSE {rmse:.3g} N",
            xlabel="measured [N]",
            xlim=(measured.min() * 1.05, high),
            ylim=(low, high),
        )
    axes[0].set_ylabel("predicted [N]")
    axes[0].legend(
        handles=[
            *(Line2D([], [], marker=".", ls="", color=c, label=f"force {n}") for n, c in COLOURS.items()),
            Line2D([], [], marker="o", ls="", mfc="none", mec="black", mew=0.7, label="held out"),
        ],
        frameon=False,
        loc="lower right",
    )
    save(figure, path)


def residuals(report: dict, path: Path) -> None:
    """Measured less identified of every tow, by direction, axis, leg configuration and speed."""
    found = report["predictions"]
    gap = np.array(found["measured"]) - np.array(found["identified"])
    error = np.array(found["error"])
    towed = [conditions.Condition(i) for i in found["condition"]]
    figure, axes = plt.subplots(
        2, len(conditions.DIRECTIONS), figsize=(9, 5), sharex=True, sharey="row", layout="constrained"
    )
    for column, direction in enumerate(conditions.DIRECTIONS):
        for row in range(len(COLOURS)):
            axis = axes[row, column]
            for k, (speed, colour) in enumerate(zip(conditions.SPEEDS, SPEED_COLOURS)):
                chosen = [i for i, c in enumerate(towed) if c.stance.direction == direction and c.speed == speed]
                axis.errorbar(
                    [towed[i].configuration + 0.18 * (k - 1.5) for i in chosen],
                    gap[chosen, row],
                    2 * error[chosen, row],
                    color=colour,
                    ls="",
                    marker=".",
                    ms=4,
                    elinewidth=0.6,
                    label=f"{speed} m/s",
                )
            axis.axhline(0.0, color="black", lw=0.6)
            if row == 0:
                axis.set_title(f"towed along {direction}")
            else:
                axis.set_xlabel("leg configuration")
            axis.set_xticks(range(0, conditions.CONFIGURATIONS, 3))
    for row, name in enumerate(COLOURS):
        axes[row, 0].set_ylabel(f"force {name}: measured − identified [N]")
    # Across the tow there is room.
    axes[0, 1].legend(frameon=False, ncols=2, loc="lower center", columnspacing=0.8, handletextpad=0.2)
    save(figure, path)


def coefficients(report: dict, path: Path) -> None:
    """Every acting coefficient with its default, its prior, both intervals, and where other priors take it."""
    rows = [row for row in report["coefficients"] if row["name"] not in OFFSETS]
    figure, axis = plt.subplots(figsize=(9, 5), layout="constrained")
    at = -np.arange(len(rows), dtype=float)
    for y, row in zip(at, rows):
        centre, sd, colour = row["prior"]["centre"], row["prior"]["sd"], COLOURS["x"]
        axis.plot(
            (max(centre - 1.96 * sd, 0), centre + 1.96 * sd),
            (y, y),
            color="0.85",
            lw=9,
            solid_capstyle="butt",
            zorder=1,
        )
        axis.plot(row["ci95"], (y + 0.13,) * 2, color=colour, lw=1.6, zorder=2)
        axis.plot(row["ci95_blocks"], (y - 0.13,) * 2, color=COLOURS["y"], lw=1.6, zorder=2)
        axis.plot(row["value"], y, "o", ms=6, mec=colour, mfc=colour if row["identified"] else "white", zorder=3)
        axis.plot(row["other_priors"], (y, y), "|", ms=7, color="0.35", zorder=2)
        axis.plot(row["default"], y, "x", ms=6, color="black", zorder=3)
    axis.set_yticks(at, [row["name"] for row in rows])
    axis.set(xlabel="coefficient", xlim=(-0.01, None))
    axis.grid(axis="y", visible=False)
    blue = COLOURS["x"]
    figure.legend(
        handles=[
            Line2D([], [], marker="o", ls="", color=blue, label="identified"),
            Line2D([], [], marker="o", ls="", mec=blue, mfc="white", label="not identified"),
            Line2D([], [], color=blue, lw=1.6, label="95 %, mujoco.sysid"),
            Line2D([], [], color=COLOURS["y"], lw=1.6, label="95 %, bootstrap over configurations"),
            Line2D([], [], color="0.85", lw=9, label="95 %, prior"),
            Line2D([], [], marker="|", ls="", color="0.35", label="extremes under other priors"),
            Line2D([], [], marker="x", ls="", color="black", label="default by judgement"),
        ],
        frameon=False,
        loc="outside lower center",
        ncols=4,
    )
    save(figure, path)
