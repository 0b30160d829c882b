"""The fit: levels of drag and lift, then every coefficient under a prior.

1. Levels. One factor on all drag coefficients (blunt, slender) and one on all lift coefficients (Kutta), with the
   cell's offsets. The density scale would be the two in one, and cannot be told from them.
2. Coefficients. Each under a prior: its default times its level, give or take PRIOR of that. Straight tows see a few
   combinations of coefficients; what they do not see stays where the prior has it, in proportion to the rest.

Coefficients without any force in a straight tow are frozen at their defaults. Both stages are `mujoco.sysid`'s; the
share of the model's form in the uncertainty (see `uncertainty`) is found between fits.
"""

from dataclasses import dataclass, field

import numpy as np

from . import uncertainty
from .coefficients import DEFAULT, DRAG, LARGEST, LIFT, NAMES, OFFSET_SD, OFFSETS, kind, parameter
from .measurements import Measurements
from .toolbox import Solution, solve
from .water import Water

#: Standard deviation of a coefficient before the tows, relative to default times level.
PRIOR = 0.5
#: A coefficient acts if, at one, it exerts this somewhere [N].
ACTS = 1e-3
#: Rounds that find the share of the model's form, and the change of it that no longer matters.
ROUNDS, SETTLED = 20, 0.005
LEVELS, DENSITY = ("drag level", "lift level"), "density scale"


@dataclass(frozen=True)
class Prior:
    """relative: of the standard deviation; levelled: whether defaults are first scaled to the data's level."""

    relative: float = PRIOR
    levelled: bool = True


@dataclass(frozen=True)
class Tank:
    """Tows, MuJoCo's water for them, and each coefficient's force at one (`Water.columns`)."""

    tows: Measurements
    water: Water = field(repr=False)
    columns: np.ndarray = field(repr=False)
    rest: np.ndarray = field(repr=False)

    @staticmethod
    def from_tows(tows: Measurements) -> "Tank":
        """With MuJoCo's water."""
        water = Water(tows)
        return Tank(tows, water, water.columns(), water.rest())

    @property
    def acting(self) -> np.ndarray:
        """Which coefficients exert a force in any tow [25] bool."""
        return np.abs(self.columns).max(axis=(0, 1)) > ACTS

    def take(self, rows: np.ndarray) -> "Tank":
        """Some of the tows."""
        return Tank.from_tows(self.tows.take(rows))


@dataclass(frozen=True)
class Fit:
    """coefficients [25]; offsets [2] N; levels (drag, lift); share of the form's error; sd [N,2] N of the fitted tows;
    centre and spread of the prior of the acting coefficients and offsets; the toolbox's solution.
    """

    coefficients: np.ndarray
    offsets: np.ndarray
    levels: tuple[float, float]
    share: float
    sd: np.ndarray
    centre: np.ndarray
    spread: np.ndarray
    solution: Solution

    def predict(self, water: Water) -> np.ndarray:
        """Predicted readings of the cell [N,2] N: MuJoCo's force and the offsets."""
        return water.force(self.coefficients) + self.offsets


def level_factors(drag: float, lift: float) -> np.ndarray:
    """Factor on each default [25]; one where no level applies."""
    factor = {**dict.fromkeys(DRAG, drag), **dict.fromkeys(LIFT, lift)}
    return np.array([factor.get(kind(name), 1.0) for name in NAMES])


def _offsets(values: dict[str, float]) -> np.ndarray:
    return np.array([values[name] for name in OFFSETS])


def _starting_offsets() -> list:
    return [parameter(name, 0.0) for name in OFFSETS]


def density_scale(tank: Tank, sd: np.ndarray) -> tuple[float, np.ndarray]:
    """The best factor on the water's density with all coefficients at their defaults, and the offsets [2] N."""

    def residual(values):
        force = tank.water.force(DEFAULT, values[DENSITY]) + _offsets(values)
        return ((force - tank.tows.force) / sd).ravel()

    found = solve([parameter(DENSITY, 1.0), *_starting_offsets()], residual).values
    return found[DENSITY], _offsets(found)


def levels(tank: Tank, sd: np.ndarray) -> tuple[float, float]:
    """The best factors on drag and on lift coefficients."""

    def residual(values):
        force = tank.water.force(DEFAULT * level_factors(*(values[name] for name in LEVELS))) + _offsets(values)
        return ((force - tank.tows.force) / sd).ravel()

    found = solve([parameter(name, 1.0) for name in LEVELS] + _starting_offsets(), residual).values
    return tuple(found[name] for name in LEVELS)


def _coefficients(tank: Tank, sd: np.ndarray, centre: np.ndarray, spread: np.ndarray) -> Solution:
    acting = tank.acting
    free = [*np.array(NAMES)[acting], *OFFSETS]

    def residual(values):
        force = tank.water.force(np.array([values[name] for name in NAMES])) + _offsets(values)
        prior = (np.array([values[name] for name in free]) - centre) / spread
        return np.concatenate((((force - tank.tows.force) / sd).ravel(), prior))

    start = dict(zip(free, centre))
    return solve(
        [parameter(name, start.get(name, default), frozen=name not in start) for name, default in zip(NAMES, DEFAULT)]
        + _starting_offsets(),
        residual,
    )


def effective(tank: Tank, sd: np.ndarray, spread: np.ndarray) -> float:
    """Number of parameters that the data decide rather than the prior."""
    seen = np.linalg.svd(whitened(tank, sd) * spread, compute_uv=False) ** 2
    return float((seen / (1.0 + seen)).sum())


def whitened(tank: Tank, sd: np.ndarray) -> np.ndarray:
    """Derivative of the whitened forces after the acting coefficients and the offsets, [2 N, k]."""
    force = np.concatenate(
        (tank.columns[..., tank.acting], np.broadcast_to(np.eye(2), (len(tank.tows), 2, 2))), axis=-1
    )
    return (force / sd[..., None]).reshape(2 * len(tank.tows), -1)


def identify(tank: Tank, prior: Prior = Prior()) -> Fit:
    """Fit the coefficients to all tows of `tank`."""
    acting, scale = tank.acting, uncertainty.typical(tank.tows)
    share = 0.2
    for _ in range(ROUNDS):
        sd = np.sqrt(tank.tows.error**2 + (share * scale) ** 2)
        found = levels(tank, sd) if prior.levelled else (1.0, 1.0)
        # A level at its bound of zero would leave its coefficients no room.
        factors = level_factors(*(max(level, 0.01) for level in found))
        centre = np.concatenate((np.clip(DEFAULT * factors, 0.0, LARGEST)[acting], (0.0, 0.0)))
        spread = np.concatenate((prior.relative * (DEFAULT * factors)[acting], (OFFSET_SD, OFFSET_SD)))
        solution = _coefficients(tank, sd, centre, spread)
        coefficients = np.array([solution.values[name] for name in NAMES])
        gap = tank.water.force(coefficients) + _offsets(solution.values) - tank.tows.force
        former, share = share, uncertainty.share(gap, tank.tows.error, scale, gap.size - effective(tank, sd, spread))
        if abs(share - former) <= SETTLED * max(former, 1e-3):
            break
    return Fit(coefficients, _offsets(solution.values), found, former, sd, centre, spread, solution)
