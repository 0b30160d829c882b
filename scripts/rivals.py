#!/usr/bin/env python3
"""Rivals of `hydro gap` on the same cases: PySINDy, its ensemble, BINDy, `mujoco.sysid`, a residual network.

    scripts/rivals/setup.sh                                                     # an environment of its own
    .venv-rivals/bin/python scripts/rivals.py run --cases out/hidden/cases --out out/rivals --jobs 2
    .venv-rivals/bin/python scripts/rivals.py tune --cases out/own/cases --answers out/own/sealed

`run` writes OUT/<method>/<case id>/verdict.json and goes on where it was; a case that a method cannot take has a
verdict that says why. `tune` prints how often each setting of the sparse methods names the exact set, on cases of
its own: never on those that are scored.
"""

import argparse
import itertools
import json
import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

from hydro_data.progress import Progress  # noqa: E402
from rivals import RivalError  # noqa: E402
from rivals.settings import METHODS, SPARSE  # noqa: E402

GRIDS = {
    "stlsq": {"threshold": [0.05, 0.1, 0.15, 0.2, 0.3, 0.45, 0.6], "alpha": [1e-4, 1e-2, 1e-1, 1.0],
              "least_share": [0.3, 0.5, 0.8, 0.95]},
    "ensemble": {"threshold": [0.1, 0.2, 0.3, 0.45], "alpha": [1e-2, 1e-1], "inclusion": [0.6, 0.9],
                 "least_share": [0.3, 0.5, 0.8]},
    "bindy": {"prior": [0.3, 1.0, 3.0], "correlation": [1.0, 3.0, 10.0, 30.0], "least_share": [0.3, 0.5, 0.8]},
}
TEST_S = (0.5, 1.0, 2.0)


def one_case(folder: Path, out: Path, methods: list[str], shifted: Path | None) -> list[str]:
    """Run the methods that have no verdict yet on a case; returns a line each."""
    from rivals import case

    lines, bench, fault = [], None, None
    for method in methods:
        place = out / method / folder.name
        if (place / "verdict.json").is_file():
            continue
        settings = METHODS[method]
        began = time.monotonic()
        try:
            if fault:
                raise RivalError(fault)
            if bench is None:
                bench = case.Bench(folder, settings.smooth_s)
            verdict = case.run(bench, method, settings, others(shifted, folder.name))
        except RivalError as error:
            fault = str(error) if bench is None else None
            verdict = case.impossible(method, str(error))
        case.write(verdict, place)
        gap = verdict["gap"]
        told = "" if gap["before"] is None else f", gap {gap['before']:.3f} -> {gap['after']:.3f}"
        lines.append(f"{folder.name} {method:9} {verdict['verdict']:8} {'+'.join(verdict['named']) or '-'}{told}, "
                     f"{time.monotonic() - began:.1f} s")
    return lines


def others(folder: Path | None, case_id: str) -> list[Path]:
    """Trials of another regime for a case, if any."""
    if folder is None:
        return []
    for place in (folder / case_id / "never_shown", folder / case_id / "trials", folder / case_id):
        found = sorted(p for p in place.glob("*") if p.suffix in (".npz", ".csv"))
        if found:
            return found
    return []


def run(args: argparse.Namespace) -> int:
    """Every case by every method."""
    cases = folders(args)
    todo = [c for c in cases if any(not (args.out / m / c.name / "verdict.json").is_file() for m in args.method)]
    progress = Progress(len(cases), "cases", done=len(cases) - len(todo))
    with ProcessPoolExecutor(args.jobs) as pool:
        jobs = {pool.submit(one_case, c, args.out, args.method, args.shifted): c for c in todo}
        for done in as_completed(jobs):
            for line in done.result():
                print(line, flush=True)
            progress.advance()
    return 0


def folders(args: argparse.Namespace) -> list[Path]:
    """The cases, in order."""
    if not args.cases.is_dir():
        raise RivalError(f"{args.cases} is no folder: give the cases/ of gen_hidden.py by --cases")
    found = sorted(p for p in args.cases.iterdir() if (p / "nominal.xml").is_file())
    if not found:
        raise RivalError(f"{args.cases} holds no case (a folder with nominal.xml and trials/)")
    return found[:args.count] if args.count else found


def tuned_case(folder: Path, answers: Path, methods: list[str]) -> list[tuple[str, float, tuple, bool, bool]]:
    """(method, test_s, setting, is a null, right) of every setting on a case."""
    from rivals import case, sparse

    answer = json.loads((answers / folder.name / "answer.json").read_text())
    if answer["kind"] == "outside":
        return []
    truths = [sorted(names) for names in answer["acceptable"]] or [[]]
    try:
        bench = case.Bench(folder, METHODS["stlsq"].smooth_s)
    except RivalError:
        return []
    out = []
    for test_s, method in itertools.product(TEST_S, methods):
        problem = bench.problem(test_s)
        # `least_share`, the last, only cuts what a fit has found.
        names, cuts = list(GRIDS[method])[:-1], GRIDS[method]["least_share"]
        for values in itertools.product(*(GRIDS[method][name] for name in names)):
            found = getattr(sparse, method)(problem, **dict(zip(names, values)))
            strength = sparse.contributions(problem, found)
            for cut in cuts:
                right = sorted(sparse.named(strength, cut)) in truths
                out.append((method, test_s, (*values, cut), answer["kind"] == "null", right))
    return out


def tune(args: argparse.Namespace) -> int:
    """Print the best settings of each sparse method."""
    cases, rows = folders(args), []
    methods = [m for m in args.method if m in SPARSE]
    progress = Progress(len(cases), "cases")
    with ProcessPoolExecutor(args.jobs) as pool:
        for done in as_completed([pool.submit(tuned_case, c, args.answers, methods) for c in cases]):
            rows += done.result()
            progress.advance()
    for method in methods:
        table: dict[tuple, list[list[bool]]] = {}
        for name, test_s, values, null, right in rows:
            if name == method:
                table.setdefault((test_s, values), [[], []])[int(null)].append(right)
        # A false alarm costs as much as a missed name, each as a share of its kind.
        ranked = sorted(table.items(), key=lambda item: -sum(sum(x) / max(len(x), 1) for x in item[1]))
        print(f"\n{method}: test_s, {', '.join(GRIDS[method])}: exact set of cases with an effect, nulls kept silent")
        for (test_s, values), (cases_right, nulls_right) in ranked[:6]:
            print(f"  {test_s:g}, {', '.join(f'{v:g}' for v in values)}: {sum(cases_right)}/{len(cases_right)}, "
                  f"{sum(nulls_right)}/{len(nulls_right)}")
    return 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("run", "tune"))
    parser.add_argument("--cases", type=Path, required=True, help="folder of case folders")
    parser.add_argument("--out", type=Path, default=Path("out/rivals"), help="where verdicts go (default: out/rivals)")
    parser.add_argument("--method", action="append", choices=sorted(METHODS), help="only these (default: all)")
    parser.add_argument("--answers", type=Path, help="sealed answers of the cases that `tune` tunes on")
    parser.add_argument("--shifted", type=Path, help="folder with <case id>/ of trials from another regime, scored only")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="worker processes")
    parser.add_argument("--count", type=int, help="at most so many cases")
    args = parser.parse_args()
    args.method = args.method or list(METHODS)
    if args.what == "tune" and args.answers is None:
        parser.error("tune needs --answers")
    try:
        return run(args) if args.what == "run" else tune(args)
    except (RivalError, OSError) as error:
        print(f"rivals.py: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("rivals.py: stopped; run it again to go on", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main())
