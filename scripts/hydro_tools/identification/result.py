"""Results of a study, for machines: `report.json`, and the coefficients as `identified.json`."""

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from hydro_mujoco.reading import read_json
from hydro_mujoco.recording.files import sha256
from hydro_tools.datasets import VERSION, DataError
from hydro_tools.robot import identified
from hydro_tools.tank import conditions
from hydro_tools.tank.campaign import SCHEMA as TOWING_SCHEMA

from .coefficients import DEFAULT, KINDS, LARGEST, NAMES, OFFSETS, by_part
from .fit import LEVELS, Prior
from .scores import AXES, scores
from .study import DECIMALS, Study
from .water import NOMINAL

SCHEMA = "hydro-real-to-sim/1"
#: Models whose errors are compared, with what they are for people.
MODELS = {"default": "defaults by judgement", "density": "density scale alone", "identified": "identified"}


@dataclass(frozen=True)
class Source:
    """Origin of the tows, and the command that fitted them."""

    command: str
    table: Path
    seed: int
    share: float

    def record(self) -> dict:
        """Fingerprints of the table and of the campaign's manifest, and what fitted them."""
        found = {
            "command": self.command,
            "generator": f"real_to_sim.py {VERSION}",
            "mujoco": mujoco.__version__,
            "seed": self.seed,
            "holdout": self.share,
            "table": self.table.name,
            "table_sha256": sha256(self.table),
        }
        manifest = self.table.with_name("manifest.json")
        if manifest.is_file():
            try:
                held = read_json(manifest)
            except DataError:
                held = None
            if isinstance(held, dict) and held.get("schema") == TOWING_SCHEMA:
                found |= {
                    "towing": held.get("generator"),
                    "towing_seed": held.get("seed"),
                    "manifest_sha256": sha256(manifest),
                }
        return found


def coefficients(study: Study) -> dict:
    """`identified.json` without its source."""
    return {
        "schema": identified.SCHEMA,
        "coefficients": {part: list(values) for part, values in by_part(study.fit.coefficients).items()},
    }


def _prior(prior: Prior) -> str:
    centre = "default times level" if prior.levelled else "default"
    return f"{centre}, {100 * prior.relative:g} %"


def _free(study: Study) -> list[dict]:
    """Every acting coefficient and offset: value, both intervals, prior, how much the data say.

    Identified: the data outweigh the prior, no interval ends at a bound, and the value stays in both intervals under
    every other prior.
    """
    fit, analysis = study.fit, study.analysis
    low, high = np.percentile(study.replicates, (2.5, 97.5), axis=0)
    after = dict(zip(NAMES, fit.coefficients)) | dict(zip(OFFSETS, fit.offsets))
    default = dict(zip(NAMES, DEFAULT))
    rows = []
    for i, name in enumerate(fit.solution.free):
        value, half = float(after[name]), float(fit.solution.half_width[i])
        least, most = (-np.inf, np.inf) if name in OFFSETS else (0.0, LARGEST)
        row = {
            "name": name,
            "unit": "N" if name in OFFSETS else "1",
            "default": float(default.get(name, 0.0)),
            "value": value,
            "ci95": [max(value - half, least), min(value + half, most)],
            "ci95_blocks": [float(low[i]), float(high[i])],
            "prior": {"centre": float(fit.centre[i]), "sd": float(fit.spread[i])},
            "sd_after_over_before": analysis.kept[name],
            "outweighs": analysis.outweighs(name),
        }
        elsewhere = [found.solution.values[name] for _, found, _ in study.others]
        row |= {"other_priors": [min(elsewhere), max(elsewhere)]}
        inside = (
            least < min(row["ci95"][0], row["ci95_blocks"][0]) and max(row["ci95"][1], row["ci95_blocks"][1]) < most
        )
        row |= {
            "identified": row["outweighs"]
            and inside
            and min(row["ci95"][0], row["ci95_blocks"][0]) <= min(elsewhere)
            and max(elsewhere) <= max(row["ci95"][1], row["ci95_blocks"][1])
        }
        if name in analysis.alike:
            other, cosine = analysis.alike[name]
            row |= {"unseen": analysis.unseen[name], "alike": {"name": other, "cosine": cosine}}
        rows.append(row)
    return rows


def _left_out(study: Study, spread: np.ndarray) -> list[dict]:
    rows = []
    for number in np.unique(study.tows.configuration):
        chosen = study.tows.configuration == number
        gap, force = study.left_out[chosen] - study.tows.force[chosen], study.tows.force[chosen]
        square = (gap**2).mean(axis=0)
        stance = conditions.Condition(int(study.tows.condition[chosen][0])).stance
        rows.append(
            {
                "configuration": int(number),
                "thigh": stance.thigh,
                "calf": stance.calf,
                "rmse": dict(zip((*AXES, "pooled"), [*np.sqrt(square).tolist(), float(np.sqrt(square.mean()))])),
                "nrmse": float(np.sqrt(square.mean() / (spread**2).mean())),
                "relative": float((np.linalg.norm(gap, axis=1) / np.linalg.norm(force, axis=1)).mean()),
                "coefficients": dict(zip(NAMES, study.left_out_coefficients[int(number)].tolist())),
            }
        )
    return rows


def _unexplained(study: Study) -> list[dict]:
    """Mean residual (measured less identified) by direction and speed, and its spread over configurations."""
    tows, gap = study.tows, study.tows.force - study.predicted["identified"]
    rows = []
    for direction in conditions.DIRECTIONS:
        for speed in conditions.SPEEDS:
            chosen = (tows.direction == direction) & (tows.speed == speed)
            if chosen.any():
                rows.append(
                    {
                        "direction": direction,
                        "speed": speed,
                        "measured": tows.force[chosen].mean(axis=0).tolist(),
                        "residual": gap[chosen].mean(axis=0).tolist(),
                        "spread": gap[chosen].std(axis=0).tolist(),
                        "error": tows.error[chosen].mean(axis=0).tolist(),
                    }
                )
    return rows


def report(study: Study, source: Source) -> dict:
    """Everything, as JSON."""
    tows, held, fit = study.tows, study.held, study.fit
    spread = tows.force.std(axis=0)
    sets = {"fitted": ~held, "held_out": held}

    def errors(predicted: np.ndarray) -> dict:
        return {name: scores(tows.take(rows), predicted[rows], spread, source.seed) for name, rows in sets.items()}

    analysis = study.analysis
    others = [
        {
            "prior": _prior(prior),
            "share_of_form": found.share,
            "rmse_held_out": float(np.sqrt(((predicted - tows.force)[held] ** 2).mean())),
            "coefficients": dict(zip(NAMES, found.coefficients.tolist())),
        }
        for prior, found, predicted in [(study.prior, fit, study.predicted["identified"]), *study.others]
    ]
    return {
        "schema": SCHEMA,
        "from": source.record(),
        "nominal": NOMINAL,
        "frame": "base",
        "tows": {
            "count": len(tows),
            "held_out": int(held.sum()),
            "configurations": len(np.unique(tows.configuration)),
            "held_out_conditions": sorted(set(tows.condition[held].tolist())),
            "force_sd": dict(zip(AXES, spread.tolist())),
        },
        "errors": {name: errors(study.predicted[name]) for name in MODELS},
        "left_out_configuration": {
            "all": scores(tows, study.left_out, spread, source.seed),
            "each": _left_out(study, spread),
        },
        "levels": dict(zip(LEVELS, fit.levels)) | {"density scale": study.density},
        "share_of_form": fit.share,
        "reduced_chi_square": float(
            (fit.solution.residuals @ fit.solution.residuals) / (len(fit.solution.residuals) - len(fit.solution.free))
        ),
        "coefficients": _free(study),
        "density_scale": {"value": 1.0, "identified": False, "not_made_up_by_coefficients": analysis.density},
        "without_force": [
            {"name": name, "value": float(DEFAULT[NAMES.index(name)]), "reason": reason}
            for name, reason in analysis.silent.items()
        ],
        "combinations": [{"strength": strength, "of": members} for strength, members in analysis.strengths],
        "relations": analysis.relations,
        "priors": others,
        "unexplained": _unexplained(study),
        "decimals": DECIMALS,
        "kinds": list(KINDS),
        "predictions": {
            "condition": tows.condition.tolist(),
            "held_out": held.tolist(),
            "measured": tows.force.tolist(),
            "error": tows.error.tolist(),
            "left_out_configuration": np.round(study.left_out, 6).tolist(),
        }
        | {name: np.round(study.predicted[name], 6).tolist() for name in MODELS},
    }
