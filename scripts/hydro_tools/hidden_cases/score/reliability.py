"""Are stated probabilities frequencies? Reliability of the effects that a verdict lists, and the level of its alarm.

A pair (probability, true) for every effect in a verdict's `effects`, whatever its target, of cases whose truth is in
the catalogue; those of one band of probability together. A delay and a lag of the actuators that a verdict leaves
undecided are one mechanism. Reliability diagrams: A. H. Murphy and R. L. Winkler, Applied Statistics 26, 1977.
"""

import math

from . import intervals
from .read import Scored

#: Bands of probability; the last holds its upper end.
EDGES = (0.05, 0.2, 0.5, 0.8, 0.95, 1.0)
#: Kinds of cases whose truth the catalogue holds.
KNOWN = ("single", "null", "pair", "several")
#: Members of one mechanism.
TIMING = {"actuator_delay", "actuator_lag"}


def reliability(cases: list[Scored]) -> list[dict]:
    """By band of probability: effects in it, the mean that was stated, and the share that is true with its interval."""
    stated = [pair for case in cases if case.names and case.kind in KNOWN for pair in _stated(case)]
    bands = []
    for low, high in zip(EDGES, EDGES[1:], strict=False):
        inside = [(p, true) for p, true in stated if low <= p < high or (high == EDGES[-1] and p == high)]
        hits = sum(true for _, true in inside)
        bands.append(
            {
                "from": low,
                "to": high,
                "n": len(inside),
                "stated": sum(p for p, _ in inside) / len(inside) if inside else math.nan,
                "true": hits / len(inside) if inside else math.nan,
                "interval": list(intervals.share(hits, len(inside))) if inside else [math.nan, math.nan],
            }
        )
    return bands


def _stated(case: Scored) -> list[tuple[float, bool]]:
    """Probability of every effect or mechanism, and whether it is true."""
    undecided = set(case.verdict.get("confusion_set") or [])
    mechanisms = {effect: (TIMING if effect in TIMING <= undecided else {effect}) for effect in _effects(case)}
    likeliest: dict[frozenset, float] = {}
    for effect in case.verdict["effects"]:
        mechanism = frozenset(mechanisms[effect["effect"]])
        likeliest[mechanism] = max(likeliest.get(mechanism, 0.0), effect["probability"])
    return [(p, bool(mechanism & set(case.truth))) for mechanism, p in likeliest.items()]


def _effects(case: Scored) -> set[str]:
    return {effect["effect"] for effect in case.verdict["effects"]}


def alarm(cases: list[Scored]) -> dict:
    """Cases in which nothing is missing: how many reach the level of the alarm, and the level that was asked for."""
    known = [
        case.verdict["calibration"]
        for case in cases
        if case.names and case.kind == "null" and "alarm" in case.verdict.get("calibration", {})
    ]
    level = known[0]["alarm_level"] if known else math.nan
    hits = sum(of["alarm"] <= of["alarm_level"] for of in known)
    low, high = intervals.share(hits, len(known)) if known else (math.nan, math.nan)
    return {"asked": level, "hits": hits, "n": len(known), "low": low, "high": high}
