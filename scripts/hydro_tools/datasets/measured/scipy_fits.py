"""SciPy's own fits of the measured cases, printed beside their evidence."""

import xml.etree.ElementTree as ElementTree

from ...repository import ROOT
from . import MeasuredError, ball_drops, roll_decay
from .trial import Trial


def check(cases: dict[str, list[Trial]]) -> dict[str, dict]:
    """Print SciPy's fits and return them."""
    try:
        from . import reference
    except ImportError as error:
        raise MeasuredError(f"--check needs scipy ({error}): python -m pip install -e . -e scripts[tank]") from error
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
        elif case not in ball_drops.BALLS:
            print(f"  {case:20} not fitted: no equation of it stands in reference.py")
            continue
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
                rows[name] = {"value": mass * fit.value, "ci95": [low, high], "rms": fit.rms, "log_evidence": gain}
                numbers = (
                    ""
                    if name == base
                    else (f"{mass * fit.value:10.4g} [{low:.4g}, {high:.4g}] {unit[name]}, log evidence {gain:+.1f}")
                )
                print(f"  {case:20} {which:10} {name:17} rms {fit.rms:.4g} {numbers}")
            found[case][which or "release"] = rows
    return found
