"""Makes cases of `hydro gap` on a BlueROV2 whose truth is Fossen's equations in NumPy, without MuJoCo.

    python scripts/gen_bluerov.py --out out/bluerov                      every case, 10 trials of 20 s each
    python scripts/gen_bluerov.py --out out/bluerov --quick --name dry   4 trials of 6 s

Names: `dry` (the nominal has no water at all), `dry_current` (and there is a current), one part that an otherwise
complete nominal lacks, or `null`; each with the sensors `full` (position, attitude, gyro, DVL, accelerometer) or `dvl`
(DVL, gyro, depth, compass). OUT/cases/<id>/ and OUT/sealed/<id>/ are as gen_hidden.py writes them, sealed/index.json
says which id is which. A case that is there is not made again.
"""

import argparse
import os
import sys
from pathlib import Path

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

from hydro_mujoco.reading import read_json  # noqa: E402
from hydro_mujoco.recording.files import write_json  # noqa: E402
from hydro_mujoco.recording.progress import Progress  # noqa: E402
from hydro_tools.bluerov import nominal, numbers  # noqa: E402
from hydro_tools.bluerov.case import NAMES, Case, plan  # noqa: E402
from hydro_tools.hidden_cases import HiddenCaseError  # noqa: E402
from hydro_tools.hidden_cases.case import is_complete  # noqa: E402


def main() -> int:
    """Parse, make, write the index."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder for cases/ and sealed/")
    parser.add_argument("--seed", type=int, default=0, help="of the truths (default 0)")
    parser.add_argument("--name", action="append", choices=NAMES, help="only these cases")
    parser.add_argument("--suite", action="append", choices=list(nominal.SUITES), help="only these sensors")
    parser.add_argument(
        "--configuration", choices=list(numbers.PLACES), default="heavy", help="thrusters: eight, or six (standard)"
    )
    parser.add_argument("--quick", action="store_true", help="4 trials of 6 s instead of 10 of 20 s")
    args = parser.parse_args()
    specs = [
        spec
        for spec in plan(args.seed, quick=args.quick, configuration=args.configuration)
        if (not args.name or spec.name in args.name) and (not args.suite or spec.suite in args.suite)
    ]
    todo = [spec for spec in specs if not is_complete(args.out, spec.case_id)]
    progress = Progress(len(specs), "cases", done=len(specs) - len(todo))
    faults = []
    for spec in todo:
        try:
            Case(spec).make(args.out)
        except HiddenCaseError as error:
            faults.append(str(error))
        progress.advance()
    index = args.out / "sealed" / "index.json"
    index.parent.mkdir(parents=True, exist_ok=True)
    known = read_json(index)["cases"] if index.is_file() else []
    lines = {line["id"]: line for line in known}
    for spec in specs:
        if is_complete(args.out, spec.case_id):
            line = {"id": spec.case_id, "name": spec.name, "suite": spec.suite, "quick": spec.quick}
            lines[spec.case_id] = line | {"configuration": spec.configuration}
    write_json(index, {"seed": args.seed, "cases": list(lines.values())})
    for fault in faults:
        print(fault, file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
