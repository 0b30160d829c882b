"""The wetted hull: one ellipsoid a link (two on the calf, with its foot), each of exactly the volume it displaces.

Leg volumes and boxes were measured on the collision meshes of the description named in `table`:
hip 1.014 L, thigh 2.487 L, calf 0.470 L, foot a sphere of radius 4 cm (0.268 L); 16.96 L for four
legs. The trunk's hull is the unknown of the description: it takes what remains of
`displaced_litres`, on the length between the head and tail cameras.
"""

from dataclasses import dataclass
from math import pi, sqrt

from . import table

#: Range of the displaced volume that the description allows [L]: box trunk ... full-length trunk.
DISPLACED_LITRES_RANGE = (46.0, 60.0)
#: Default: B1 (62.58 kg) is slightly heavier than the water it displaces, so it sinks slowly.
DISPLACED_LITRES = 58.0
#: Height of the trunk hull's centre above the link's origin [m]: buoyancy rights the robot gently.
TRUNK_RISE = 0.05
#: Head camera and tail camera, ends of the trunk [m].
TRUNK_ENDS = (-0.459, 0.489)
#: Width over height of the trunk's hull.
TRUNK_ASPECT = 1.25

#: MuJoCo's fluidcoef: blunt drag, slender drag, angular drag, Kutta lift, Magnus lift.
#: Defaults by judgement, not identified: bluff cross-flow drag near 1 on cylinder-like legs,
#: a streamlined-box trunk, MuJoCo's own angular coefficient, half of the potential-flow lift
#: (bluff bodies stall), no Magnus lift (no link spins).
FLUID_COEFFICIENTS = {
    "trunk": (0.8, 0.25, 1.5, 0.5, 0.0),
    "hip": (0.8, 0.25, 1.5, 0.5, 0.0),
    "thigh": (1.1, 0.25, 1.5, 0.5, 0.0),
    "calf": (1.1, 0.25, 1.5, 0.5, 0.0),
    "foot": (0.5, 0.25, 1.5, 0.0, 0.0),
}


@dataclass(frozen=True)
class Hull:
    """An ellipsoid of `body`: centre and semi-axes in the body's frame [m]."""

    name: str
    body: str
    part: str
    centre: tuple[float, float, float]
    semi_axes: tuple[float, float, float]

    @property
    def volume(self) -> float:
        """Displaced volume [m^3]."""
        a, b, c = self.semi_axes
        return 4.0 / 3.0 * pi * a * b * c


def _squeezed(box: tuple[float, float, float], litres: float) -> tuple[float, float, float]:
    """Semi-axes of an upright ellipsoid as long (z) as `box`, thinned to displace `litres`."""
    x, y, z = box
    thin = sqrt(litres * 1e-3 / (4.0 / 3.0 * pi * x * y * z))
    return (x * thin, y * thin, z)


def hulls(displaced_litres: float = DISPLACED_LITRES) -> list[Hull]:
    """All 17 hulls; their volumes sum to `displaced_litres`."""
    low, high = DISPLACED_LITRES_RANGE
    if not low <= displaced_litres <= high:
        raise ValueError(f"displaced volume {displaced_litres} L: expected {low} to {high} L")
    foot = table.FOOT_RADIUS
    legs = []
    for leg in table.LEGS:
        s, f = table.side(leg), table.fore(leg)
        legs += [
            Hull(
                f"{leg}_hip_hull",
                f"{leg}_hip",
                "hip",
                (-f * 0.0110, s * 0.00655, 0.0),
                _squeezed((0.0957, 0.04875, 0.08495), 1.014),
            ),
            Hull(
                f"{leg}_thigh_hull",
                f"{leg}_thigh",
                "thigh",
                (0.0, -s * 0.0308, -0.1445),
                _squeezed((0.08495, 0.0628, 0.22945), 2.487),
            ),
            Hull(
                f"{leg}_calf_hull",
                f"{leg}_calf",
                "calf",
                (0.00535, 0.0, -0.16525),
                _squeezed((0.04555, 0.0275, 0.22505), 0.470),
            ),
            Hull(f"{leg}_foot_hull", f"{leg}_calf", "foot", (0.0, 0.0, -table.SEGMENT_LENGTH), (foot, foot, foot)),
        ]
    tail, head = TRUNK_ENDS
    half_length = (head - tail) / 2
    area = (displaced_litres * 1e-3 - sum(hull.volume for hull in legs)) / (4.0 / 3.0 * pi * half_length)
    half_height = sqrt(area / TRUNK_ASPECT)
    trunk = Hull(
        "trunk_hull",
        "trunk",
        "trunk",
        ((head + tail) / 2, 0.0, TRUNK_RISE),
        (half_length, TRUNK_ASPECT * half_height, half_height),
    )
    return [trunk] + legs
