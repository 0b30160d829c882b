"""The log of a training."""

import json
import math
from dataclasses import dataclass
from pathlib import Path

from hydro_mujoco.errors import DataError
from hydro_mujoco.reading import read_text

LOG = "log.jsonl"
#: Fields of a line that are read; the others are left.
FIELDS = ("epoch", "step", "learning_rate", "loss", "validation", "validation_hydrodynamic")


@dataclass(frozen=True)
class Curve:
    """A training, pass by pass; `validation` is the pooled nRMSE on the validation split."""

    name: str
    rows: list[dict]

    @property
    def validation(self) -> list[float]:
        """Validation error after each pass."""
        return [row["validation"] for row in self.rows]

    @property
    def best(self) -> float:
        """The least of them."""
        return min(self.validation)

    @property
    def gained(self) -> float:
        """Share by which the last quarter of the passes lowered the least error before it; 0 of a single pass."""
        before = self.validation[: len(self.rows) - max(1, len(self.rows) // 4)]
        return max(0.0, 1.0 - self.best / min(before)) if before else 0.0


def read(run: Path) -> Curve:
    """The curve of a folder of `hydro train`, named as the training (`out/ours.run` is `ours`).

    Those of `hydro compare` and strip_models.sh, ROW/seed-N/run, are `ROW/seed-N`.
    """
    path = run / LOG
    if not path.exists():
        raise DataError(f"{run}: no {LOG}; expected the folder NAME.run that `hydro train --out NAME` makes")
    rows = []
    for number, line in enumerate(read_text(path).splitlines(), 1):
        try:
            row = json.loads(line)
            rows.append({field: row[field] for field in FIELDS})
        except (ValueError, KeyError, TypeError) as error:
            raise DataError(f"{path}, line {number}: {error}; expected an object with {', '.join(FIELDS)}") from error
        if rows[-1]["validation"] is None:
            raise DataError(
                f"{path}, line {number}: no validation error: the val split was empty, or the error no number"
            )
        if not all(isinstance(value, int | float) and math.isfinite(value) for value in rows[-1].values()):
            raise DataError(f"{path}, line {number}: {rows[-1]}; expected finite numbers")
    if not rows:
        raise DataError(f"{path}: empty; no pass of this training is done yet")
    place = run.resolve()
    seeded = place.parent.name.startswith("seed-")
    name = "/".join(place.parts[-3:-1]) if seeded else place.name.removesuffix(".run")
    return Curve(name, rows)
