r"""Run the baselines on the cases of `hydro gap`: PySINDy, its ensemble, BINDy, `mujoco.sysid`, a residual network.

    scripts/setup_venv.sh baselines                                             # an environment of its own
    .venv-rivals/bin/python scripts/rivals.py run --cases out/hidden/cases --sealed out/hidden/sealed \
        --out out/rivals --jobs 2
    .venv-rivals/bin/python scripts/rivals.py tune --cases out/own/cases --sealed out/own/sealed
    .venv-rivals/bin/python scripts/rivals.py patched --cases out/hidden/cases --sealed out/hidden/sealed \
        --verdicts out/verdicts

`run` writes OUT/<method>/<case id>/verdict.json and goes on where it was; a case that a method cannot take has a
verdict that says why. With `--sealed` it also scores the trials that no method is shown (`elsewhere` in the verdict),
and `patched` scores on the same trials what `hydro gap` wrote (elsewhere.json beside its verdict). `tune` prints
how well each setting does on cases of its own: never on those that are scored. `--twin ID=OTHER` (a BlueROV2 with a DVL
alone, say) takes the states at which rollouts of ID start from the logs of OTHER.
"""

import argparse
import os
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

from hydro_mujoco import DataError  # noqa: E402
from hydro_mujoco.recording.progress import Progress  # noqa: E402
from hydro_tools.baselines import BaselineError  # noqa: E402
from hydro_tools.baselines.settings import METHODS  # noqa: E402


def results(args: argparse.Namespace, cases: list[Path], todo: list[Path], task: Callable, *more) -> Iterator:
    """Results of `task(case, *more)` on the cases to do, as they come; `--jobs` processes side by side."""
    progress = Progress(len(cases), "cases", done=len(cases) - len(todo))
    with ProcessPoolExecutor(args.jobs) as pool:
        for done in as_completed([pool.submit(task, c, *more) for c in todo]):
            yield done.result()
            progress.advance()


def score_patched(args: argparse.Namespace) -> int:
    """Every case with a verdict of `hydro gap`."""
    from hydro_tools.baselines import work

    cases = [c for c in folders(args) if (args.verdicts / c.name / "verdict.json").is_file()]
    todo = [c for c in cases if not (args.verdicts / c.name / "elsewhere.json").is_file()]
    done = results(args, cases, todo, work.one_patched, args.verdicts, args.sealed, dict(args.twin))
    faults = [fault for fault in done if fault]
    for fault in faults:
        print(fault, file=sys.stderr)
    return 1 if faults else 0


def run(args: argparse.Namespace) -> int:
    """Every case by every method."""
    from hydro_tools.baselines import work

    cases = folders(args)
    todo = [c for c in cases if any(not (args.out / m / c.name / "verdict.json").is_file() for m in args.method)]
    for lines in results(args, cases, todo, work.one_case, args.out, args.method, args.sealed):
        for line in lines:
            print(line, flush=True)
    return 0


def folders(args: argparse.Namespace) -> list[Path]:
    """The cases, in order."""
    if not args.cases.is_dir():
        raise BaselineError(f"{args.cases} is no folder: give the cases/ of gen_hidden.py by --cases")
    found = sorted(p for p in args.cases.iterdir() if (p / "nominal.xml").is_file())
    if not found:
        raise BaselineError(f"{args.cases} holds no case (a folder with nominal.xml and trials/)")
    return found[: args.count] if args.count else found


def twin(text: str) -> tuple[str, str]:
    """ID=OTHER."""
    case, equals, other = text.partition("=")
    if not equals or not case or not other:
        raise argparse.ArgumentTypeError(f"{text}: expected ID=OTHER")
    return case, other


def tune(args: argparse.Namespace) -> int:
    """Print the best settings of each method."""
    from hydro_tools.baselines import tuning

    cases, names, errors = folders(args), [], []
    for named, left in results(args, cases, cases, tuning.one_case, args.sealed, args.method):
        names, errors = names + named, errors + left
    print("\n".join(tuning.ranking(args.method, names, errors)))
    return 0


def main() -> int:
    """Run the command line; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("run", "tune", "patched"))
    parser.add_argument("--cases", type=Path, required=True, help="folder of case folders")
    parser.add_argument("--out", type=Path, default=Path("out/rivals"), help="where verdicts go (default: out/rivals)")
    parser.add_argument("--method", action="append", choices=sorted(METHODS), help="only these (default: all)")
    parser.add_argument(
        "--sealed",
        type=Path,
        help="OUT/sealed of gen_hidden.py: trials that are scored and never fitted; `tune` also reads the answers",
    )
    parser.add_argument("--verdicts", type=Path, help="what run_hidden.py wrote, for `patched`")
    parser.add_argument(
        "--twin",
        action="append",
        default=[],
        metavar="ID=OTHER",
        type=twin,
        help="for `patched`: case ID, whose sensors do not show its state, has the motions of case OTHER, whose do",
    )
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="worker processes")
    parser.add_argument("--count", type=int, help="at most so many cases")
    args = parser.parse_args()
    args.method = args.method or list(METHODS)
    for need in {"run": (), "tune": ("sealed",), "patched": ("sealed", "verdicts")}[args.what]:
        if getattr(args, need) is None:
            parser.error(f"{args.what} needs --{need}")
    try:
        return {"run": run, "tune": tune, "patched": score_patched}[args.what](args)
    except (BaselineError, DataError, OSError) as error:
        print(f"rivals.py: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("rivals.py: stopped; run it again to go on", file=sys.stderr)
        return 130
