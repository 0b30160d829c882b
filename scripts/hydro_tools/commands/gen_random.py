"""Makes cases of `hydro gap` on random systems: bodies, joints, hulls, actuators, sensors, excitation, effects.

    python scripts/gen_random.py --out out/random --count 40 --seed 1
    python scripts/gen_random.py --out out/random --count 40 --seed 1 --quick --null-share 0.3

For tuning, so that nothing is tuned on the systems that a method is judged by. OUT/cases/<id>/ and OUT/sealed/<id>/
are as gen_hidden.py writes them; kinds are null, single, pair and several. The first N cases of a seed are the same
whatever the count. Interrupted, it goes on where it was.
"""

import argparse
import os
import sys
from functools import partial
from pathlib import Path

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

from hydro_mujoco.recording.files import write_json  # noqa: E402
from hydro_mujoco.recording.progress import Progress  # noqa: E402
from hydro_tools.hidden_cases import HiddenCaseError  # noqa: E402
from hydro_tools.hidden_cases.case import is_complete  # noqa: E402
from hydro_tools.hidden_cases.making import make_all  # noqa: E402
from hydro_tools.random_systems.cases import case_id, make  # noqa: E402


def _make(index: int, args: argparse.Namespace) -> str | None:
    """Make one case; returns what went wrong."""
    try:
        make(args.seed, index, args.out, null_share=args.null_share, small=args.quick)
        return None
    except HiddenCaseError as error:
        return str(error)


def main() -> int:
    """Parse, make, write the manifest."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder for cases/ and sealed/")
    parser.add_argument("--seed", type=int, default=0, help="of everything (default 0)")
    parser.add_argument("--count", type=int, default=20, help="how many cases (default 20)")
    parser.add_argument("--null-share", type=float, default=0.25, help="share that hides nothing (default 0.25)")
    parser.add_argument("--quick", action="store_true", help="4 trials of 6 s instead of 8 of 8 to 12 s")
    parser.add_argument("--jobs", type=int, default=1, help="worker processes (default 1)")
    args = parser.parse_args()
    if not 0 <= args.null_share <= 1:
        parser.error(f"--null-share {args.null_share}: expected 0 to 1")
    ids = [case_id(args.seed, index, small=args.quick) for index in range(args.count)]
    todo = [index for index, name in enumerate(ids) if not is_complete(args.out, name)]
    progress = Progress(args.count, "cases", done=args.count - len(todo))
    faults = make_all(partial(_make, args=args), todo, args.jobs, progress)
    write_json(
        args.out / "manifest.json",
        {
            "schema": "hydro-hidden/1",
            "seed": args.seed,
            "quick": args.quick,
            "null_share": args.null_share,
            "cases": [{"id": name} for name in ids if is_complete(args.out, name)],
        },
    )
    for fault in faults:
        print(fault, file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
