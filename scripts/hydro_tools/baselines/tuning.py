"""Scores of each setting of each method, on cases made for tuning alone (another seed).

The sparse methods are ranked by names: exact sets where something is hidden, silence where nothing is. The others,
which name nothing, by the error they leave on trials that they were not fitted on.
"""

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np

from hydro_mujoco.reading import read_json

from . import BaselineError, case, motion, sparse
from .settings import METHODS, SPARSE

GRIDS = {
    "stlsq": {
        "threshold": [0.05, 0.1, 0.15, 0.2, 0.3, 0.45, 0.6],
        "alpha": [1e-4, 1e-2, 1e-1, 1.0],
        "least_share": [0.3, 0.5, 0.8, 0.95],
    },
    "ensemble": {
        "threshold": [0.1, 0.2, 0.3, 0.45],
        "alpha": [1e-2, 1e-1],
        "inclusion": [0.6, 0.9],
        "least_share": [0.3, 0.5, 0.8],
    },
    "bindy": {"prior": [0.3, 1.0, 3.0], "correlation": [1.0, 3.0, 10.0, 30.0], "least_share": [0.3, 0.5, 0.8]},
    "sysid": {"segments": [12, 24], "iterations": [6, 15]},
    "network": {"hidden": [(16,), (32, 32)], "alpha": [1e-2, 1e-1, 1.0], "smooth_s": [0.1, 0.2]},
}
TEST_S = (0.5, 1.0, 2.0)
#: Settings of a method that are printed.
SHOWN = 6


def names_of(folder: Path, answers: Path, methods: list[str]) -> list[tuple[str, tuple, bool, bool]]:
    """(method, setting, is a null, right) of every setting of the sparse methods on a case."""
    answer = read_json(answers / folder.name / "answer.json")
    if answer["kind"] == "outside":
        return []
    truth = sorted(effect["effect"] for effect in answer["effects"])
    truths = [truth] + [[other] for other in answer["lookalikes"] if answer["kind"] == "inseparable"]
    try:
        prepared = case.PreparedCase(folder, METHODS["stlsq"].smooth_s)
    except BaselineError:
        return []
    out = []
    for test_s, method in itertools.product(TEST_S, methods):
        try:
            problem = prepared.problem(test_s)
        except BaselineError:
            continue  # Too long for these trials: ranked behind by what it cannot do.
        # `least_share`, the last, only cuts what a fit has found.
        names, cuts = list(GRIDS[method])[:-1], GRIDS[method]["least_share"]
        for values in itertools.product(*(GRIDS[method][name] for name in names)):
            found = getattr(sparse, method)(problem, **dict(zip(names, values)))
            strength = sparse.contributions(problem, found)
            for cut in cuts:
                right = sorted(sparse.named(strength, cut)) in truths
                out.append((method, (test_s, *values, cut), answer["kind"] == "null", right))
    return out


def errors_of(folder: Path, answers: Path, methods: list[str]) -> list[tuple[str, tuple, float]]:
    """(method, setting, error left as a part of the nominal's) on a case's trials kept back."""
    out = []
    kept_back = motion.kept_back(answers, folder.name, ("never_shown",)) if methods else {}
    for method in methods:
        settings = METHODS[method]
        try:
            prepared = case.PreparedCase(folder, settings.smooth_s)
        except BaselineError:
            continue
        for values in itertools.product(*GRIDS[method].values()):
            tried = replace(settings, options=dict(zip(GRIDS[method], values)))
            try:
                gap = case.run(prepared, method, tried, kept_back)["elsewhere"]["never_shown"]
                left = gap["after"] / max(gap["before"], 1e-9)
            except BaselineError:
                left = 1.0
            out.append((method, values, left))
    return out


def one_case(folder: Path, answers: Path, methods: list[str]) -> tuple[list, list]:
    """(names, errors) of the methods on a case."""
    return (
        names_of(folder, answers, [m for m in methods if m in SPARSE]),
        errors_of(folder, answers, [m for m in methods if m not in SPARSE]),
    )


def ranking(methods: list[str], names: list, errors: list) -> list[str]:
    """Lines to print: the best settings of each method."""
    out = []
    for method in methods:
        varied = ", ".join(GRIDS[method])
        if method in SPARSE:
            out.append(f"\n{method}: test_s, {varied}: exact set of cases with an effect, nulls kept silent")
            out += _by_name([row[1:] for row in names if row[0] == method])
        else:
            out.append(f"\n{method}: {varied}: error left, geometric mean and median over cases")
            out += _by_error([row[1:] for row in errors if row[0] == method])
    return out


def _by_name(rows: list[tuple[tuple, bool, bool]]) -> list[str]:
    table: dict[tuple, list[list[bool]]] = {}
    for values, null, right in rows:
        table.setdefault(values, [[], []])[int(null)].append(right)
    # A false alarm costs as much as a missed name, each as a share of its kind; a case that cannot be done is missed.
    most = [max(len(of[kind]) for of in table.values()) for kind in (0, 1)]
    ranked = sorted(table.items(), key=lambda item: -sum(sum(x) / max(n, 1) for x, n in zip(item[1], most)))
    return [
        f"  {_text(values)}: {sum(cases)}/{len(cases)}, {sum(nulls)}/{len(nulls)}"
        for values, (cases, nulls) in ranked[:SHOWN]
    ]


def _by_error(rows: list[tuple[tuple, float]]) -> list[str]:
    table: dict[tuple, list[float]] = {}
    for values, left in rows:
        table.setdefault(values, []).append(max(left, 1e-3))
    ranked = sorted(table.items(), key=lambda item: np.mean(np.log(item[1])))
    return [
        f"  {_text(values)}: {np.exp(np.mean(np.log(left))):.3f}, {np.median(left):.3f} of {len(left)}"
        for values, left in ranked[:SHOWN]
    ]


def _text(values: tuple) -> str:
    return ", ".join(f"{value:g}" if isinstance(value, (int, float)) else "-".join(map(str, value)) for value in values)
