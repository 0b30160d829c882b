"""`mj_step` of B1: bare, in MuJoCo's own ellipsoid fluid, in the plugin's water, under three integrators."""

from ...repository import ROOT
from .. import WORK, commands, data, weights
from ..alternation import Entry, run
from ..engines import CANDLE, ENGINES
from ..markdown import digits, named, timings
from ..spread import ratio, spread
from ..target import Target

TITLE = "A step of the simulation"
BARE, FLUID = "bare", "MuJoCo's ellipsoid fluid"
#: Integrator -> how it is called, and what the plugin may cost in ellipsoid fluids.
INTEGRATORS = {"euler": ("Euler", 1.3), "implicitfast": ("implicitfast", 0.5), "rk4": ("RK4", None)}
RELEASED, PAPER = "256-256-256", "512-512-512"


def _label(engine: str, field: str) -> str:
    return f"{engine}, {field}"


def measure(settings) -> dict:
    """Time every implementation; outcomes by group."""
    paper = weights.random_ode(WORK / "b1-512", data.PAPER, seed=0)
    checkpoints = {RELEASED: ROOT / "models/b1-task2", PAPER: paper}
    groups = {}
    for integrator in INTEGRATORS:
        print(f"scene, {integrator}")

        def entry(name, *, integrator=integrator, **scene):
            task = {"kind": "stepping", "integrator": integrator, **scene}
            return Entry(name, commands.python("stepping"), task, settings.pick(1000, 400), tolerance=None)

        entries = [entry(BARE, water="bare", single=False), entry(FLUID, water="ellipsoid", single=False)]
        for field, checkpoint in checkpoints.items():
            entries += [
                entry(_label(name, field), water="plugin", checkpoint=str(checkpoint), engine=engine)
                for engine, (name, _) in ENGINES.items()
            ]
        engine, name, _ = CANDLE
        entries.append(
            entry(_label(name, RELEASED), water="plugin", checkpoint=str(checkpoints[RELEASED]), engine=engine)
        )
        groups[integrator] = run(entries, settings.pick(40, 3))
        for outcome in groups[integrator]:
            del outcome["check"]
    return groups


def _evaluation(outcome: dict) -> str:
    found = outcome["notes"].get("evaluation_us")
    return digits(spread(found).median) if found else ""


def _first(outcome: dict) -> str:
    found = outcome["notes"].get("first_us")
    return digits(spread(found).median) if found else ""


def render(groups: dict) -> str:
    """The section of the page, in Markdown."""
    lines = [
        "B1, physics every 2 ms, the model every 10 ms; no contact, no gravity. Runs of 200 steps from random velocities. Not "
        "in the time of a step is the first one after a reset, where the plugin looks for a force to begin with (up to 200 "
        "evaluations): it has a column of its own. The last column is what the step that evaluates the network costs "
        "beyond the other four. 256-256-256: the "
        "released checkpoint. 512-512-512: the paper's sizes (h in R^6, raw features, window 8), random weights.\n"
    ]
    for integrator, outcomes in groups.items():
        lines += [
            f"{INTEGRATORS[integrator][0]}:\n",
            timings(
                outcomes,
                "us",
                {BARE: "of bare", FLUID: "of the ellipsoid fluid"},
                {"us the first step": _first, "us an evaluation": _evaluation},
            ),
        ]
    return "\n".join(lines)


def targets(groups: dict) -> list[Target]:
    """The figures that have a target."""
    found = []
    for integrator, (title, limit) in INTEGRATORS.items():
        outcomes = groups.get(integrator, [])
        for name, _ in ENGINES.values():
            for field in (RELEASED, PAPER):
                outcome = named(outcomes, _label(name, field))
                if limit and outcome:
                    value = ratio(outcome["seconds"], named(outcomes, FLUID)["seconds"]).median
                    found.append(
                        Target(f"a step under {title}, {_label(name, field)}, of the ellipsoid fluid", value, limit)
                    )
    return found
