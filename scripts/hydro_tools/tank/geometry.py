"""B1 in a posture, cut into strips.

Sections of the links are the simplified collision shapes of the robot's description (const.xacro,
see `hydro_tools.robot.table` for the commit): trunk 0.30 x 0.15 m, thigh 0.35 x 0.05 x 0.08 m, calf
0.35 x 0.04 x 0.05 m, hip a cylinder of radius 0.09 and length 0.04 m, foot a sphere. The trunk's
length is that between its cameras, as in `hydro_tools.robot.hull`; joints and limits are those of the table.
Judgement: the hip motor sits against the trunk's side, the short shoulder between it and the thigh is
left out, and links may overlap at the joints (their forces are added as if they did not).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hydro_tools.robot import hull, table

#: Cross-sections, width (y) and height or depth (z or x, at zero angles) [m].
TRUNK_WIDTH, TRUNK_HEIGHT = 0.30, 0.15
THIGH_WIDTH, THIGH_DEPTH = 0.05, 0.08
CALF_WIDTH, CALF_DEPTH = 0.04, 0.05
HIP_RADIUS, HIP_LENGTH = 0.09, 0.04
#: Strips a link.
TRUNK_STRIPS, BAR_STRIPS = 8, 4


@dataclass(frozen=True)
class Link:
    """A bar from `start` to `end` [m], base frame, cut into `strips`; a ball where `ball`.

    e1, e2: unit axes of its section; breadths: its extents along them [m]. The bar's own axis is e1 x e2.
    """

    name: str
    part: str
    start: np.ndarray
    end: np.ndarray
    e1: np.ndarray
    e2: np.ndarray
    breadths: tuple[float, float]
    strips: int
    ball: bool = False

    @property
    def length(self) -> float:
        """Along its axis [m]."""
        return float(np.sqrt(np.sum((self.end - self.start) ** 2)))


def _swung(angle: float) -> tuple[np.ndarray, np.ndarray]:
    """Depth axis and downward axis of a leg segment that is turned by `angle` about y."""
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([cos, 0.0, -sin]), np.array([-sin, 0.0, -cos])


def links(thigh: float, calf: float) -> list[Link]:
    """The 17 links with all four legs at the same thigh and calf angle [rad], hips at zero."""
    across = np.array([0.0, 1.0, 0.0])
    forward, up = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    tail, head = hull.TRUNK_ENDS
    out = [
        Link("trunk", "trunk", tail * forward, head * forward, across, up, (TRUNK_WIDTH, TRUNK_HEIGHT), TRUNK_STRIPS)
    ]
    for leg in table.LEGS:
        side, fore = table.side(leg), table.fore(leg)
        inner = np.array([fore * table.HIP_X, side * TRUNK_WIDTH / 2, 0.0])
        out.append(
            Link(
                f"{leg}_hip",
                "hip",
                inner,
                inner + side * HIP_LENGTH * across,
                forward,
                up,
                (2 * HIP_RADIUS, 2 * HIP_RADIUS),
                1,
            )
        )
        depth, down = _swung(thigh)
        shoulder = np.array([fore * table.HIP_X, side * (table.HIP_Y + table.THIGH_Y), 0.0])
        knee = shoulder + table.SEGMENT_LENGTH * down
        out.append(Link(f"{leg}_thigh", "thigh", shoulder, knee, depth, across, (THIGH_DEPTH, THIGH_WIDTH), BAR_STRIPS))
        depth, down = _swung(thigh + calf)
        ankle = knee + table.SEGMENT_LENGTH * down
        out.append(Link(f"{leg}_calf", "calf", knee, ankle, depth, across, (CALF_DEPTH, CALF_WIDTH), BAR_STRIPS))
        radius = table.FOOT_RADIUS
        out.append(
            Link(
                f"{leg}_foot",
                "foot",
                ankle - radius * down,
                ankle + radius * down,
                depth,
                across,
                (2 * radius, 2 * radius),
                1,
                ball=True,
            )
        )
    return out


def frontal(link: Link, direction: np.ndarray) -> tuple[float, float]:
    """Height and width [m] of the rectangle of a link's area across `direction`; the height is the longer."""
    across1, across2 = abs(link.e1 @ direction), abs(link.e2 @ direction)
    along = np.sqrt(max(1.0 - across1**2 - across2**2, 0.0))
    first, second = link.breadths
    area = (across1 * second + across2 * first) * link.length + along * first * second
    if link.ball:
        area = np.pi / 4 * first**2
    axis = link.end - link.start
    span = np.sqrt(max(axis @ axis - (axis @ direction) ** 2, 0.0))
    height = max(span, np.sqrt(area))
    return float(height), float(area / height)


@dataclass(frozen=True)
class Body:
    """A posture as arrays over S strips of B links, base frame.

    link [S], index of its link; centre [S,3] m; axes [S,3,3], rows e1, e2 (section) and e3 (along);
    length [S] m; breadth [S,2] m along e1 and e2.
    """

    links: tuple[Link, ...]

    def _repeat(self, values) -> np.ndarray:
        return np.repeat(np.asarray(values, float), [link.strips for link in self.links], axis=0)

    @cached_property
    def link(self) -> np.ndarray:
        """[S]"""
        return np.repeat(np.arange(len(self.links)), [link.strips for link in self.links])

    @cached_property
    def centre(self) -> np.ndarray:
        """[S,3] m"""
        return np.concatenate(
            [
                link.start + (np.arange(link.strips)[:, None] + 0.5) / link.strips * (link.end - link.start)
                for link in self.links
            ]
        )

    @cached_property
    def axes(self) -> np.ndarray:
        """[S,3,3]"""
        return self._repeat([(link.e1, link.e2, np.cross(link.e1, link.e2)) for link in self.links])

    @cached_property
    def length(self) -> np.ndarray:
        """[S] m"""
        return self._repeat([link.length / link.strips for link in self.links])

    @cached_property
    def breadth(self) -> np.ndarray:
        """[S,2] m"""
        return self._repeat([link.breadths for link in self.links])

    @cached_property
    def ball(self) -> np.ndarray:
        """[S] bool"""
        return self._repeat([link.ball for link in self.links]).astype(bool)


def body(thigh: float, calf: float) -> Body:
    """B1 in a posture."""
    return Body(tuple(links(thigh, calf)))
