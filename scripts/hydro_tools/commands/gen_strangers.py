"""Makes cases of `hydro gap` on others' robots: MJCF from the wheels of dm-control, gymnasium-robotics, robosuite.

    pip download --no-deps --dest wheels dm-control gymnasium-robotics robosuite
    python scripts/gen_strangers.py --wheels wheels --out out/strangers --quick
    python scripts/gen_strangers.py --wheels wheels --out out/strangers --robot panda --effect joint_friction

For each robot a null, every effect that makes sense on it, one pair. OUT/cases/<id>/ and OUT/sealed/<id>/ are as
gen_hidden.py writes them; OUT/sealed/index.json says which id is which. WHEELS may hold wheels or what they unpack to.
What was changed in each MJCF stands in hydro_tools/strangers/robots.py.
"""

import argparse
import os
import sys
from pathlib import Path

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

from hydro_mujoco.recording.files import write_json  # noqa: E402
from hydro_mujoco.recording.progress import Progress  # noqa: E402
from hydro_tools.hidden_cases import HiddenCaseError  # noqa: E402
from hydro_tools.hidden_cases.case import is_complete  # noqa: E402
from hydro_tools.strangers.cases import make, plan  # noqa: E402
from hydro_tools.strangers.robots import ROBOTS, system  # noqa: E402
from hydro_tools.strangers.wheels import Wheels  # noqa: E402


def main() -> int:
    """Parse, make, write the index."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--wheels", type=Path, required=True, help="folder of the wheels, or of what is in them")
    parser.add_argument("--out", type=Path, required=True, help="folder for cases/ and sealed/")
    parser.add_argument("--seed", type=int, default=0, help="of the truths (default 0)")
    parser.add_argument("--robot", action="append", choices=list(ROBOTS), help="only these robots")
    parser.add_argument("--effect", action="append", help="only cases that hide this effect; `none`: nulls")
    parser.add_argument("--quick", action="store_true", help="4 trials of 6 s instead of 8 of 10 s")
    args = parser.parse_args()
    faults, lines = [], []
    try:
        wheels = Wheels(args.wheels)
        robots = {name: system(name, wheels) for name in args.robot or ROBOTS}
    except HiddenCaseError as error:
        parser.error(str(error))
    specs = []
    for name, robot in robots.items():
        effects = sorted(robot.singles(robot.model))
        for spec in plan(name, effects, args.seed, robot.robot.factors, small=args.quick):
            if not args.effect or set(args.effect) & set(spec.effects or ("none",)):
                specs.append(spec)
    progress = Progress(len(specs), "cases")
    for spec in specs:
        try:
            if not is_complete(args.out, spec.case_id):
                make(spec, robots[spec.system], args.out)
            lines.append({"id": spec.case_id, "robot": spec.system, "effects": list(spec.effects)})
        except HiddenCaseError as error:
            faults.append(f"{spec.system}, {'+'.join(spec.effects) or 'nothing'}: {error}")
        progress.advance()
    (args.out / "sealed").mkdir(parents=True, exist_ok=True)
    write_json(args.out / "sealed" / "index.json", {"seed": args.seed, "quick": args.quick, "cases": lines})
    for fault in faults:
        print(fault, file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
