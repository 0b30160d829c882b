#!/usr/bin/env python3
"""Real measurements for `hydro gap`: trial files from the csv files, the runs, and a check by SciPy.

    python scripts/real_data.py --out out/real                    # OUT/<case>/{nominal.xml,trials/*.npz}
    python scripts/real_data.py --out out/real --check            # and what SciPy alone finds in them
    python scripts/real_data.py --out out/real --run              # and what `hydro gap run` says of them

Cases: roll_decay (a single release: missing is quadratic damping) and ball_<name>, two drops each (missing is
the air's drag). The first states are estimated from the first readings (see `measured/`).
Needs numpy and, for --check, scipy; --run needs `cargo build --release` and the MuJoCo of .venv.
"""

import argparse
import json
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from hydro_tools.datasets.measured import MeasuredError, ball_drops, roll_decay
from hydro_tools.datasets.measured.trial import Trial, write

ROOT = Path(__file__).resolve().parent.parent
CASES = (roll_decay.CASE, *ball_drops.BALLS)


def make_case(case: str, data: Path, out: Path, with_speed: bool) -> list[Trial]:
    """Write OUT/<case>/nominal.xml and its trials; returns them."""
    source = ROOT / "mjcf" / "gap" / f"{case}.xml"
    trials = roll_decay.trials(data) if case == roll_decay.CASE else ball_drops.trials(data, case, with_speed)
    folder = out / case
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, folder / "nominal.xml")
    timestep = float(ElementTree.parse(source).find("option").get("timestep"))
    for trial in trials:
        write(trial, folder / "trials", timestep)
    return trials


def check(cases: dict[str, list[Trial]]) -> dict[str, dict]:
    """Print SciPy's fits and return them."""
    try:
        from hydro_tools.datasets.measured import reference
    except ImportError as error:
        raise MeasuredError(f"--check needs scipy ({error}): python -m pip install scipy, in an environment of its own")
    found: dict[str, dict] = {}
    print("SciPy alone (95 % intervals; RMS of the residual; log evidence against no such effect)")
    for case, trials in cases.items():
        if case == roll_decay.CASE:
            hull = ElementTree.parse(ROOT / "mjcf/gap/roll_decay.xml").find(".//body[@name='hull']")
            inertia = float(hull.find("inertial").get("diaginertia").split()[0])
            joint = hull.find("joint")
            stiffness, _, cubic = map(float, joint.get("stiffness").split())
            fits = reference.roll(trials[0], inertia, stiffness, cubic, float(joint.get("damping")))
            sets, unit, base, mass = {"": fits}, dict.fromkeys(reference.ROLL, "N m s^2/rad^2"), "nominal", 1.0
        else:
            sets = {"both drops": reference.ball(trials)} | {t.name: reference.ball([t]) for t in trials}
            unit, base = {"linear": "N s/m", "quadratic": "N s^2/m^2"}, "none"
            mass = float(ElementTree.parse(ROOT / f"mjcf/gap/{case}.xml").find(".//geom").get("mass"))
        found[case] = {}
        for which, fits in sets.items():
            rows = {}
            for name, fit in fits.items():
                low, high = (mass * end for end in fit.ci95)
                gain = fit.log_evidence - fits[base].log_evidence
                rows[name] = {"value": mass * fit.value, "ci95": [low, high], "rms": fit.rms,
                              "log_evidence": gain}
                numbers = "" if name == base else (f"{mass * fit.value:10.4g} [{low:.4g}, {high:.4g}] {unit[name]}"
                                                   f", log evidence {gain:+.1f}")
                print(f"  {case:20} {which:10} {name:17} rms {fit.rms:.4g} {numbers}")
            found[case][which or "release"] = rows
    return found


def run_gap(program: Path, case: Path, extra: list[str]) -> dict:
    """`hydro gap run` on a case folder; returns its verdict."""
    if not program.is_file():
        raise MeasuredError(f"{program} is not there: build it with `cargo build --release`, or give --hydro")
    out = case / "gap"
    command = [str(program), "gap", "run", "--model", str(case / "nominal.xml"), "--trials", str(case / "trials"),
               "--out", str(out), *extra]
    done = subprocess.run(command, capture_output=True, text=True)
    verdict = out / "verdict.json"
    if done.returncode != 0 or not verdict.is_file():
        raise MeasuredError(f"{case.name}: `{' '.join(command)}` ended with {done.returncode}: {done.stderr.strip()}")
    return json.loads(verdict.read_text())


def table(verdicts: dict[str, dict]) -> str:
    """One line a case and one a parameter: verdict, probability, value, interval, reduction."""
    lines = []
    for case, verdict in verdicts.items():
        gap = verdict.get("gap") or {}
        reduction = gap.get("reduction")
        told = "no reduction claimed" if reduction is None or not verdict.get("verified") else (
            f"gap {gap['before']:.3g} -> {gap['after']:.3g}, reduction {reduction:.2f} "
            f"[{gap['ci95'][0]:.2f}, {gap['ci95'][1]:.2f}]")
        what = ", ".join(verdict.get("named") or []) or "-"
        undecided = ", ".join(verdict.get("confusion_set") or [])
        lines.append(f"{case:20} {verdict['verdict']:10} {what:30} {told}")
        if undecided:
            lines.append(f"{'':20} cannot tell apart: {undecided}; next: {verdict.get('next_experiment')}")
        if verdict.get("refused_because"):
            lines.append(f"{'':20} {verdict['refused_because']}")
        for effect in verdict.get("effects") or []:
            for parameter in effect["parameters"]:
                low, high = parameter["ci95"]
                lines.append(f"{'':20} {effect['effect']} on {effect['target']} (p {effect['probability']:.2f}): "
                             f"{parameter['name']} {parameter['value']:.4g} [{low:.4g}, {high:.4g}] "
                             f"{parameter['unit']}")
    return "\n".join(lines)


def parse() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data",
                        help="folder of the csv files (default: ../shared/data)")
    parser.add_argument("--out", type=Path, required=True, help="folder to write the cases to")
    parser.add_argument("--case", choices=CASES, action="append", help="only this one; may be given again")
    parser.add_argument("--with-speed", action="store_true", help="keep the balls' differentiated speed as a sensor")
    parser.add_argument("--check", action="store_true", help="fit by SciPy too; writes OUT/reference.json")
    parser.add_argument("--run", action="store_true", help="run `hydro gap` on each case; writes OUT/<case>/gap")
    parser.add_argument("--hydro", type=Path, default=ROOT / "target" / "release" / "hydro",
                        help="the program (default: target/release/hydro)")
    parser.add_argument("--gap-option", action="append", default=[], metavar="WORD",
                        help="a word passed on to `hydro gap run`, such as --gap-option=--seed --gap-option=1")
    return parser.parse_args()


def main() -> int:
    args = parse()
    try:
        cases = {}
        for case in args.case or CASES:
            cases[case] = make_case(case, args.data, args.out, args.with_speed)
            for trial in cases[case]:
                print(f"{case}/{trial.name}: {len(trial.time)} rows, {trial.time[-1]:.2f} s, "
                      f"starts at {trial.position:.5g}, {trial.velocity:.4g} a second")
        if args.check:
            (args.out / "reference.json").write_text(json.dumps(check(cases), indent=1))
        if args.run:
            print(table({case: run_gap(args.hydro, args.out / case, args.gap_option) for case in cases}))
    except (MeasuredError, OSError) as error:
        print(f"real_data.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
