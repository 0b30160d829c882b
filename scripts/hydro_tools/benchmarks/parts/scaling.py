"""Cost against the sizes that a user chooses: window, width, batch, simulations, robots, trajectories."""

import os
import shutil
import subprocess
import sys
import time

import numpy as np

from ...repository import ROOT
from .. import WORK, BenchmarkError, commands, data, weights
from ..alternation import Entry, run
from ..markdown import digits, named, table
from ..spread import spread
from ..target import Target
from . import evaluate

TITLE = "Scaling"
HYDRO = ROOT / "target/release/hydro"
BARE, FLUID, PLUGIN = "bare", "MuJoCo's ellipsoid fluid", "hydro, released checkpoint"
EPOCH = "hydro train, one epoch"


def _window(settings) -> list[tuple[int, list[dict]]]:
    found, x = [], data.recorded()
    for window in settings.pick((1, 2, 4, 8, 16, 32, 64, 128), (1, 128)):
        checkpoint = weights.random_ode(WORK / f"window-{window}", data.PAPER | {"window": window}, seed=0)
        files = {"checkpoint": str(checkpoint), "inputs": str(x)}
        entries = [
            *evaluate.ours(checkpoint, x, 200),
            evaluate.baseline(evaluate.ORT, "onnx_runtime", "step", 200, **files),
        ]
        found.append((window, run(entries, settings.pick(15, 2), expected=evaluate.expected(checkpoint, x))))
    return found


def _width(settings) -> list[tuple[int, list[dict]]]:
    found, x = [], data.drawn(12)
    for width in settings.pick((64, 128, 256, 512, 1024), (64, 512)):
        widths = [12, width, width, width, 6]
        checkpoint = weights.bare_field(WORK / f"field-{width}", widths, seed=0)
        files = {"checkpoint": str(checkpoint), "inputs": str(x)}
        entries = [
            *evaluate.ours(checkpoint, x, 200),
            evaluate.baseline(evaluate.ORT, "onnx_runtime", "evaluate", 200, **files),
            evaluate.read(evaluate.LIMIT, evaluate.weight_bytes(widths), 200),
        ]
        found.append((width, run(entries, settings.pick(15, 2), expected=evaluate.expected(checkpoint, x))))
    return found


def _trajectories(settings) -> list[tuple[int, list[dict]]]:
    """Seconds a trajectory of 400 steps, forward: the plugin's engine on one thread, the network that is trained on two."""
    found, training_case, x = [], data.training_case("euler"), data.recorded(data.SAMPLES)
    checkpoint = weights.random_ode(WORK / "b1-512", data.PAPER, seed=0)
    for batch in settings.pick((1, 2, 4, 8, 16, 32, 64, 128), (1, 32)):
        entries = [
            Entry(
                "hydro, network, 2 threads",
                [*commands.rust()],
                {"kind": "trajectories", "training_case": training_case, "batch": batch},
                1,
                threads=2,
                tolerance=1e-3,
            ),
            Entry(
                "hydro, engine, 1 thread",
                [*commands.rust()],
                {
                    "kind": "whole-trajectories",
                    "checkpoint": str(checkpoint),
                    "inputs": str(x),
                    "engine": "fused",
                    "batch": batch,
                },
                1,
                tolerance=None,
            ),
            Entry(
                "PyTorch, 2 threads",
                commands.python("pytorch"),
                {"kind": "trajectories", "training_case": training_case, "batch": batch, "threads": 2},
                1,
                threads=2,
                tolerance=1e-3,
            ),
        ]
        outcomes = run(entries, settings.pick(7, 1))
        for outcome in outcomes:
            outcome["seconds"] = [each / batch for each in outcome["seconds"]]
        found.append((batch, outcomes))
    return found


def _waters() -> list[tuple[str, dict]]:
    return [
        (BARE, {"water": "bare"}),
        (FLUID, {"water": "ellipsoid"}),
        (PLUGIN, {"water": "plugin", "checkpoint": str(ROOT / "models/b1-task2")}),
    ]


def _simulations(settings) -> list[tuple[int, list[dict]]]:
    """Seconds a step of one simulation, `mujoco.batch` on two threads."""
    found = []
    for count in (1, 2, 8, 64):
        entries = [
            Entry(
                name,
                commands.python("batched"),
                {"kind": "batched", "threads": 2, "simulations": count, **scene},
                settings.pick(400, 100),
                threads=2,
                tolerance=None,
            )
            for name, scene in _waters()
        ]
        outcomes = run(entries, settings.pick(15, 2))
        for outcome in outcomes:
            outcome["seconds"] = [each / count for each in outcome["seconds"]]
        found.append((count, outcomes))
    return found


def _robots(settings) -> list[tuple[int, list[dict]]]:
    """Seconds a step of a scene with several robots, an instance of the plugin each."""
    found = []
    for robots in settings.pick(tuple(range(1, 9)), (1, 4)):
        entries = [
            Entry(
                name,
                commands.python("stepping"),
                {"kind": "stepping", "single": False, "robots": robots, **scene},
                settings.pick(400, 200),
                tolerance=None,
            )
            for name, scene in _waters()
        ]
        found.append((robots, run(entries, settings.pick(15, 2))))
    return found


def _epoch(folder, count: int) -> dict:
    """One epoch of `hydro train` on `count` trajectories in a process of its own: wall time and peak memory."""
    run = WORK / "epoch"
    shutil.rmtree(run, ignore_errors=True)
    run.mkdir(parents=True)
    command = [
        str(HYDRO),
        "train",
        "--data",
        str(folder),
        "--out",
        str(run / "model"),
        "--epochs",
        "1",
        "--trajectories",
        str(count),
        "--json",
    ]
    begin = time.perf_counter()
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    said = process.stderr.read()
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.perf_counter() - begin
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise BenchmarkError(f"{' '.join(command)}: {said.decode()}")
    return {"name": EPOCH, "seconds": [seconds], "peak_bytes": usage.ru_maxrss * 1024}


def _data_set(settings) -> list[tuple[int, list[dict]]]:
    trials = settings.pick((1000, 401), (data.TRIALS, data.SAMPLES))
    folder, found = data.task2(*trials), []
    for count in settings.pick((50, 100, 200, 400, 800), (32, 64)):
        outcome = _epoch(folder, count)
        print(
            f"  {count} trajectories {outcome['seconds'][0]:.1f} s, {outcome['peak_bytes'] / 2**20:.0f} MiB",
            file=sys.stderr,
        )
        found.append((count, [outcome]))
    return found


#: Name -> what is varied, what is shown, its unit, the measurement.
SWEEPS = {
    "window": ("samples in the window", "us a sample", 1e6, _window),
    "width": ("hidden width", "us an evaluation", 1e6, _width),
    "trajectories": ("trajectories in a batch", "ms a trajectory, forward", 1e3, _trajectories),
    "simulations": ("simulations in mujoco.batch", "us a step and simulation", 1e6, _simulations),
    "robots": ("robots in one scene", "us a step of the scene", 1e6, _robots),
    "data set": ("trajectories in the training split", "s an epoch", 1.0, _data_set),
}


def measure(settings) -> dict:
    """Time every implementation; outcomes by group."""
    groups = {}
    for name, (varied, *_, sweep) in SWEEPS.items():
        print(f"scaling: {varied}")
        # Only what the tables and plots show.
        groups[name] = [
            [at, [{key: outcome[key] for key in ("name", "seconds", "peak_bytes")} for outcome in outcomes]]
            for at, outcomes in sweep(settings)
        ]
    return groups


def series(points: list) -> dict[str, tuple[list, list]]:
    """Implementation -> (varied sizes, median seconds)."""
    return {
        name: ([at for at, _ in points], [float(np.median(named(outcomes, name)["seconds"])) for _, outcomes in points])
        for name in (outcome["name"] for outcome in points[0][1])
    }


def _line(points: list) -> tuple[float, float, float]:
    """Seconds a trajectory and at the start, least squares; largest residual relative to the time."""
    at, seconds = series(points)[EPOCH]
    slope, start = np.polyfit(at, seconds, 1)
    away = np.abs(np.polyval((slope, start), at) - seconds) / seconds
    return float(slope), float(start), float(away.max())


def render(groups: dict) -> str:
    """The section of the page, in Markdown."""
    lines = [
        "Medians. Window: a sample of the Attention-ODE with the paper's field, one thread. Width: three hidden layers of it, one "
        "thread. Batch: 400 steps by Euler, the plugin's engine or the network that is trained. `mujoco.batch` runs on two threads; robots "
        "in a scene have an instance of the plugin each. An epoch is one of `hydro train`, start and validation included.\n",
        "![cost against size](scaling.svg)\n",
    ]
    for name, (varied, shown, unit, _) in SWEEPS.items():
        if name not in groups:
            continue
        points = groups[name]
        names = [outcome["name"] for outcome in points[0][1]]
        rows = [
            [str(at), *(digits(unit * spread(named(outcomes, each)["seconds"]).median) for each in names)]
            for at, outcomes in points
        ]
        head = [varied, *(f"{each}, {shown}" if len(names) == 1 else each for each in names)]
        if name == "data set":
            head.append("peak MiB")
            rows = [row + [f"{outcomes[0]['peak_bytes'] / 2**20:.0f}"] for row, (_, outcomes) in zip(rows, points)]
        lines += ["" if len(names) == 1 else f"{shown[0].upper()}{shown[1:]}:\n", table(head, rows)]
    if "data set" in groups:
        slope, start, away = _line(groups["data set"])
        lines.append(
            f"A straight line through the epochs: {1e3 * slope:.3g} ms a trajectory and {start:.2g} s besides; no epoch is further "
            f"than {100 * away:.0f} % from it.\n"
        )
    return "\n".join(lines)


def targets(_: dict) -> list[Target]:
    """The figures that have a target."""
    return []
