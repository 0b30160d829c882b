"""Errors by row and rate, in Markdown."""

import math


def table(data: str, chosen: dict[str, float], found: dict[tuple[str, str, float, int], float]) -> str:
    """Errors of one data set, seed 0 and, where it was tried, seed 1."""
    known = {key: error for key, error in found.items() if key[0] == data}
    rates = sorted({rate for _, _, rate, _ in known})
    lines = [
        f"On {data}:",
        "",
        "| | " + " | ".join(f"{rate:g}" for rate in rates) + " |",
        "|---|" + "---|" * len(rates),
    ]
    for row, own in chosen.items():
        cells = []
        for rate in rates:
            errors = [known[data, row, rate, seed] for seed in (0, 1) if (data, row, rate, seed) in known]
            words = ", ".join(f"{error:.3f}" if math.isfinite(error) else "diverged" for error in errors)
            cells.append(f"**{words}**" if rate == own else words)
        lines.append(f"| {row} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"
