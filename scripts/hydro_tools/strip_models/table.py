"""Rows over seeds, in Markdown."""

import math
import statistics

from scipy import stats

from .results import Result

OPEN = {"mae": "MAE", "rmse": "RMSE", "nrmse": "nRMSE", "without": "without buoyancy", "all": "nRMSE of all outputs"}
CLOSED = {
    "position.2": "position 2 s [m]",
    "position.4": "4 s",
    "attitude.2": "attitude 2 s [deg]",
    "attitude.4": "4 s",
    "joints.4": "joints 4 s [deg]",
}


def table(results: list[Result], unlearned: dict[str, dict[str, float]]) -> str:
    """Open loop, what was not learned first, then closed loop; ± is the standard deviation over seeds."""
    rows = list(dict.fromkeys(result.row for result in results))
    of = {row: [result for result in results if result.row == row] for row in rows}
    first = [["", "seeds", *OPEN.values()]]
    first += [[name, "", *(_digits(errors[key]) for key in OPEN)] for name, errors in unlearned.items()]
    first += [[row, str(len(of[row])), *(_spread([one.open[key] for one in of[row]]) for key in OPEN)] for row in rows]
    second = [["", *CLOSED.values(), "ten minutes: speed, rate, force, torque over the truth's"]]
    for row in rows:
        worst = [max(peaks) for peaks in zip(*(one.peaks for one in of[row]))]
        swum = (_spread([one.closed[key] for one in of[row]]) for key in CLOSED)
        second.append([row, *swum, ", ".join(_digits(peak) for peak in worst)])
    return _markdown(first) + "\n" + _markdown(second)


def ratios(results: list[Result], of: str) -> str:
    """nRMSE of all outputs and MAE of one row over those of every other.

    95 % intervals are over seeds, Welch's of the logarithms; none where a row has one seed.
    """
    others = [row for row in dict.fromkeys(result.row for result in results) if row != of]
    rows = [[f"{of} over", "nRMSE of all outputs", "MAE"]]
    for other in others:
        values = (
            [[math.log(result.open[key]) for result in results if result.row == row] for row in (of, other)]
            for key in ("all", "mae")
        )
        rows.append([other, *(_ratio(*pair) for pair in values)])
    return _markdown(rows)


def _ratio(one: list[float], other: list[float]) -> str:
    between = statistics.fmean(one) - statistics.fmean(other)
    if min(len(one), len(other)) < 2:
        return _digits(math.exp(between))
    low, high = stats.ttest_ind(one, other, equal_var=False).confidence_interval()
    return f"{math.exp(between):.3f} ({math.exp(low):.3f} to {math.exp(high):.3f})"


def _digits(value: float) -> str:
    return f"{value:.3g}"


def _spread(values: list[float]) -> str:
    mean = _digits(statistics.fmean(values))
    return (
        mean if len(values) < 2 or not all(map(math.isfinite, values)) else f"{mean} ± {statistics.stdev(values):.2g}"
    )


def _markdown(rows: list[list[str]]) -> str:
    rule = ["---"] + ["---:"] * (len(rows[0]) - 1)
    return "".join(f"| {' | '.join(cells)} |\n" for cells in [rows[0], rule, *rows[1:]])
