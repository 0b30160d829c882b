"""MuJoCo's 25 fluid coefficients of B1, five a part: defaults and bounds.

A coefficient of MuJoCo's blunt drag is *half* a textbook's: its force is density * area * speed^2 * coefficient,
without the 1/2.
"""

import numpy as np
from mujoco.sysid import Parameter

from hydro_tools.robot.hull import FLUID_COEFFICIENTS

PARTS = tuple(FLUID_COEFFICIENTS)
#: In the order of `fluidcoef`.
KINDS = ("blunt", "slender", "angular", "Kutta", "Magnus")
DRAG, LIFT = ("blunt", "slender"), ("Kutta",)
NAMES = tuple(f"{part} {kind}" for part in PARTS for kind in KINDS)
#: [25]
DEFAULT = np.array([value for part in PARTS for value in FLUID_COEFFICIENTS[part]])
#: No coefficient may be negative, or larger than this: a plate's textbook drag coefficient is 2, half that here.
LARGEST = 3.0
#: The load cell's offset: names of its two components, and what is held possible [N].
OFFSETS, LARGEST_OFFSET = ("offset x", "offset y"), 5.0
#: Standard deviation of an offset before anything is measured [N]; the processing has taken the zeros off.
OFFSET_SD = 1.0


def kind(name: str) -> str:
    """Kind of a coefficient, by its name."""
    return name.split()[1]


def by_part(values: np.ndarray) -> dict[str, tuple[float, ...]]:
    """25 numbers as `fluidcoef` of each part."""
    return {part: tuple(float(v) for v in row) for part, row in zip(PARTS, np.reshape(values, (-1, len(KINDS))))}


def parameter(name: str, start: float, *, frozen: bool = False) -> Parameter:
    """A coefficient, or an offset, as a parameter of the toolbox."""
    low, high = (-LARGEST_OFFSET, LARGEST_OFFSET) if name in OFFSETS else (0.0, LARGEST)
    return Parameter(name, start, low, high, frozen=frozen)
