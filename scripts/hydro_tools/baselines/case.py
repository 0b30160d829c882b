"""One case by one method: fit by cross-fit, held-out error, verdict in the contract's format."""

import json
import os
import time
from pathlib import Path

import mujoco
import numpy as np

from hydro_mujoco.reading import check, read_json

from . import BaselineError, motion, rollout, sparse, weak
from .settings import NAMING, SPARSE, Settings

SCHEMA = "hydro-gap-verdict/1"
BOOTSTRAPS = 1000
NO_GAP = {
    "metric": "nrmse",
    "before": None,
    "after": None,
    "reduction": None,
    "ci95": None,
    "n_holdout_trials": 0,
    "per_sensor": {},
}


class PreparedCase:
    """A case: model, motions, equations; built once and shared by the methods."""

    def __init__(self, folder: Path, smooth_s: float, trials: list[Path] | None = None):
        self.folder, self.xml = folder, folder / "nominal.xml"
        if not self.xml.exists():
            raise BaselineError(f"{folder} has no nominal.xml: a case is nominal.xml and trials/")
        check(self.xml)
        try:
            spec = mujoco.MjSpec.from_file(str(self.xml))
            for body in spec.bodies:
                # A body compiled as simple refuses a centre of mass that is a little off.
                body.simple = False
            self.model = spec.compile()
        except ValueError as error:
            raise BaselineError(f"{self.xml} does not load ({error})") from error
        if self.model.nplugin:
            raise BaselineError(
                f"{self.xml} has a water of the plugin, whose memory inverse dynamics cannot ask: "
                "no method on forces applies"
            )
        files = trials or motion.trials(folder)
        self.motions = [motion.load(path, self.model, smooth_s) for path in files]
        public = folder / "case.json"
        self.spread = read_json(public).get("uncertainty", {}) if public.is_file() else {}
        self.equations = weak.Equations(self.model)
        self.variance = rollout.variances(self.model, self.motions)
        self._before: rollout.Errors | None = None
        self._problems: dict[float, weak.Problem] = {}
        self._residuals: list[np.ndarray] | None = None

    def problem(self, test_s: float) -> weak.Problem:
        """The regression at a length of the test functions."""
        if test_s not in self._problems:
            self._problems[test_s] = weak.problem(self.equations, self.motions, self.spread, test_s)
        return self._problems[test_s]

    def residuals(self) -> list[np.ndarray]:
        """Row by row, of every motion."""
        if self._residuals is None:
            self._residuals = [self.equations.residual(m) for m in self.motions]
        return self._residuals

    def before(self) -> rollout.Errors:
        """Errors of the nominal."""
        if self._before is None:
            self._before = rollout.errors(self.model, self.motions, None)
        return self._before

    def folds(self, count: int) -> list[list[int]]:
        """Held-out trials of each fold; over all every trial is held out once."""
        order = np.random.default_rng(0).permutation(len(self.motions))
        return [sorted(int(i) for i in part) for part in np.array_split(order, min(count, len(order)))]


def select(problem: weak.Problem, method: str, options: dict) -> tuple[sparse.Sparse, list[str]]:
    """(what survives, effects named) of a sparse method."""
    settings = {name: value for name, value in options.items() if name != "least_share"}
    found = getattr(sparse, method)(problem, **settings)
    return found, sparse.named(sparse.contributions(problem, found), options["least_share"])


def fitted(prepared: PreparedCase, method: str, settings: Settings, train: list[int]):
    """(model, forcing, effects named, what tells of their parameters or None) from the training trials."""
    if method in SPARSE:
        problem = prepared.problem(settings.test_s).with_trials(set(train))
        _, effects = select(problem, method, settings.options)
        refit = sparse.restricted(problem, effects)
        forcing = rollout.SparseForcing(prepared.equations, problem, refit, prepared.spread)
        return forcing.model(), forcing if effects else None, effects, (problem, refit)
    motions = [prepared.motions[i] for i in train]
    if method == "network":
        from .network import Network

        options = settings.options
        net = Network(prepared.equations, options["hidden"], options["alpha"], options["smooth_s"])
        residuals = prepared.residuals()
        return prepared.model, net.fit(motions, [residuals[i] for i in train]), [], None
    if method == "sysid_bic":
        from . import structures

        chosen = structures.choose(str(prepared.xml), prepared.model, motions, prepared.spread, **settings.options)
        return chosen.model, None, sorted({of.effect for of in chosen.structures}), chosen.structures
    from . import identification

    return identification.fit(str(prepared.xml), prepared.model, motions, **settings.options), None, [], None


def run(prepared: PreparedCase, method: str, settings: Settings, elsewhere: dict[str, list[Path]]) -> dict:
    """The verdict of a method on a case. `elsewhere`: trials by regime that are scored and never fitted."""
    if not settings.folds and not elsewhere:
        raise BaselineError(f"{method} has no cross-fit and is scored on trials kept back alone: give --sealed")
    began = time.monotonic()
    everything = list(range(len(prepared.motions)))
    model, forcing, effects, extra = (
        fitted(prepared, method, settings, everything) if method in SPARSE or elsewhere else (None, None, [], None)
    )
    gap = dict(NO_GAP)
    if settings.folds > 1 and len(everything) > 1:
        before, after = (
            prepared.before(),
            rollout.Errors(np.zeros_like(prepared.before().squared), prepared.before().count),
        )
        for held in prepared.folds(settings.folds):
            fold_model, fold_forcing, _, _ = fitted(
                prepared, method, settings, [i for i in everything if i not in held]
            )
            after.squared[held] = rollout.errors(fold_model, [prepared.motions[i] for i in held], fold_forcing).squared
        gap = compared(prepared.model, prepared.variance, before, after)
    verified = bool(gap["ci95"] and gap["ci95"][0] > 0)
    verdict = _verdict(
        method,
        ("named" if effects else "no_gap") if method in NAMING else "unknown",
        gap,
        verified,
        None if verified else "the held-out error does not fall with 95 % confidence",
    )
    verdict["named"] = effects
    if method in SPARSE:
        verdict["effects"] = _effects(effects, *extra)
    elif extra:
        verdict["effects"] = [_effect(of.effect, of.target, []) for of in extra]
    verdict["elsewhere"] = {}
    for regime, paths in elsewhere.items():
        logs = [motion.load(path, prepared.model, settings.smooth_s) for path in paths]
        verdict["elsewhere"][regime] = compared(
            prepared.model,
            prepared.variance,
            rollout.errors(prepared.model, logs, None),
            rollout.errors(model, logs, forcing),
        )
    verdict["seconds"] = time.monotonic() - began
    return verdict


def _verdict(method: str, outcome: str, gap: dict, verified: bool, refused: str | None) -> dict:
    """The contract's keys, and two more: the method and whether it can name at all."""
    return {
        "schema": SCHEMA,
        "verdict": outcome,
        "named": [],
        "effects": [],
        "confusion_set": [],
        "next_experiment": None,
        "where": [],
        "regime": [],
        "gap": gap,
        "verified": verified,
        "refused_because": refused,
        "patch": None,
        "method": method,
        "names": method in NAMING,
    }


def impossible(method: str, why: str) -> dict:
    """The verdict where a method cannot take a case."""
    return _verdict(method, "unknown", dict(NO_GAP), False, why)


def compared(model: mujoco.MjModel, variance: np.ndarray, before: rollout.Errors, after: rollout.Errors) -> dict:
    """The contract's `gap`, with a bootstrap over trials."""

    def both(chosen=None):
        return (rollout.nrmse(model, errors, variance, chosen) for errors in (before, after))

    def reduction(a: float, b: float) -> float:
        return 1 - b / a if a > 0 else 0.0

    one, two = both()
    rng = np.random.default_rng(0)
    count = len(before.squared)
    drawn: dict[str, list[float]] = {name: [] for name in one}
    for _ in range(BOOTSTRAPS):
        a, b = both(rng.integers(0, count, count))
        for name in drawn:
            drawn[name].append(reduction(a.get(name, 0.0), b.get(name, 0.0)))
    interval = {name: [float(x) for x in np.quantile(values, [0.025, 0.975])] for name, values in drawn.items()}
    sensors = {
        name: {
            "before": one[name],
            "after": two[name],
            "reduction": reduction(one[name], two[name]),
            "ci95": interval[name],
        }
        for name in one
        if name
    }
    return {
        "metric": "nrmse",
        "before": one[""],
        "after": two[""],
        "reduction": reduction(one[""], two[""]),
        "ci95": interval[""],
        "n_holdout_trials": count,
        "per_sensor": sensors,
    }


def _effects(named: list[str], problem: weak.Problem, refit: sparse.Sparse) -> list[dict]:
    """The contract's `effects`. No method here has a probability: what survived has 1."""
    out = []
    for effect in named:
        by_target: dict[str, list] = {}
        for label, w, error, size in zip(problem.labels, refit.coefficients, refit.errors, problem.size):
            if label.effect == effect and w != 0:
                low, high = (w - 1.96 * error) / size, (w + 1.96 * error) / size
                by_target.setdefault(label.target, []).append(
                    {
                        "name": label.parameter,
                        "value": float(w / size),
                        "unit": label.unit,
                        "ci95": [float(low), float(high)],
                    }
                )
        out += [_effect(effect, target, parameters) for target, parameters in by_target.items()]
    return out


def _effect(effect: str, target: str, parameters: list[dict]) -> dict:
    return {"effect": effect, "target": target, "probability": 1.0, "surrogate": False, "parameters": parameters}


def write(found: dict, folder: Path, name: str = "verdict.json") -> None:
    """Write a file whole or not at all."""
    folder.mkdir(parents=True, exist_ok=True)
    part = folder / f".{name}.tmp"
    part.write_text(json.dumps(found, indent=1))
    os.replace(part, folder / name)
