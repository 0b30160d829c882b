"""Ranges that a trajectory is drawn from: those of Task 2, and others outside them for tests of a trained model.

Each other regime leaves the usual ranges in one respect and is the usual one in all else, with random numbers
of its own.
"""

import json
from dataclasses import asdict, dataclass, replace


@dataclass(frozen=True)
class Ranges:
    """Ranges that a regime may change. Triples are hip, thigh, calf."""

    #: Density of the water, one of these bands, in proportion to their widths [kg/m^3].
    density: tuple[tuple[float, float], ...]
    #: Initial linear velocity: standard deviation a component, smallest and largest norm [m/s].
    start_speed: float
    speed_norm: tuple[float, float]
    #: Initial angular velocity, likewise [rad/s].
    start_rate: float
    rate_norm: tuple[float, float]
    #: Pushes on the base: chance, standard deviation a component [N], [N m].
    push_share: float
    push_force: float
    push_torque: float
    #: Chance that the robot glides: it holds a posture.
    glide_share: float
    #: Cycles a second.
    frequency: tuple[float, float]
    #: Amplitude, smallest and largest; a leg's own is 0.8 to 1 of it [rad].
    amplitude: tuple[tuple[float, float, float], tuple[float, float, float]]
    #: Distance of the posture that all legs swing about from the centre, to either side, smallest and largest [rad].
    lean: tuple[tuple[float, float, float], tuple[float, float, float]]
    #: A leg's own distance from that posture, to either side, at most [rad].
    scatter: tuple[float, float, float]


@dataclass(frozen=True)
class Regime:
    """Ranges by name. `key` ends the key of each random stream, so regimes have none in common."""

    name: str
    key: tuple[int, ...]
    ranges: Ranges

    def recorded(self) -> dict:
        """Its fields in a manifest; none for the usual regime, whose manifests stay as they were."""
        return {} if self == USUAL else {"regime": self.name, "ranges": json.loads(json.dumps(asdict(self.ranges)))}


#: Task 2: fresh water to sea water, B1 as it swims.
USUAL = Regime(
    "usual",
    (),
    Ranges(
        density=((990.0, 1030.0),),
        start_speed=0.5,
        speed_norm=(0.0, 1.2),
        start_rate=0.8,
        rate_norm=(0.0, 2.5),
        push_share=0.35,
        push_force=50.0,
        push_torque=10.0,
        glide_share=0.1,
        frequency=(0.2, 1.5),
        amplitude=((0.0, 0.0, 0.0), (0.35, 0.6, 0.6)),
        lean=((0.0, 0.0, 0.0), (0.3, 0.5, 0.45)),
        scatter=(0.075, 0.125, 0.1125),
    ),
)
#: Thrown in, and pushed hard all the time.
SPEEDS = Regime(
    "speeds",
    (1,),
    replace(
        USUAL.ranges,
        start_speed=1.2,
        speed_norm=(1.3, 3.0),
        start_rate=2.0,
        rate_norm=(2.6, 5.0),
        push_share=1.0,
        push_force=400.0,
        push_torque=150.0,
    ),
)
#: Lighter than fresh water, as with bubbles in it, and heavier than the oceans.
DENSITIES = Regime("densities", (2,), replace(USUAL.ranges, density=((900.0, 960.0), (1060.0, 1150.0))))
#: Quicker and wider strokes. Postures differ where the limits leave room beside such strokes: at the thighs.
GAITS = Regime(
    "gaits",
    (3,),
    replace(
        USUAL.ranges,
        glide_share=0.0,
        frequency=(1.6, 2.6),
        amplitude=((0.44, 0.76, 0.76), (0.62, 0.95, 0.88)),
        lean=((0.0, 0.66, 0.0), (0.05, 0.9, 0.1)),
        scatter=(0.02, 0.03, 0.02),
    ),
)

REGIMES = {regime.name: regime for regime in (USUAL, SPEEDS, DENSITIES, GAITS)}
