"""The links of a robot, cut into strips that ride on MuJoCo's bodies.

Sections, coefficients and their sources are those of the towing tank (`hydro_tools.tank`): Morison drag across and
along a strip, added mass of its section. A body's frame stands in for the tank's base frame.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np

from ..robot import table
from ..tank import coefficients, drag, geometry


@dataclass(frozen=True)
class Strips:
    """S strips on L bodies; the strips of a body lie side by side.

    names [L] of the bodies; owner [S], index of a strip's body. Rows of `drag.Strips` are in the frame of its body.
    """

    names: tuple[str, ...]
    owner: np.ndarray
    sections: drag.Strips

    @cached_property
    def first(self) -> np.ndarray:
        """First strip of each body [L]."""
        return np.searchsorted(self.owner, np.arange(len(self.names)))

    @cached_property
    def rows(self) -> np.ndarray:
        """[S,3,6]: velocity along e1 e2 e3 [m/s] of a body's angular and linear velocity in its own frame."""
        body = self.sections.body
        turning = np.cross(body.centre[:, None, :], body.axes)
        return np.concatenate((turning, body.axes), axis=-1)

    @cached_property
    def width(self) -> np.ndarray:
        """Root of the section's area [S] m."""
        return np.sqrt(np.prod(self.sections.body.breadth, axis=1))

    def on_bodies(self, values: np.ndarray) -> np.ndarray:
        """Sum [m, L, ...] over the strips of each body of values [m, S, ...]."""
        return np.add.reduceat(values, self.first, axis=1)

    def ids(self, model: mujoco.MjModel) -> np.ndarray:
        """Numbers of the bodies in a model [L]."""
        return np.array([model.body(name).id for name in self.names])


def strips(links: Mapping[str, Sequence[geometry.Link]]) -> Strips:
    """Strips of links by body; a link is given in its body's frame [m]."""
    whole = geometry.Body(tuple(link for part in links.values() for link in part))
    counts = [sum(link.strips for link in part) for part in links.values()]
    return Strips(tuple(links), np.repeat(np.arange(len(counts)), counts), drag.Strips(whole))


def b1() -> Strips:
    """The 17 links of B1 on its 13 bodies."""
    origins = {"trunk": np.zeros(3)}
    for link in table.moving_links():
        origins[link.name] = origins[link.parent] + np.array(link.origin)
    found: dict[str, list[geometry.Link]] = {name: [] for name in origins}
    # With all joints at zero the frames of all bodies are parallel to the base's.
    for link in geometry.links(0.0, 0.0):
        body = link.name.replace("_foot", "_calf")
        found[body].append(_moved(link, -origins[body]))
    return strips(found)


def _moved(link: geometry.Link, by: np.ndarray) -> geometry.Link:
    return geometry.Link(
        link.name,
        link.part,
        link.start + by,
        link.end + by,
        link.e1,
        link.e2,
        link.breadths,
        link.strips,
        link.ball,
    )


def added_volumes(strips: Strips) -> np.ndarray:
    """Added mass over the water's density [S,3] m^3 along e1, e2, e3."""
    return coefficients.added_volumes(strips.sections.body)
