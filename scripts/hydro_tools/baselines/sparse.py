"""Sparse regression: PySINDy's STLSQ, its ensemble, and the greedy evidence of BINDy."""

import warnings
from dataclasses import dataclass

import numpy as np

from .weak import Problem


@dataclass(frozen=True)
class Sparse:
    """Coefficients of the scaled columns [p] (zero: dropped), their standard errors, and each column's
    probability of being in.
    """

    coefficients: np.ndarray
    errors: np.ndarray
    inclusion: np.ndarray


def _errors(problem: Problem, kept: np.ndarray) -> np.ndarray:
    """Standard errors of least squares on the kept columns."""
    out = np.zeros(problem.design.shape[1])
    if kept.any():
        x = problem.design[:, kept]
        w = np.linalg.lstsq(x, problem.response, rcond=None)[0]
        rest = problem.response - x @ w
        variance = rest @ rest / max(len(rest) - kept.sum(), 1)
        out[kept] = np.sqrt(np.maximum(np.diag(np.linalg.pinv(x.T @ x)) * variance, 0))
    return out


def stlsq(problem: Problem, threshold: float, alpha: float) -> Sparse:
    """Sequentially thresholded ridge: `threshold` in RMS of a contribution, units of noise; `alpha` times rows."""
    import pysindy

    optimiser = pysindy.STLSQ(threshold=threshold, alpha=alpha * len(problem.response), max_iter=40)
    with warnings.catch_warnings():
        # "Sparsity parameter is too big" is an answer here: nothing is missing.
        warnings.simplefilter("ignore")
        optimiser.fit(problem.design, problem.response[:, None])
    w = np.asarray(optimiser.coef_).ravel()
    return Sparse(w, _errors(problem, w != 0), (w != 0).astype(float))


def ensemble(problem: Problem, threshold: float, alpha: float, inclusion: float, models: int = 30) -> Sparse:
    """Bagging of STLSQ over rows: the median of the models in which a column is in, where it is in often enough."""
    import pysindy

    # Seeded: a verdict must not depend on when it was asked for.
    np.random.seed(0)
    base = pysindy.STLSQ(threshold=threshold, alpha=alpha * len(problem.response), max_iter=40)
    optimiser = pysindy.EnsembleOptimizer(base, bagging=True, n_models=models)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        optimiser.fit(problem.design, problem.response[:, None])
    drawn = np.stack([np.asarray(w).ravel() for w in optimiser.coef_list])
    share = (drawn != 0).mean(0)
    kept = share >= inclusion
    masked = np.where(drawn != 0, drawn, np.nan)
    w = np.zeros(drawn.shape[1])
    if kept.any():
        w[kept] = np.nanmedian(masked[:, kept], axis=0)
    return Sparse(w, np.where(kept, drawn.std(0), 0.0), share)


def bindy(problem: Problem, prior: float, correlation: float) -> Sparse:
    """Greedy backward elimination by log evidence of the linear Gaussian model, column by column.

    L. Fung, U. Fasel, M. Juniper, "Rapid Bayesian identification of sparse nonlinear dynamics from scarce and noisy
    data", Proc. R. Soc. A 481 (2025). prior: standard deviation of a scaled coefficient; correlation: rows that
    count as one, for the overlap of the test functions. The noise is that of the full least-squares fit.
    """
    x, y = problem.design, problem.response
    m, p = x.shape
    full = np.linalg.lstsq(x, y, rcond=None)[0]
    variance = max(float(np.sum((y - x @ full) ** 2)) / max(m - p, 1), 1e-12) * correlation
    gram, cross = x.T @ x / variance, x.T @ y / variance

    def evidence(kept: list[int]) -> float:
        if not kept:
            return 0.0
        a = gram[np.ix_(kept, kept)] + np.eye(len(kept)) / prior**2
        low = np.linalg.cholesky(a)
        half = np.linalg.solve(low, cross[kept])
        return float(0.5 * half @ half - np.log(np.diag(low)).sum() - len(kept) * np.log(prior))

    kept = list(range(p))
    best, best_kept = evidence(kept), list(kept)
    while kept:
        # Removing column i of the inverse costs w_i^2 / C_ii in fit and gains its share of the determinant.
        a = np.linalg.inv(gram[np.ix_(kept, kept)] + np.eye(len(kept)) / prior**2)
        w = a @ cross[kept]
        change = -0.5 * w**2 / np.diag(a) - 0.5 * np.log(np.diag(a)) + np.log(prior)
        kept.pop(int(change.argmax()))
        now = evidence(kept)
        if now > best:
            best, best_kept = now, list(kept)
    w = np.zeros(p)
    errors = np.zeros(p)
    if best_kept:
        a = np.linalg.inv(gram[np.ix_(best_kept, best_kept)] + np.eye(len(best_kept)) / prior**2)
        w[best_kept], errors[best_kept] = a @ cross[best_kept], np.sqrt(np.diag(a))
    return Sparse(w, errors, (w != 0).astype(float))


def contributions(problem: Problem, sparse: Sparse) -> dict[str, float]:
    """RMS of what each effect explains, all its columns together, units of noise, the largest first."""
    out: dict[str, float] = {}
    for effect in {label.effect for label in problem.labels}:
        part = np.array([label.effect == effect for label in problem.labels]) & (sparse.coefficients != 0)
        if part.any():
            out[effect] = float(np.sqrt(np.mean((problem.design[:, part] @ sparse.coefficients[part]) ** 2)))
    return dict(sorted(out.items(), key=lambda item: -item[1]))


def named(strength: dict[str, float], least_share: float, most: int = 3) -> list[str]:
    """Effects that survive: at least `least_share` of the largest, at most three."""
    if not strength:
        return []
    top = max(strength.values())
    return [effect for effect, value in strength.items() if value >= least_share * top][:most]


def restricted(problem: Problem, effects: list[str]) -> Sparse:
    """Plain least squares on all columns of the named effects: the model that is rolled out."""
    kept = np.array([label.effect in effects for label in problem.labels], bool)
    w = np.zeros(problem.design.shape[1])
    if kept.any():
        x = problem.design[:, kept]
        # A little ridge: columns of one effect may coincide (a planar leg has no sway).
        w[kept] = np.linalg.solve(x.T @ x + 1e-4 * len(x) * np.eye(kept.sum()), x.T @ problem.response)
    return Sparse(w, _errors(problem, kept), kept.astype(float))
