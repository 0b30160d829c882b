"""The work on one case, for a worker process: every method, or what `hydro gap` wrote."""

import time
from pathlib import Path

from . import BaselineError, case, motion, patched
from .settings import METHODS, Settings


def one_case(folder: Path, out: Path, methods: list[str], sealed: Path | None) -> list[str]:
    """Run the methods that have no verdict yet on a case; returns a line each."""
    lines, prepared, fault = [], None, None
    kept_back = motion.kept_back(sealed, folder.name) if sealed else {}
    for method in methods:
        place = out / method / folder.name
        if (place / "verdict.json").is_file():
            continue
        settings = METHODS[method]
        began = time.monotonic()
        try:
            if fault:
                raise BaselineError(fault)
            if prepared is None:
                prepared = case.PreparedCase(folder, settings.smooth_s)
            verdict = case.run(prepared, method, settings, kept_back)
        except BaselineError as error:
            fault = str(error) if prepared is None else None
            verdict = case.impossible(method, str(error))
        case.write(verdict, place)
        gap = verdict["gap"]
        told = "" if gap["before"] is None else f", gap {gap['before']:.3f} -> {gap['after']:.3f}"
        lines.append(
            f"{folder.name} {method:9} {verdict['verdict']:8} {'+'.join(verdict['named']) or '-'}{told}, "
            f"{time.monotonic() - began:.1f} s"
        )
    return lines


def one_patched(folder: Path, verdicts: Path, sealed: Path, twins: dict[str, str]) -> str | None:
    """Score what `hydro gap` wrote for a case on the same trials: elsewhere.json beside its verdict.

    twins: by the id of a case whose sensors do not show its state, that of one of the same motions whose sensors do.
    """
    smooth_s, place = Settings().smooth_s, verdicts / folder.name
    try:
        found, other = {}, twins.get(folder.name)
        for regime, paths in motion.kept_back(sealed, folder.name).items():
            twin = patched.twin(folder.with_name(other), sealed, regime) if other else None
            model, before, after, variance = patched.gap(folder, place / "verdict.json", smooth_s, paths, twin)
            found[regime] = case.compared(model, variance, before, after)
    except (BaselineError, OSError) as error:
        return f"{folder.name}: {error}"
    case.write(found, place, "elsewhere.json")
    return None
