"""Fits of the measurements by SciPy alone: no MuJoCo, no code of `hydro`.

Output-error fits of one ODE of second order with free initial states,

    roll:  phi'' = -w^2 (phi + s phi^3) - b phi' - d |phi'| phi'    nominal: w, b within 3 %, s as said, d = 0
    ball:  h''   = -g - c |h'|^(p-1) h'                     p = 1 linear, p = 2 quadratic, c = 0 the nominal

least squares in the heights or angles. The noise is taken from the residual of the widest hypothesis (both
drags; for the decay a free s as well), the same for all that are compared: its variance, raised by
n / n_eff, n_eff = n (1 - r) / (1 + r) with r its lag-one autocorrelation, because what is left over (a lens, a
swing of the film, a moment not quite quadratic) is not white. The evidence is Laplace's.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from .trial import Trial

GRAVITY = 9.81  # m/s^2
# Every tenth sample of the decay: 25 a cycle hold all of it, and its steps of 0.005 deg no longer matter.
ROLL_STRIDE = 10
# Relative step of the differences.
DIFFERENCE = 1e-5
# The hypotheses on the decay, each within the next.
ROLL = ("nominal", "quadratic", "quadratic, s free")


@dataclass(frozen=True)
class Fit:
    """A fit: `value` with its standard error, the residual's RMS, and the Laplace log evidence."""

    value: float
    error: float
    rms: float
    log_evidence: float

    @property
    def ci95(self) -> tuple[float, float]:
        """The interval of 95 %."""
        return self.value - 1.96 * self.error, self.value + 1.96 * self.error


def _path(acceleration: Callable[[float, float], float], start: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Positions [n] at `time` from (position, velocity) `start`."""
    run = solve_ivp(
        lambda _, x: (x[1], acceleration(x[0], x[1])),
        (time[0], time[-1]),
        start,
        t_eval=time,
        method="DOP853",
        rtol=1e-10,
        atol=1e-10,
    )
    return run.y[0] if run.success else np.full(len(time), 1e3)


@dataclass(frozen=True)
class _Hypothesis:
    """rhs: from the shared parameters to the acceleration; first, prior: their means and standard deviations."""

    rhs: Callable[[np.ndarray], Callable[[float, float], float]]
    first: np.ndarray
    prior: np.ndarray


def _residuals(trials: list[Trial], sensor: str, hypothesis: _Hypothesis, x: np.ndarray) -> list[np.ndarray]:
    """Predicted less measured of every trial at x = (shared parameters, start of each trial)."""
    shared = len(hypothesis.first)
    return [
        _path(hypothesis.rhs(x[:shared]), x[shared + 2 * k : shared + 2 * k + 2], trial.time) - trial.sensors[sensor]
        for k, trial in enumerate(trials)
    ]


def _solve(trials: list[Trial], sensor: str, hypothesis: _Hypothesis, sigma: float):
    """The least-squares solution with noise `sigma` and the prior."""
    shared = len(hypothesis.first)
    starts = np.array([[trial.position, trial.velocity] for trial in trials]).ravel()

    def cost(x: np.ndarray) -> np.ndarray:
        pull = (x[:shared] - hypothesis.first) / hypothesis.prior
        return np.concatenate([np.concatenate(_residuals(trials, sensor, hypothesis, x)) / sigma, pull])

    # The integrator's own error, about 1e-10, must stay well below a difference.
    return least_squares(
        cost, np.concatenate([hypothesis.first, starts]), x_scale="jac", jac="3-point", diff_step=DIFFERENCE
    )


def _noise(trials: list[Trial], sensor: str, widest: _Hypothesis) -> float:
    """The standard deviation that a sample counts with, from what the widest hypothesis leaves."""
    sigma = 1e-3
    for _ in range(3):
        x = _solve(trials, sensor, widest, sigma).x
        parts = _residuals(trials, sensor, widest, x)
        flat = np.concatenate(parts)
        lag_one = sum(float(e[1:] @ e[:-1]) for e in parts) / float(flat @ flat)
        lag_one = min(max(lag_one, 0.0), 0.999)
        sigma = float(np.sqrt(flat @ flat / (len(flat) - len(x)) * (1 + lag_one) / (1 - lag_one)))
    return sigma


def _fit(trials: list[Trial], sensor: str, hypothesis: _Hypothesis, sigma: float, report: int | None) -> Fit:
    """Fit one hypothesis; report: the index of the parameter that is told, None where there is none."""
    solution = _solve(trials, sensor, hypothesis, sigma)
    hessian = solution.jac.T @ solution.jac
    flat = np.concatenate(_residuals(trials, sensor, hypothesis, solution.x))
    # The starts' priors are flat and the same for every hypothesis: they cancel in a difference.
    log_evidence = -solution.cost - float(np.sum(np.log(hypothesis.prior))) - 0.5 * np.linalg.slogdet(hessian)[1]
    value, error = 0.0, 0.0
    if report is not None:
        value, error = solution.x[report], np.sqrt(np.linalg.inv(hessian)[report, report])
    return Fit(float(value), float(error), float(np.sqrt(np.mean(flat**2))), float(log_evidence))


def roll(trial: Trial, inertia: float, stiffness: float, cubic: float, damping: float) -> dict[str, Fit]:
    """Fits without and with quadratic damping; its value in N m s^2/rad^2.

    inertia [kg m^2], stiffness [N m/rad], cubic [N m/rad^3], damping [N m s/rad]: of the nominal model.
    """
    trial = replace(
        trial,
        time=trial.time[::ROLL_STRIDE],
        sensors={name: values[::ROLL_STRIDE] for name, values in trial.sensors.items()},
    )
    # w, b, d, s. 3 % of stiffness and inertia each, and of the damping; a decay within a cycle or two for d.
    first = np.array([np.sqrt(stiffness / inertia), damping / inertia, 0.0, cubic / stiffness])
    prior = np.array([0.03 * first[0] / np.sqrt(2.0), 0.03 * first[1], 1.0, 1.0])

    def acceleration(x: np.ndarray) -> Callable:
        w, b, d, s = np.concatenate([x, first[len(x) :]])
        return lambda angle, rate: -(w**2) * (angle + s * angle**3) - b * rate - d * abs(rate) * rate

    hypotheses = [_Hypothesis(acceleration, first[:n], prior[:n]) for n in (2, 3, 4)]
    sigma = _noise([trial], "roll_angle", hypotheses[2])
    fits = {}
    for name, hypothesis, report in zip(ROLL, hypotheses, (None, 2, 2)):
        fit = _fit([trial], "roll_angle", hypothesis, sigma, report)
        fits[name] = replace(fit, value=fit.value * inertia, error=fit.error * inertia)
    return fits


def ball(trials: list[Trial]) -> dict[str, Fit]:
    """Fits without drag, with linear [1/s] and with quadratic drag [1/m], a unit of mass."""

    def hypothesis(*powers: int) -> _Hypothesis:
        def acceleration(x: np.ndarray) -> Callable:
            return lambda height, speed: -GRAVITY - sum(c * abs(speed) ** (p - 1) * speed for c, p in zip(x, powers))

        # A drag as large as the weight at 10 m/s: wide for any ball.
        return _Hypothesis(acceleration, np.zeros(len(powers)), np.array([GRAVITY / 10.0**p for p in powers]))

    sigma = _noise(trials, "height", hypothesis(1, 2))
    return {
        "none": _fit(trials, "height", hypothesis(), sigma, None),
        "linear": _fit(trials, "height", hypothesis(1), sigma, 0),
        "quadratic": _fit(trials, "height", hypothesis(2), sigma, 0),
    }
