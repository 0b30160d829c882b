"""The answer of `hydro gap` as records."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..reading import read_json


@dataclass(frozen=True)
class Value:
    """A fitted value: `name`, `value` in `unit`, and its 95 % interval in the same unit."""

    name: str
    value: float
    unit: str
    ci95: tuple[float, float]


@dataclass(frozen=True)
class NamedEffect:
    """An effect that was added to the model: id, target element, posterior probability (0 to 1), fitted values."""

    effect: str
    target: str
    probability: float
    parameters: dict[str, Value]


@dataclass(frozen=True)
class Gap:
    """Error of the predictions on held-out trials: `before`, `after`, `reduction` = 1 - after / before, with its
    interval.

    `metric` is its name (normalised RMSE, `nrmse`). What was not computed is None.
    """

    metric: str
    before: float | None
    after: float | None
    reduction: float | None
    ci95: tuple[float, float] | None
    n_holdout_trials: int


@dataclass(frozen=True)
class Case:
    """What `hydro gap` found.

    Attributes:
        out: folder of all that was written.
        verdict: the whole of verdict.json (`hydro-gap-verdict/1`, docs/gap.md).
        named: the effects that were added; empty unless `verdict["verdict"]` is "named".
        gap: error on held-out trials.
        doubts: what speaks against the answer: numbers of the nominal that moved far, values at the end of what is
            plausible.
        patched: MJCF of the nominal with what was added; None where held-out trials did not confirm anything.
        report: the page.
    """

    out: Path
    verdict: dict[str, Any] = field(repr=False)
    named: list[NamedEffect]
    gap: Gap
    doubts: list[str]
    patched: Path | None
    report: Path


def case(out: Path, verdict: dict[str, Any]) -> Case:
    """A case of the verdict that the program printed for this folder of results."""
    # An effect may be named on one body and be a rival on another: what was written says which is which.
    written = read_json(out / "add.json") or {"effects": []}
    added = {(entry["effect"], entry["target"]) for entry in written["effects"] if entry["effect"] in verdict["named"]}
    named = [_effect(entry) for entry in verdict["effects"] if (entry["effect"], entry["target"]) in added]
    patch = verdict.get("patch")
    return Case(
        out=out,
        verdict=verdict,
        named=named,
        gap=_gap(verdict["gap"]),
        doubts=list(verdict.get("doubts", [])),
        patched=out / patch["model"] if patch else None,
        report=out / "report.html",
    )


def _effect(entry: dict[str, Any]) -> NamedEffect:
    values = [
        Value(each["name"], each["value"], each["unit"], _pair(each["ci95"]) or (float("nan"),) * 2)
        for each in entry["parameters"]
    ]
    return NamedEffect(entry["effect"], entry["target"], entry["probability"], {value.name: value for value in values})


def _gap(entry: dict[str, Any]) -> Gap:
    return Gap(
        metric=entry["metric"],
        before=entry["before"],
        after=entry["after"],
        reduction=entry["reduction"],
        ci95=_pair(entry.get("ci95")),
        n_holdout_trials=entry["n_holdout_trials"],
    )


def _pair(values: list[float] | None) -> tuple[float, float] | None:
    return (values[0], values[1]) if values else None
