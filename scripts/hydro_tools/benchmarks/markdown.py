"""Tables and numbers of the page."""

from .spread import Spread, ratio, spread

UNITS = {"us": 1e6, "ms": 1e3, "s": 1.0}


def table(head: list[str], rows: list[list[str]]) -> str:
    """The first column left, the others right."""
    rule = ["---"] + ["---:"] * (len(head) - 1)
    return "\n".join("| " + " | ".join(cells) + " |" for cells in [head, rule, *rows]) + "\n"


def digits(value: float) -> str:
    """Three significant digits, without an exponent where a number is of ordinary size."""
    if value == 0 or not 1e-3 <= abs(value) < 1e6:
        return f"{value:.2g}"
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"


def between(values: Spread) -> str:
    """Median and quartiles: `0.71 (0.70 to 0.73)`."""
    return f"{digits(values.median)} ({digits(values.low)} to {digits(values.high)})"


def mebibytes(count: int) -> str:
    """A number of bytes in MiB: `1,024`."""
    return f"{count / 2**20:,.0f}"


def named(outcomes: list[dict], name: str) -> dict | None:
    """The outcome of an implementation, where it took part."""
    return next((outcome for outcome in outcomes if outcome["name"] == name), None)


def timings(outcomes: list[dict], unit: str, references: dict[str, str], extra: dict | None = None) -> str:
    """One row for each implementation: time, ratios to the references (name -> head of the column), and more columns.

    extra: head -> function of an outcome.
    """
    extra = extra or {}
    rows = []
    for outcome in outcomes:
        cells = [outcome["name"], between(spread(outcome["seconds"]).scaled(UNITS[unit]))]
        for name in references:
            other = named(outcomes, name)
            same = other is None or other is outcome
            cells.append("" if same else between(ratio(outcome["seconds"], other["seconds"])))
        rows.append(cells + [show(outcome) for show in extra.values()])
    return table(["", f"{unit}, median (quartiles)", *references.values(), *extra], rows)
