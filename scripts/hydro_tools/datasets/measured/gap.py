"""`hydro gap run` on a measured case, and its verdicts as lines."""

import json
import subprocess
from pathlib import Path

from . import MeasuredError


def run_gap(program: Path, case: Path, extra: list[str]) -> dict:
    """`hydro gap run` on a case folder; returns its verdict."""
    if not program.is_file():
        raise MeasuredError(f"{program} is not there: build it with `cargo build --release`, or give --hydro")
    out = case / "gap"
    uncertainty = case / "nominal.toml"
    command = [
        str(program),
        "gap",
        "run",
        "--model",
        str(case / "nominal.xml"),
        "--trials",
        str(case / "trials"),
        "--out",
        str(out),
        *(["--uncertainty", str(uncertainty)] if uncertainty.is_file() else []),
        *extra,
    ]
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
        told = (
            "no reduction claimed"
            if reduction is None or not verdict.get("verified")
            else (
                f"gap {gap['before']:.3g} -> {gap['after']:.3g}, reduction {reduction:.2f} "
                f"[{gap['ci95'][0]:.2f}, {gap['ci95'][1]:.2f}]"
            )
        )
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
                lines.append(
                    f"{'':20} {effect['effect']} on {effect['target']} (p {effect['probability']:.2f}): "
                    f"{parameter['name']} {parameter['value']:.4g} [{low:.4g}, {high:.4g}] "
                    f"{parameter['unit']}"
                )
    return "\n".join(lines)
