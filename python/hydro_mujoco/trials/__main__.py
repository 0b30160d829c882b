"""Turn logs of real vehicles into trials for `hydro gap`.

    hydro trials convert dive.mcap --model nominal.xml --dry-run > map.toml
    hydro trials convert dive.mcap --model nominal.xml --mapping map.toml --out trials/
    hydro gap run --model nominal.xml --trials trials/ --out out/gap

Reads MCAP, ROS 2 and ROS 1 bags, PX4 ULog, ArduPilot DataFlash and telemetry, csv and parquet. With --dry-run what the
log holds goes to standard error, and a proposed mapping to standard output. The mapping file: docs/logs.md.
"""

import argparse
import json
import sys
import warnings
from pathlib import Path

from ..errors import DataError, Notice
from ..recording.interrupts import ended
from .convert import STOPPED, convert
from .log import KINDS, open_log
from .proposal import propose


def parse(words: list[str] | None = None) -> argparse.Namespace:
    """The command line, checked."""
    parser = argparse.ArgumentParser(
        prog="hydro trials", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", required=True)
    command = commands.add_parser("convert", help="a log into trials", description="Turn a log into trials.")
    command.add_argument("log", type=Path, nargs="+", help="logs, all by one mapping")
    command.add_argument("--model", type=Path, required=True, help="nominal MJCF")
    command.add_argument("--mapping", type=Path, help="TOML file, hydro-mapping/1")
    command.add_argument("--out", type=Path, help="folder of the trials; without it nothing is written")
    command.add_argument(
        "--dry-run", action="store_true", help="list what the log holds and propose a mapping; write nothing"
    )
    command.add_argument("--kind", choices=KINDS, help="of the log (default: by its name)")
    command.add_argument("--overwrite", action="store_true", help="replace trials of these logs in --out")
    command.add_argument("--json", action="store_true", help="print one JSON value and nothing else on standard output")
    args = parser.parse_args(words)
    if not args.dry_run and not args.mapping:
        parser.error("--mapping is missing; --dry-run proposes one")
    return args


def _show(message: Warning | str, category: type[Warning], *_: object, **__: object) -> None:
    if issubclass(category, Notice):
        print(f"trials: note: {message}", file=sys.stderr)


def main(words: list[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    args = parse(words)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("always", Notice)
            warnings.showwarning = _show
            return _proposed(args) if args.dry_run and not args.mapping else _converted(args)
    except DataError as error:
        print(f"trials: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(f"\ntrials: {STOPPED}", file=sys.stderr)
        return ended()


def _proposed(args: argparse.Namespace) -> int:
    proposal = propose(open_log(args.log[0], args.kind), args.model)
    print(proposal.listing(), file=sys.stderr)
    print(json.dumps({"open": proposal.open, "toml": proposal.toml}) if args.json else proposal.toml, end="")
    return 0


def _converted(args: argparse.Namespace) -> int:
    reports = []
    for path in args.log:
        out = None if args.dry_run else args.out
        found = convert(open_log(path, args.kind), args.model, args.mapping, out, overwrite=args.overwrite)
        reports.append(found.report.json())
        if not args.json:
            print(found.report)
            written = f"{len(found)} trials written to {out}" if out else "nothing is written"
            print(written)
    if args.json:
        print(json.dumps(reports))
    return 0


if __name__ == "__main__":
    sys.exit(main())
