#!/usr/bin/env python3
"""Scores verdicts on the hidden-effect cases: the table of what counts as good, with its intervals.

    python scripts/score_hidden.py --cases out/hidden/cases --sealed out/hidden/sealed --verdicts out/verdicts
    python scripts/score_hidden.py ... --method gap=out/verdicts --method stlsq=out/rivals/stlsq [--json]
    python scripts/score_hidden.py ... --save out/record.jsonl         what was hidden and said, in one file
    python scripts/score_hidden.py --record out/record.jsonl           the table of such a file

Reads DIR/<case id>/verdict.json (and timing.json, {"seconds": x}, where there is one). Shares carry exact
binomial 95 % intervals, medians bootstrap ones. Strength is whitened, the nominal's uncertainties projected out.
"""

import argparse
import json
import math
import sys
from pathlib import Path

from hydro_tools.hidden_cases.score import figures as table
from hydro_tools.hidden_cases.score import intervals, record
from hydro_tools.hidden_cases.score.read import Scored, ScoreError, load


def summary(figure: table.Figure) -> dict:
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
    return line | {"name": figure.name, "asked": figure.asked, "value": value, "low": low, "high": high, "n": total,
                   "met": met}


def score(cases: list[Scored]) -> dict:
    """Everything about one method."""
    systems = sorted({case.system for case in cases})
    return {
        "cases": len(cases), "verdicts": sum(case.verdict is not None for case in cases),
        "table": [summary(figure) for figure in table.figures(cases)],
        "by_system": {system: [summary(figure) for figure in table.figures([c for c in cases if c.system == system])]
                      for system in systems},
        "confusion": table.confusion(cases),
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


def main() -> int:
    """Parse, load, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=Path, help="OUT/cases of gen_hidden.py")
    parser.add_argument("--sealed", type=Path, help="OUT/sealed of gen_hidden.py")
    parser.add_argument("--verdicts", type=Path, help="folder with <case id>/verdict.json")
    parser.add_argument("--method", action="append", default=[], metavar="NAME=DIR", help="a method and its verdicts; several")
    parser.add_argument("--record", type=Path, action="append", default=[], metavar="FILE",
                        help="what --save wrote, instead of folders; several, of different cases")
    parser.add_argument("--save", type=Path, metavar="FILE", help="writes what was hidden and said to a file")
    parser.add_argument("--json", action="store_true", help="one machine-readable result")
    args = parser.parse_args()
    if args.record and (args.cases or args.sealed or args.verdicts or args.method):
        parser.error("--record stands instead of --cases, --sealed, --verdicts and --method")
    try:
        said = record.load(args.record) if args.record else from_folders(parser, args)
        if args.save:
            record.save(args.save, said)
    except ScoreError as error:
        print(f"score_hidden: {error}", file=sys.stderr)
        return 1
    results = {name: score(cases) for name, cases in said.items()}
    if args.json:
        print(json.dumps(clean(results), indent=1))
    else:
        show(results)
    return 0


def from_folders(parser: argparse.ArgumentParser, args: argparse.Namespace) -> dict[str, list[Scored]]:
    """Every case by method."""
    if not (args.cases and args.sealed):
        parser.error("give --cases and --sealed, or --record FILE")
    methods = {"hydro gap": args.verdicts} if args.verdicts else {}
    for text in args.method:
        name, equals, folder = text.partition("=")
        if not equals or not name or not folder:
            parser.error(f"--method {text}: expected NAME=DIR")
        methods[name] = Path(folder)
    if not methods:
        parser.error("nothing to score: give --verdicts DIR or --method NAME=DIR")
    missing = [str(folder) for folder in methods.values() if not folder.is_dir()]
    if missing:
        parser.error(f"no such folder: {', '.join(missing)}")
    return {name: load(args.cases, args.sealed, folder) for name, folder in methods.items()}


if __name__ == "__main__":
    sys.exit(main())
