"""The 192 towing conditions: 16 leg configurations x 4 speeds x 3 directions.

All four legs stand alike, hips at zero: the features hold one thigh and one calf angle. The paper
gives neither the angles nor their number an axis; here they are a 4 x 4 grid well inside the limits.
Conditions count directions fastest, then speeds, then calf, then thigh angles.
"""

from dataclasses import dataclass

import numpy as np

from hydro_tools.robot import table

#: Tow speeds [m/s], and directions in the base frame by name.
SPEEDS = (0.2, 0.3, 0.4, 0.5)
DIRECTIONS = {"x": (1.0, 0.0), "y": (0.0, 1.0), "xy": (np.sqrt(0.5), np.sqrt(0.5))}
#: Angles of the thigh and calf joints [rad].
THIGHS = (0.0, 0.5, 1.0, 1.5)
CALVES = (-2.4, -1.85, -1.3, -0.75)

CONFIGURATIONS = len(THIGHS) * len(CALVES)
RUNS = CONFIGURATIONS * len(SPEEDS)
COUNT = RUNS * len(DIRECTIONS)


@dataclass(frozen=True)
class Stance:
    """A posture and the direction in which it is towed: thigh, calf [rad], name of the direction."""

    thigh: float
    calf: float
    direction: str

    @property
    def unit(self) -> np.ndarray:
        """The direction [3], base frame."""
        return np.array([*DIRECTIONS[self.direction], 0.0])


@dataclass(frozen=True)
class Condition:
    """Condition number `index`, 0 to 191."""

    index: int

    def __post_init__(self):
        if not 0 <= self.index < COUNT:
            raise ValueError(f"condition {self.index}: expected 0 to {COUNT - 1}")

    @property
    def run(self) -> int:
        """The run of the tank in which it is towed: one configuration and speed, three directions."""
        return self.index // len(DIRECTIONS)

    @property
    def configuration(self) -> int:
        """Leg configuration, 0 to 15."""
        return self.run // len(SPEEDS)

    @property
    def speed(self) -> float:
        """[m/s]"""
        return SPEEDS[self.run % len(SPEEDS)]

    @property
    def stance(self) -> Stance:
        """Posture and direction."""
        thigh, calf = divmod(self.configuration, len(CALVES))
        return Stance(THIGHS[thigh], CALVES[calf], tuple(DIRECTIONS)[self.index % len(DIRECTIONS)])

    @property
    def features(self) -> np.ndarray:
        """thigh, calf [rad], velocity x, y [m/s]: what a force model is told, [4]."""
        stance = self.stance
        return np.array([stance.thigh, stance.calf, *(self.speed * stance.unit[:2])])


def of_run(run: int) -> tuple[Condition, ...]:
    """The conditions of a run, in the order in which they are towed."""
    return tuple(Condition(run * len(DIRECTIONS) + i) for i in range(len(DIRECTIONS)))


def _inside_limits() -> None:
    limits = {link.name: (link.lower, link.upper) for link in table.moving_links()}
    for name, angles in (("FR_thigh", THIGHS), ("FR_calf", CALVES)):
        low, high = limits[name]
        if not all(low < angle < high for angle in angles):
            raise ValueError(f"{name}: angles {angles} rad are not inside its limits {low} to {high} rad")


_inside_limits()
