"""The figures of the table: each a share with hits and total, or a list of values."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from .read import Scored

#: Bands of whitened strength.
STRONG, WEAK = 10.0, 3.0
#: Parameters whose value without the effect is 1.
UNITY = {"gain", "scale"}


@dataclass
class Figure:
    """One line: `hits` (a share) or `values` (a median), and what is asked for."""

    name: str
    asked: str
    hits: list[bool] | None = None
    values: list[float] | None = None
    meets: Callable[[float], bool] = field(default=lambda _: True)


def _strong(case: Scored) -> bool:
    return case.strength >= STRONG


def figures(cases: list[Scored]) -> list[Figure]:
    """Every line of the table, from the cases that have a verdict."""
    answered = [case.verdict is not None for case in cases if case.strangers]
    cases = [case for case in cases if case.verdict is not None]
    clear = [case for case in cases if case.kind == "single" and case.answer["identifiable"] and _strong(case)]
    reductions = _known(_reduction(case) for case in clear)
    # Trials that no method was shown, by what was done there: error left as a part of the nominal's.
    left = {regime: _known(left_of(case, regime) for case in clear) for regime in ("never_shown", "faster")}
    seconds = _known(case.seconds for case in cases)
    # A method that cannot name has no names to be right or wrong.
    cases = [case for case in cases if case.names]
    every_single = [case for case in cases if case.kind == "single"]
    single = [case for case in every_single if case.answer["identifiable"]]
    # Singles whose data, as they fell out, leave another effect of the catalogue within a distance of 3.
    alike = [case for case in every_single if case.answer["lookalikes"] and case.strength >= WEAK]
    strong = [case for case in clear if case.names]
    weak = [case for case in single if WEAK <= case.strength < STRONG]
    pairs = [case for case in cases if case.kind == "pair"]
    several = [case for case in cases if case.kind == "several"]
    nulls = [case for case in cases if case.kind == "null"]
    outside = [case for case in cases if case.kind == "outside" and _strong(case)]
    twins = [
        case
        for case in cases
        if case.kind == "inseparable" and case.answer["twin"] in case.answer["lookalikes"] and case.strength >= WEAK
    ]
    # By construction or by refit.
    undecidable = twins + alike
    known = [case for case in cases if case.kind in ("single", "null", "pair", "several")]
    others = [case for case in cases if case.strangers]
    others_lack = [case for case in others if case.kind in ("single", "pair", "several") and case.strength >= WEAK]
    errors, covered = [], []
    for case in strong + pairs + several:
        for error, hits in coefficients(case):
            errors.append(error)
            covered += hits
    at_least = lambda bound: lambda value: value >= bound  # noqa: E731
    at_most = lambda bound: lambda value: value <= bound  # noqa: E731
    return [
        Figure(
            "top-1 name, strength >= 10", ">= 95 %", [case.top in case.truth for case in strong], meets=at_least(0.95)
        ),
        Figure(
            "top-1 name, strength 3 to 10", ">= 80 %", [case.top in case.truth for case in weak], meets=at_least(0.8)
        ),
        Figure(
            "exact set, one effect, strength >= 10",
            ">= 90 %",
            [sorted(case.named) == sorted(case.truth) for case in strong],
            meets=at_least(0.9),
        ),
        Figure(
            "exact set, two effects",
            ">= 80 %",
            [sorted(case.named) == sorted(case.truth) for case in pairs],
            meets=at_least(0.8),
        ),
        Figure(
            "two effects: both put forward, one rival at most",
            "",
            [set(case.truth) <= case.called and len(case.called) <= len(case.truth) + 1 for case in pairs],
        ),
        Figure(
            "two effects: the stronger named",
            "100 %",
            [_strongest(case) in case.named for case in pairs],
            meets=at_least(1.0),
        ),
        Figure(
            "exact set, three and more effects",
            ">= 60 %",
            [sorted(case.named) == sorted(case.truth) for case in several],
            meets=at_least(0.6),
        ),
        Figure(
            "three and more effects: the strongest named",
            "100 %",
            [_strongest(case) in case.named for case in several],
            meets=at_least(1.0),
        ),
        Figure(
            "three and more effects: share of them named",
            "",
            [effect in case.named for case in several for effect in case.truth],
        ),
        Figure(
            "false alarm, nothing missing",
            "<= 5 %",
            [case.said in ("named", "confusable") for case in nulls],
            meets=at_most(0.05),
        ),
        Figure(
            "outside: unknown, or marked surrogate",
            ">= 80 %",
            [case.said == "unknown" or case.surrogate for case in outside],
            meets=at_least(0.8),
        ),
        Figure("false unknown", "<= 3 %", [case.said == "unknown" for case in known], meets=at_most(0.03)),
        Figure(
            "undecidable: the set holds the truth",
            ">= 95 %",
            [set(case.truth) <= case.called for case in undecidable],
            meets=at_least(0.95),
        ),
        Figure(
            "undecidable: size of the set",
            "<= 2",
            values=[float(len(case.called)) for case in undecidable if case.called],
            meets=at_most(2.0),
        ),
        Figure(
            "undecidable by construction: set holds the truth", "", [set(case.truth) <= case.called for case in twins]
        ),
        Figure("undecidable by refit: set holds the truth", "", [set(case.truth) <= case.called for case in alike]),
        Figure("others' robots: a verdict", "100 %", answered, meets=at_least(1.0)),
        Figure(
            "others' robots: the strongest effect named",
            ">= 80 %",
            [_strongest(case) in case.named for case in others_lack],
            meets=at_least(0.8),
        ),
        Figure(
            "others' robots: the strongest effect put forward",
            "",
            [_strongest(case) in case.called for case in others_lack],
        ),
        Figure(
            "others' robots: no false name",
            "100 %",
            [set(case.named) <= set(case.truth) for case in others],
            meets=at_least(1.0),
        ),
        Figure("95 % intervals cover", "92-98 %", covered, meets=lambda value: 0.92 <= value <= 0.98),
        Figure("coefficient error, strength >= 10", "<= 10 %", values=errors, meets=at_most(0.10)),
        Figure("held-out reduction, strength >= 10", ">= 0.8", values=reductions, meets=at_least(0.8)),
        Figure(
            "target too, where the name is right",
            "",
            [_target_right(case) for case in strong if case.top in case.truth],
        ),
        Figure("error left, trials never shown", "", values=left["never_shown"]),
        Figure("error left, driven half as fast again", "", values=left["faster"]),
        Figure("seconds a case", "", values=seconds),
    ]


def _known(values: Iterable[float | None]) -> list[float]:
    return [value for value in values if value is not None]


def _reduction(case: Scored) -> float | None:
    return (case.verdict.get("gap") or {}).get("reduction")


def left_of(case: Scored, regime: str) -> float | None:
    """Error on trials kept back, as a part of the nominal's."""
    gap = (case.verdict.get("elsewhere") or {}).get(regime)
    return gap["after"] / gap["before"] if gap and gap["before"] else None


def _strongest(case: Scored) -> str:
    """The hidden effect of the greatest strength; strengths aimed at where the answer has no others."""
    asked = case.answer["strength"].get("asked") or [0.0] * len(case.truth)
    sizes = [effect.get("strength", {}).get("projected", size) for effect, size in zip(case.answer["effects"], asked)]
    return case.truth[sizes.index(max(sizes))]


def _target_right(case: Scored) -> bool:
    truth = {effect["effect"]: effect["target"] for effect in case.answer["effects"]}
    said = max(case.verdict["effects"], key=lambda effect: effect["probability"])
    return truth[said["effect"]] in (said["target"], "all")


def coefficients(case: Scored) -> list[tuple[float, list[bool]]]:
    """For each effect that was rightly named: relative error of its coefficients, and what its intervals cover.

    Only where the truth's definition is the catalogue's (`comparable`). Coefficients of one unit are taken
    together, as a vector: a component near zero has no relative error of its own.
    """
    out = []
    for truth in case.answer["effects"]:
        if not truth["comparable"] or truth["effect"] not in case.named:
            continue
        fitted = [effect for effect in case.verdict["effects"] if effect["effect"] == truth["effect"]]
        # An effect on `all` of a kind may come back once an actuator: values that they share are one value.
        told = []
        for said in fitted:
            if truth["target"] not in (said["target"], "all") or said["parameters"] in told:
                continue
            told.append(said["parameters"])
            values = {p["name"]: p for p in said["parameters"]}
            shared = [p for p in truth["parameters"] if p["name"] in values]
            hits = []
            for unit in sorted({p["unit"] for p in shared}):
                group = [p for p in shared if p["unit"] == unit]
                null = [1.0 if p["name"] in UNITY else 0.0 for p in group]
                size = sum((p["value"] - n) ** 2 for p, n in zip(group, null)) ** 0.5
                if size == 0.0:
                    continue
                miss = sum((values[p["name"]]["value"] - p["value"]) ** 2 for p in group) ** 0.5
                for p in group:
                    low, high = values[p["name"]].get("ci95") or (None, None)
                    if low is not None:
                        hits.append(low <= p["value"] <= high)
                out.append((miss / size, hits))
                hits = []
    return out


def confusion(cases: list[Scored]) -> dict[str, dict[str, int]]:
    """Hidden effect (singles) -> what was said -> how often."""
    table: dict[str, dict[str, int]] = {}
    for case in cases:
        if not case.names or case.kind not in ("single", "null"):
            continue
        row = table.setdefault(case.truth[0] if case.truth else "(nothing)", {})
        if case.said == "named":
            said = "+".join(sorted(case.verdict["named"])) or "(nothing)"
        elif case.said == "confusable":
            said = "{" + ",".join(sorted(case.called)) + "}"
        else:
            said = case.said
        row[said] = row.get(said, 0) + 1
    return table
