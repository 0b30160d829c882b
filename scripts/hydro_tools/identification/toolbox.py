"""One least-squares fit by `mujoco.sysid`: its optimiser, its intervals."""

import contextlib
import io
import logging
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from mujoco import sysid

from hydro_tools.datasets import DataError

#: Steps of the optimiser; the problem is nearly linear, it needs a few.
STEPS = 60


@dataclass(frozen=True)
class Solution:
    """values by name, frozen ones included; of the free ones: names, covariance, half-width of the 95 % interval."""

    values: dict[str, float]
    free: tuple[str, ...]
    covariance: np.ndarray
    half_width: np.ndarray
    residuals: np.ndarray
    jacobian: np.ndarray


def solve(parameters: list[sysid.Parameter], residual: Callable[[dict[str, float]], np.ndarray]) -> Solution:
    """Minimise the sum of squares of `residual`, whitened, a function of all values by name."""
    free = sysid.ParameterDict({parameter.name: parameter for parameter in parameters})

    def values(held: sysid.ParameterDict) -> dict[str, float]:
        return {name: float(parameter.value[0]) for name, parameter in held.items()}

    def residuals(x: np.ndarray, held: sysid.ParameterDict):
        # The optimiser asks for many points at once, a column each.
        columns = []
        for point in np.reshape(x, (free.size, -1)).T:
            held.update_from_vector(point)
            columns.append(residual(values(held)))
        stacked = np.stack(columns, axis=1)
        return [stacked if np.ndim(x) > 1 else stacked[:, 0]], None, None

    logging.getLogger("absl").setLevel(logging.ERROR)
    try:
        # The toolbox prints its progress whatever `verbose` says.
        with contextlib.redirect_stdout(io.StringIO()):
            best, result = sysid.optimize(free, residuals, optimizer="mujoco", verbose=False, max_iters=STEPS)
    except (ValueError, np.linalg.LinAlgError) as error:
        raise DataError(
            f"mujoco.sysid gave up on {', '.join(p.name for p in parameters if not p.frozen)}: {error}"
        ) from error
    star = residual(values(best))
    covariance, half_width = sysid.calculate_intervals([star], result.jac)
    names = tuple(name for name, parameter in best.items() if not parameter.frozen)
    return Solution(values(best), names, covariance, half_width, star, np.asarray(result.jac))
