"""The score of methods, figure by figure, as numbers and as printed tables."""

import math

from . import figures, intervals, reliability
from .read import Scored


def summary(figure: figures.Figure) -> dict:
    """A figure as numbers: value, interval, how many cases, whether the target is met."""
    if figure.hits is not None:
        hits, total = sum(figure.hits), len(figure.hits)
        low, high = intervals.share(hits, total)
        value = hits / total if total else math.nan
        line = {"kind": "share", "hits": hits}
    else:
        total = len(figure.values)
        value, low, high = intervals.median(figure.values)
        line = {"kind": "median"}
    met = None if not total or not figure.asked else bool(figure.meets(value))
    return line | {
        "name": figure.name,
        "asked": figure.asked,
        "value": value,
        "low": low,
        "high": high,
        "n": total,
        "met": met,
    }


def score(cases: list[Scored]) -> dict:
    """Everything about one method."""
    systems = sorted({case.system for case in cases})
    return {
        "cases": len(cases),
        "verdicts": sum(case.verdict is not None for case in cases),
        "table": [summary(figure) for figure in figures.figures(cases)],
        "by_system": {
            system: [summary(figure) for figure in figures.figures([c for c in cases if c.system == system])]
            for system in systems
        },
        "confusion": figures.confusion(cases),
        "reliability": reliability.reliability(cases),
        "alarm": reliability.alarm(cases),
    }


def cell(line: dict) -> str:
    """`value [low, high] n`, as a share in per cent or a plain number."""
    if not line["n"]:
        return "-"
    if line["kind"] == "share":
        return f"{100 * line['value']:.0f} % [{100 * line['low']:.0f}, {100 * line['high']:.0f}] n={line['n']}"
    return f"{line['value']:.3g} [{line['low']:.3g}, {line['high']:.3g}] n={line['n']}"


def show(results: dict[str, dict]) -> None:
    """Print the tables."""
    names = list(results)
    first = results[names[0]]
    width = max(len(line["name"]) for line in first["table"])
    for name, result in results.items():
        print(f"{name}: {result['verdicts']} verdicts of {result['cases']} cases")
    print(f"\n{'figure':<{width}}  {'target':<8}" + "".join(f"  {name:<28}" for name in names))
    for i, line in enumerate(first["table"]):
        cells = []
        for name in names:
            own = results[name]["table"][i]
            mark = {True: " ok", False: " MISSED", None: ""}[own["met"]]
            cells.append(f"  {cell(own) + mark:<28}")
        print(f"{line['name']:<{width}}  {line['asked']:<8}" + "".join(cells))
    for name, result in results.items():
        print(f"\n{name}, a system")
        systems = list(result["by_system"])
        print(f"{'figure':<{width}}" + "".join(f"  {system:<24}" for system in systems))
        for i, line in enumerate(result["table"]):
            print(f"{line['name']:<{width}}" + "".join(f"  {cell(result['by_system'][s][i]):<24}" for s in systems))
        print(f"\n{name}, probability that was stated -> share that is true")
        for band in result["reliability"]:
            if band["n"]:
                low, high = (100 * edge for edge in band["interval"])
                print(
                    f"  {band['from']:.2f} to {band['to']:.2f}  mean {band['stated']:.2f} -> "
                    f"{100 * band['true']:.0f} % [{low:.0f}, {high:.0f}] n={band['n']}, "
                    f"{100 * (band['true'] - band['stated']):+.0f} points"
                )
        alarm = result["alarm"]
        if alarm["n"]:
            print(
                f"  nothing missing: alarm at level {alarm['asked']:.2f} in {alarm['hits']} of {alarm['n']} "
                f"[{100 * alarm['low']:.0f}, {100 * alarm['high']:.0f}] %"
            )
        print(f"\n{name}, hidden -> said")
        for hidden, row in sorted(result["confusion"].items()):
            said = ", ".join(f"{what} {count}" for what, count in sorted(row.items(), key=lambda pair: -pair[1]))
            print(f"  {hidden:<20} {said}")


def clean(value):
    """JSON has no NaN."""
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, dict):
        return {key: clean(item) for key, item in value.items()}
    if isinstance(value, list):
        return [clean(item) for item in value]
    return value
