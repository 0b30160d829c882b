"""Fit MuJoCo's ellipsoid fluid of B1 to towing data by `mujoco.sysid`: the scene `mjcf/b1_truth.xml`.

    python scripts/gen_task1.py --out data/task1 --task 1.1 --seed 0       # the towing data
    python scripts/real_to_sim.py --towing data/task1 --out out/real_to_sim
    python scripts/real_to_sim.py --towing data/task1 --out models/real_to_sim --write

Reads raw/conditions.csv: mean force and standard error of every tow. Writes

    OUT/report.md, report.json, *.svg   errors before and after, intervals, what the data cannot tell
    OUT/identified.json, b1_truth.xml   the coefficients, and the free-swimming scene with them

--write puts the last two into the repository instead: scripts/hydro_tools/robot/identified.json and mjcf/b1_truth.xml.
The same seed and data give the same files. Needs pip install -e . -e scripts[sysid].
"""

import argparse
import json
import os
import shlex
import sys
import time
from pathlib import Path

# One thread: sums in one order.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

from hydro_mujoco.recording import arguments  # noqa: E402
from hydro_mujoco.recording.files import write_beside, write_json  # noqa: E402
from hydro_tools.datasets import DataError  # noqa: E402
from hydro_tools.repository import ROOT  # noqa: E402
from hydro_tools.robot import files, identified  # noqa: E402
from hydro_tools.robot.hull import DISPLACED_LITRES  # noqa: E402


def _share(text: str) -> float:
    value = float(text)
    if not 0.0 < value < 1.0:
        raise argparse.ArgumentTypeError(f"{value:g} is not a share: expected more than 0 and less than 1")
    return value


def _portable(path: Path) -> str:
    """A folder as it can be repeated elsewhere: absolute paths are cut to the last part."""
    return path.name if path.is_absolute() else path.as_posix()


def parse() -> argparse.Namespace:
    """The command line, checked."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--towing", type=Path, default=Path("data/task1"), help="folder with raw/conditions.csv (default: %(default)s)"
    )
    parser.add_argument("--out", type=Path, default=Path("out/real_to_sim"), help="folder (default: %(default)s)")
    parser.add_argument("--seed", type=arguments.seed, default=0, help="of what is held out (default: %(default)s)")
    parser.add_argument(
        "--holdout",
        type=_share,
        default=0.25,
        metavar="SHARE",
        help="share of the conditions that no fit sees (default: %(default)s)",
    )
    parser.add_argument(
        "--write",
        action="store_true",
        help="write identified.json and b1_truth.xml into the repository, not into --out",
    )
    return parser.parse_args()


def run(args: argparse.Namespace) -> dict:
    """Fit, and write everything; returns the report."""
    try:
        from hydro_tools.identification import figures, measurements, page, result, study
    except ImportError as error:
        raise DataError(f"{error}: python -m pip install -e . -e scripts[sysid]") from error
    table = measurements.find(args.towing)
    tows = measurements.read(table)
    if args.out.exists() and not args.out.is_dir():
        raise DataError(f"{args.out} is a file: choose a folder for --out")
    command = [
        "python",
        "scripts/real_to_sim.py",
        "--towing",
        _portable(args.towing),
        "--seed",
        str(args.seed),
        "--holdout",
        f"{args.holdout:g}",
    ]
    source = result.Source(shlex.join(command), table, args.seed, args.holdout)
    found = study.run(tows, args.holdout, args.seed)
    report = result.report(found, source)
    coefficients = result.coefficients(found) | {"from": report["from"]}
    scene = files.identified_scene(DISPLACED_LITRES, coefficients["coefficients"])

    args.out.mkdir(parents=True, exist_ok=True)
    into = (
        (identified.FILE, ROOT / files.IDENTIFIED)
        if args.write
        else (args.out / identified.FILE.name, args.out / Path(files.IDENTIFIED).name)
    )
    write_json(into[0], coefficients)
    write_beside(into[1], scene.encode())
    figures.draw(report, args.out)
    write_beside(args.out / "report.md", page.markdown(report).encode())
    write_beside(args.out / "report.json", (json.dumps(report) + "\n").encode())
    for path in into:
        print(f"wrote {path.relative_to(ROOT) if args.write else path}")
    return report


def main() -> int:
    """Run the command line; returns the exit status."""
    args = parse()
    start = time.monotonic()
    try:
        report = run(args)
    except (DataError, OSError) as error:
        print(f"real_to_sim.py: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("\nreal_to_sim.py: stopped; nothing was written", file=sys.stderr)
        return 130
    before, after = (
        report["errors"][model]["held_out"]["rmse"]["pooled"]["value"] for model in ("default", "identified")
    )
    left = report["left_out_configuration"]["all"]["rmse"]["pooled"]["value"]
    print(
        f"{args.out / 'report.md'}: {report['tows']['held_out']} held-out tows, RMSE {before:.2f} N with the defaults, "
        f"{after:.2f} N identified; {left:.2f} N with the leg configuration left out; {time.monotonic() - start:.1f} s"
    )
    return 0
