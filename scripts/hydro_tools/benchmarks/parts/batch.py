"""64 simulations in `mujoco.batch` on one thread and on two, with the plugin and without."""

from itertools import product

import numpy as np

from ...repository import ROOT
from .. import commands
from ..alternation import Entry, run
from ..markdown import between, named, table
from ..spread import spread
from ..target import Target

TITLE = "Many simulations at once"
SIMULATIONS = 64
WATERS = {"bare": "bare", "ellipsoid": "MuJoCo's ellipsoid fluid", "plugin": "hydro, released checkpoint"}


def _name(water: str, threads: int) -> str:
    return f"{WATERS[water]}, {threads} thread{'s' if threads > 1 else ''}"


def measure(settings) -> dict:
    """Time every implementation; outcomes by group."""
    print(f"{SIMULATIONS} simulations")
    checkpoint = str(ROOT / "models/b1-task2")
    entries = []
    for water, threads in product(WATERS, (1, 2)):
        scene = {
            "simulations": SIMULATIONS,
            "water": water,
            **({"checkpoint": checkpoint} if water == "plugin" else {}),
        }
        entries.append(
            Entry(
                _name(water, threads),
                commands.python("batched"),
                {"kind": "batched", "threads": threads, **scene},
                settings.pick(100, 50),
                threads=threads,
                tolerance=None,
            )
        )
        if threads == 1:
            # Takes part in no round: it is there for its states.
            entries.append(
                Entry(
                    f"{WATERS[water]}, mj_step",
                    commands.python("batched"),
                    {"kind": "loop", **scene},
                    1,
                    rounds=0,
                    tolerance=None,
                )
            )
    return {"batch": run(entries, settings.pick(40, 4))}


def speed_up(outcomes: list[dict], water: str) -> np.ndarray:
    """Speed-up of two threads over one, round by round."""
    one, two = (np.array(named(outcomes, _name(water, threads))["seconds"]) for threads in (1, 2))
    return one / two


def identical(outcomes: list[dict], water: str) -> bool:
    """True where one thread, two threads and a loop of `mj_step` end in the same bits."""
    names = (_name(water, 1), _name(water, 2), f"{WATERS[water]}, mj_step")
    return len({tuple(named(outcomes, name)["check"]) for name in names}) == 1


def render(groups: dict) -> str:
    """The section of the page, in Markdown."""
    outcomes, rows = groups["batch"], []
    for water, title in WATERS.items():
        each = [
            spread(named(outcomes, _name(water, threads))["seconds"]).scaled(1e6 / SIMULATIONS) for threads in (1, 2)
        ]
        gain = speed_up(outcomes, water)
        against = "" if water == "plugin" else between(spread(speed_up(outcomes, "plugin") / gain))
        rows.append(
            [
                title,
                *map(between, each),
                between(spread(gain)),
                against,
                "yes" if identical(outcomes, water) else "**no**",
            ]
        )
    return (
        f"{SIMULATIONS} simulations of the B1 scene, Euler, 2 ms. The same bits: positions and velocities after 100 steps on one thread, "
        "on two, and by `mj_step` one simulation after the other.\n\n"
        + table(["", "us a step, 1 thread", "2 threads", "speed-up", "the plugin's, of this", "same bits"], rows)
    )


def targets(groups: dict) -> list[Target]:
    """The figures that have a target."""
    outcomes = groups["batch"]
    plugin = speed_up(outcomes, "plugin")
    return [
        Target(
            f"speed-up of 2 threads, plugin against {WATERS[water]}",
            float(np.median(plugin / speed_up(outcomes, water))),
            0.95,
            least=True,
        )
        for water in ("bare", "ellipsoid")
    ] + [
        Target(
            "implementations whose simulations end in other bits than mj_step's",
            float(sum(not identical(outcomes, water) for water in WATERS)),
            0,
            timed=False,
        )
    ]
