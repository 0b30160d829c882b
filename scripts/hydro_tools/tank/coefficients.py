"""Coefficients of the strips: the literature's tables, and judgement.

Literature, quoted to two figures and without the books at hand; entries of SECTION_DRAG between the
tabulated corner radii are interpolated:
- DNV-RP-C205, Environmental conditions and environmental loads: drag of rectangles with rounded
  corners and of a square rod along the flow (appendix E), reduction for finite length (section 6),
  added mass of rectangular sections and of square prisms along their axis (appendix D). The same
  section data stand in S. F. Hoerner, Fluid-Dynamic Drag (1965), chapter 3, and the use of both in
  strips with the cross-flow principle in O. M. Faltinsen, Sea Loads on Ships and Offshore
  Structures (1990), chapter 6.
- Sphere: F. M. White, Viscous Fluid Flow, 24/Re + 6/(1 + sqrt Re) + 0.4, to Re = 2e5.
- Skin friction: the ITTC-1957 line, 0.075 / (log10 Re - 2)^2.

Judgement: how round the corners are, that the drag of rounded bars falls by EDGE_FALL between Re = 3e4
and 2e5 (boundary layers on rounded edges turn turbulent there; N. K. Delany and N. E. Sorensen, NACA TN
3038, 1953, show falls of that kind), how much of a hip's and a leg's end the neighbouring link covers.
"""

import numpy as np

from hydro_tools.robot.table import SEGMENT_LENGTH

from .geometry import Body

#: Drag of a rectangle across the flow: rows depth / breadth, columns corner radius / breadth.
DEPTH_RATIOS, CORNERS = (0.5, 1.0, 2.0), (0.0, 0.083, 0.167, 0.25)
SECTION_DRAG = ((2.5, 1.9, 1.75, 1.6), (2.2, 1.65, 1.2, 1.1), (1.6, 1.15, 0.7, 0.6))
#: Corner radius over the breadth that meets the flow: an edged hull, rounded legs, a round motor.
CORNER = {"trunk": 0.04, "hip": 0.25, "thigh": 0.10, "calf": 0.10, "foot": 0.25}
#: Drag of a finite bar over that of an endless one: length / breadth, factor (flat plate, subcritical).
FINITE = ((2.0, 5.0, 10.0, 20.0, 40.0), (0.62, 0.66, 0.69, 0.81, 0.87))
#: Thigh and calf are one bar to the flow: what counts as its length [m].
WHOLE = {"thigh": 2 * SEGMENT_LENGTH, "calf": 2 * SEGMENT_LENGTH}
#: A square rod along the flow: length / breadth, drag on its frontal area.
ROD = ((1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0), (1.15, 0.97, 0.87, 0.90, 0.93, 0.95, 0.95))
#: Share of a link's ends that the flow along it meets: hips and legs are covered by their neighbours.
OPEN_END = {"trunk": 1.0, "hip": 0.5, "thigh": 0.5, "calf": 0.25, "foot": 1.0}
#: Fall of a rounded bar's drag: share, log10 of the Reynolds number at its middle, width.
EDGE_FALL, EDGE_MIDDLE, EDGE_WIDTH = 0.25, 4.9, 0.15

#: Added mass of a rectangle: half-breadth across / half-depth along the motion, factor of pi a^2.
SECTION_ADDED = ((0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0), (2.23, 1.98, 1.70, 1.51, 1.36, 1.21, 1.14))
#: Added mass of a square prism along its axis: length / breadth, factor of the displaced mass.
PRISM_ADDED = ((1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 10.0), (0.68, 0.36, 0.24, 0.19, 0.15, 0.13, 0.11, 0.08))
SPHERE_ADDED = 0.5


def section_drag(depth_ratio: float, corner: float) -> float:
    """Drag coefficient of a rectangle of depth / breadth and corner radius / breadth, on its breadth."""
    by_depth = [np.interp(corner, CORNERS, row) for row in SECTION_DRAG]
    return float(np.interp(np.log(depth_ratio), np.log(DEPTH_RATIOS), by_depth))


def section_added(ratio: float) -> float:
    """Added mass of a rectangle over pi rho a^2 a length, a its half-breadth across the motion."""
    ratios, factors = SECTION_ADDED
    return float(np.interp(np.log(ratio), np.log(ratios), factors))


def edge(reynolds: np.ndarray) -> np.ndarray:
    """Factor on the drag of a rounded bar at a Reynolds number on its breadth."""
    return 1.0 - EDGE_FALL / (1.0 + np.exp(-(np.log10(np.maximum(reynolds, 1.0)) - EDGE_MIDDLE) / EDGE_WIDTH))


def sphere(reynolds: np.ndarray) -> np.ndarray:
    """Drag coefficient of a sphere."""
    safe = np.maximum(reynolds, 1.0)
    return 24.0 / safe + 6.0 / (1.0 + np.sqrt(safe)) + 0.4


def friction(reynolds: np.ndarray) -> np.ndarray:
    """Friction coefficient on the wetted surface."""
    return 0.075 / (np.log10(np.maximum(reynolds, 1e4)) - 2.0) ** 2


def drag_areas(body: Body) -> np.ndarray:
    """Coefficient times area [S,3] m^2 for flow along e1, e2 and (pressure on the ends only) e3; edge() and
    friction() come on top. Of a ball the area alone, for sphere().
    """
    rows = []
    for link in body.links:
        along1, along2 = link.breadths
        length = link.length / link.strips
        if link.ball:
            row = (np.pi * along1**2 / 4,) * 3
        else:
            corner = CORNER[link.part]
            # Flow along e1 meets the extent along e2, and the other way round.
            whole = max(link.length, WHOLE.get(link.part, 0.0))
            row = tuple(
                section_drag(depth / breadth, corner) * np.interp(whole / breadth, *FINITE) * length * breadth
                for depth, breadth in ((along1, along2), (along2, along1))
            )
            frontal = along1 * along2
            rod = np.interp(link.length / np.sqrt(frontal), *ROD)
            row += (rod * OPEN_END[link.part] * frontal / link.strips,)
        rows += [row] * link.strips
    return np.array(rows)


def added_volumes(body: Body) -> np.ndarray:
    """Added mass over the water's density [S,3] m^3 for acceleration along e1, e2, e3."""
    rows = []
    for link in body.links:
        along1, along2 = link.breadths
        length = link.length / link.strips
        if link.ball:
            row = (SPHERE_ADDED * np.pi / 6 * along1**3,) * 3
        else:
            prism = np.interp(link.length / np.sqrt(along1 * along2), *PRISM_ADDED)
            row = (
                section_added(along2 / along1) * np.pi * (along2 / 2) ** 2 * length,
                section_added(along1 / along2) * np.pi * (along1 / 2) ** 2 * length,
                prism * along1 * along2 * length,
            )
        rows += [row] * link.strips
    return np.array(rows)
