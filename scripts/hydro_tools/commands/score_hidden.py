"""Scores verdicts on the hidden-effect cases: the table of figures and targets, with intervals.

    python scripts/score_hidden.py --cases out/hidden/cases --sealed out/hidden/sealed --verdicts out/verdicts
    python scripts/score_hidden.py ... --method gap=out/verdicts --method stlsq=out/rivals/stlsq [--json]
    python scripts/score_hidden.py ... --save out/record.jsonl         what was hidden and said, in one file
    python scripts/score_hidden.py --record out/record.jsonl           the table of such a file; several, of one table

Reads DIR/<case id>/verdict.json (and timing.json, {"seconds": x}, where there is one). Shares carry exact
binomial 95 % intervals, medians bootstrap ones. Strength is whitened, the nominal's uncertainties projected out.
"""

import argparse
import json
import sys
from pathlib import Path

from hydro_tools.hidden_cases.score import record
from hydro_tools.hidden_cases.score.read import Scored, ScoreError, load
from hydro_tools.hidden_cases.score.table import clean, score, show


def main() -> int:
    """Parse, load, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=Path, help="OUT/cases of gen_hidden.py")
    parser.add_argument("--sealed", type=Path, help="OUT/sealed of gen_hidden.py")
    parser.add_argument("--verdicts", type=Path, help="folder with <case id>/verdict.json")
    parser.add_argument(
        "--method", action="append", default=[], metavar="NAME=DIR", help="a method and its verdicts; several"
    )
    parser.add_argument(
        "--record",
        type=Path,
        action="append",
        default=[],
        metavar="FILE",
        help="what --save wrote, instead of folders; several, of different cases",
    )
    parser.add_argument("--only", metavar="NAME", help="of --record, this method alone; the records may hold others")
    parser.add_argument("--save", type=Path, metavar="FILE", help="writes what was hidden and said to a file")
    parser.add_argument("--json", action="store_true", help="one machine-readable result")
    args = parser.parse_args()
    if args.record and (args.cases or args.sealed or args.verdicts or args.method):
        parser.error("--record stands instead of --cases, --sealed, --verdicts and --method")
    if args.only and not args.record:
        parser.error("--only needs --record")
    try:
        said = record.load(args.record, args.only) if args.record else from_folders(parser, args)
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
