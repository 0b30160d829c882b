"""One training's results, as `hydro evaluate --json` and `hydro simulate --json` tell them."""

import math
from dataclasses import dataclass
from pathlib import Path

from hydro_mujoco.errors import DataError
from hydro_mujoco.reading import read_json

#: Outputs that the paper's tables have: the wrench on the base.
BASE = 6
#: Figures of the closed loop, with the time after the start [s].
HORIZONS = (2.0, 4.0)
PEAKS = ("speed", "rate", "force", "torque")


@dataclass(frozen=True)
class Result:
    """A training: `open` as of `figures`, `closed` by quantity and horizon, `peaks` of ten minutes over the truth's."""

    row: str
    seed: int
    open: dict[str, float]
    closed: dict[str, float]
    peaks: list[float]


def figures(errors: dict) -> dict[str, float]:
    """Errors of the wrench on the base, and over all outputs.

    MAE and RMSE over all axes and samples as in the paper, N and N m together; nRMSE: root mean square over the axes.
    """
    mae, rmse, nrmse, without = (errors[key][:BASE] for key in ("mae", "rmse", "nrmse", "nrmse_hydrodynamic"))
    return {
        "mae": sum(mae) / BASE,
        "rmse": _rms(rmse),
        "nrmse": _rms(nrmse),
        "without": _rms(without),
        "all": errors["pooled"],
        "all_without": errors["pooled_hydrodynamic"],
    }


def read(place: Path) -> tuple[Result, dict[str, dict[str, float]]]:
    """The result in ROW/seed-N, and the figures of what was not learned, by name."""
    told, swum = (_json(place / name) for name in ("open.json", "closed.json"))
    try:
        unlearned = {row["name"]: figures(row) for row in told["yardsticks"]}
        loop = swum["closed_loop"]
        ours = loop["rows"][0]
        closed = {
            f"{what}.{horizon:g}": _number(ours[what][loop["horizons"].index(horizon)]["median"])
            for what in ("position", "attitude", "joints")
            for horizon in HORIZONS
        }
        subject = swum["long"]["subject"]
        peaks = [_number(subject[what]["reached"]) / subject[what]["truth"] for what in PEAKS]
        seed = int(place.name.removeprefix("seed-"))
        return Result(place.parent.name, seed, figures(told["errors"]), closed, peaks), unlearned
    except (KeyError, IndexError, ValueError, TypeError) as error:
        raise DataError(
            f"{place}: {error!r}; expected open.json and closed.json of `hydro evaluate` and `hydro simulate --long`"
        ) from error


def _number(value: float | None) -> float:
    """A number, or infinity where a run blew up, which JSON has no word for."""
    return math.inf if value is None else float(value)


def _rms(values: list[float]) -> float:
    return math.sqrt(sum(value * value for value in values) / len(values))


def _json(path: Path) -> dict:
    if not path.exists():
        raise DataError(f"{path}: no such file; scripts/strip_models.sh writes it")
    return read_json(path)
