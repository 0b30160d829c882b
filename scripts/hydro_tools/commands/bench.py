"""Time `hydro` and other implementations in alternation; write benches/RESULTS.md from the raw blocks.

    .venv-bench/bin/python scripts/bench.py [--quick] [--only evaluate step] [--report]

Needs the environment of scripts/setup_venv.sh bench, and the release build of the library, of `hydro` and of the bench
`implementation`; scripts/bench.sh sees to both. A part that is run replaces its file in benches/results; the page is
made from all files there, each with its own commit. Leave the machine alone meanwhile.
"""

import argparse
import sys
from pathlib import Path

from hydro_tools.benchmarks import RESULTS, WORK, BenchmarkError, machine, plots, record
from hydro_tools.benchmarks.page import page
from hydro_tools.benchmarks.parts import PARTS
from hydro_tools.benchmarks.settings import Settings


def parse() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--quick", action="store_true", help="few short blocks, into out/bench/quick: does everything work?"
    )
    parser.add_argument(
        "--only", nargs="+", choices=PARTS, default=list(PARTS), metavar="PART", help=f"of {', '.join(PARTS)}"
    )
    parser.add_argument("--report", action="store_true", help="measure nothing, write the page again")
    return parser.parse_args()


def write_page(folder: Path, results: Path) -> None:
    """`RESULTS.md` and its pictures in `folder`, from the records in `results`."""
    records = record.read(results, PARTS)
    (folder / "RESULTS.md").write_text(page(records))
    if "train" in records:
        plots.losses(records["train"]["groups"], folder / "loss.svg")
    if "scaling" in records:
        plots.sizes(records["scaling"]["groups"], folder / "scaling.svg")
    print(f"wrote {folder / 'RESULTS.md'}")


def main() -> int:
    """Run the command line; returns the exit status."""
    options = parse()
    results = WORK / "quick/results" if options.quick else RESULTS
    try:
        for part in [] if options.report else options.only:
            stamp, others = machine.stamp(), machine.Others()
            print(f"== {PARTS[part].TITLE}", flush=True)
            groups = PARTS[part].measure(Settings(options.quick))
            record.write(results, part, groups, quick=options.quick, stamp=stamp | {"others": others.share()})
        write_page(results.parent, results)
    except BenchmarkError as error:
        print(f"bench.py: {error}", file=sys.stderr)
        return 1
    return 0
