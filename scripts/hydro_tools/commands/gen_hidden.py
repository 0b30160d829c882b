"""Makes the hidden-effect benchmark: cases that a tool may open, and sealed answers in another tree.

    python scripts/gen_hidden.py --out out/hidden                 the whole: more than 400 cases
    python scripts/gen_hidden.py --out out/hidden --count 12 --system vehicle
    python scripts/gen_hidden.py --out out/hidden --fixed         the small part of scripts/test.sh

OUT/cases/<id>/{nominal.xml, case.json, trials/} and OUT/sealed/<id>/{answer.json, never_shown/, faster/}, trials
kept back: driven alike, and half as fast again. Names tell nothing. Interrupted, it goes on where it was; the same
seed gives the same bytes whatever the workers.
"""

import argparse
import os
import sys
from functools import partial
from pathlib import Path

# One thread a worker: sums in one order, and no fight over cores.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

from hydro_mujoco.recording.files import write_json  # noqa: E402
from hydro_mujoco.recording.progress import Progress  # noqa: E402
from hydro_tools.hidden_cases import HiddenCaseError, plan  # noqa: E402
from hydro_tools.hidden_cases.case import Case, Spec, is_complete  # noqa: E402
from hydro_tools.hidden_cases.making import make_all  # noqa: E402
from hydro_tools.hidden_cases.systems import SYSTEMS  # noqa: E402


def make(spec: Spec, out: Path) -> str | None:
    """Make one case; returns what went wrong."""
    try:
        Case(spec).make(out)
        return None
    except HiddenCaseError as error:
        return f"case {spec.index} ({spec.kind}, {spec.system}, {'+'.join(spec.effects) or 'nothing'}): {error}"


def chosen(args: argparse.Namespace) -> list[Spec]:
    """The specs that the filters leave."""
    specs = plan.fixed() if args.fixed else plan.full(args.seed)
    specs = [
        spec
        for spec in specs
        if (not args.system or spec.system in args.system)
        and (not args.kind or spec.kind in args.kind)
        and (not args.effect or set(args.effect) & set(spec.effects))
    ]
    if args.quick and not args.fixed:
        specs = [Spec(**{**spec.__dict__, "small": True}) for spec in specs]
    return specs[: args.count] if args.count else specs


def main() -> int:
    """Parse, make, write the manifest."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder for cases/ and sealed/")
    parser.add_argument("--seed", type=int, default=0, help="of the whole plan (default 0)")
    parser.add_argument("--system", action="append", choices=sorted(SYSTEMS), help="only these systems")
    parser.add_argument("--kind", action="append", choices=sorted(plan.COUNTS), help="only these kinds")
    parser.add_argument("--effect", action="append", help="only cases that hold this effect")
    parser.add_argument("--count", type=int, help="at most so many cases, the first of the plan")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="worker processes")
    parser.add_argument("--quick", action="store_true", help="short trials, few of them")
    parser.add_argument("--fixed", action="store_true", help="the small fixed part instead of the plan")
    args = parser.parse_args()
    specs = chosen(args)
    if not specs:
        parser.error("no case is left by --system, --kind and --effect")
    args.out.mkdir(parents=True, exist_ok=True)
    todo = [spec for spec in specs if not is_complete(args.out, spec.case_id)]
    progress = Progress(len(specs), "cases", done=len(specs) - len(todo))
    faults = make_all(partial(make, out=args.out), todo, args.jobs, progress)
    write_json(
        args.out / "manifest.json",
        {
            "schema": "hydro-hidden/1",
            "seed": args.seed,
            "quick": args.quick,
            "fixed": args.fixed,
            "cases": sorted(
                ({"id": spec.case_id, "system": spec.system} for spec in specs if is_complete(args.out, spec.case_id)),
                key=lambda line: line["id"],
            ),
        },
    )
    for fault in faults:
        print(fault, file=sys.stderr)
    return 1 if faults else 0
