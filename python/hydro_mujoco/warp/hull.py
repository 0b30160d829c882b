"""Sizes of bodies and the shapes of their hulls, as the plugin takes them from the geoms."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from ..errors import DataError
from ..recording.kinematics import name_of
from ..submersion import submerged
from .instances import Instance
from .solids import ELLIPSOID, Solid, geom_pose, solid_of

#: Geoms of this group are what MuJoCo's models keep for collisions, not for the eye.
HULL_GROUP = 3
#: Depth [m] at which a hull is under water whole, whatever its size.
DEEP = 1e5
#: Difference of two centres of one hull that is rounding [m]: meshes are in single precision.
CLOSE = 1e-4


@dataclass(frozen=True)
class Hull:
    """A body's sizes, in its frame.

    Attributes:
        middle: of the box round the hull's geoms [m]. extent: of that box [m].
        centre: of the whole hull's volume [m]. volume: that hydrostatics counts where its effect does not say [m^3].
        displaced: volume of the body, or of its tree where it is the first of one [m^3].
        solids: shapes that a surface cuts; none without a waterline.
    """

    middle: np.ndarray
    extent: np.ndarray
    centre: np.ndarray
    volume: float
    displaced: float
    solids: tuple[Solid, ...]


#: Of a body that no effect acts on.
NO_HULL = Hull(np.zeros(3), np.ones(3), np.zeros(3), 0.0, 0.0, ())


@dataclass(frozen=True)
class BodyHull:
    """The closed shapes of a body of a robot, in its frame."""

    body: int
    solids: tuple[Solid, ...]


def robot_hulls(model: mujoco.MjModel, instance: Instance) -> list[BodyHull]:
    """The hulls that a checkpoint's force fades with: of the carrying body and of those below it.

    Raises:
        DataError: shapes of a body overlap.
    """
    by_body: dict[int, list[int]] = {}
    for geom in geoms_of(model, _below(model, instance.body), instance.hull):
        by_body.setdefault(int(model.geom_bodyid[geom]), []).append(geom)
    hulls = [BodyHull(body, tuple(_solids(model, body, geoms))) for body, geoms in by_body.items()]
    for each in hulls:
        _check_apart(model, each.body, instance, each.solids)
    return hulls


def hull(model: mujoco.MjModel, body: int, instance: Instance, *, is_known: bool = True) -> Hull:
    """The hull of a body in the water of an instance.

    is_known: False for a body that has neither an instance nor an effect, of which the plugin tells nothing.

    Raises:
        DataError: there is a waterline, and the hull has shapes that overlap, or that cross themselves.
    """
    middle, extent = _box(model, body, instance.hull)
    solids = () if instance.waterline is None else _surfaced(model, body, instance, middle, extent)
    if is_known or body == instance.body:
        volume, centre = _whole(model, body)
        _check_centre(model, body, instance, hull_centre(solids, centre) - centre)
    else:
        volume, centre = sum(solid.volume for solid in solids), hull_centre(solids, middle)
    given = instance.volume if instance.body == body else None
    return Hull(
        middle=middle,
        extent=extent,
        centre=centre,
        volume=volume,
        displaced=_displaced(model, body, instance.density) if given is None else given,
        solids=solids,
    )


def hull_centre(solids: Sequence[Solid], otherwise: np.ndarray) -> np.ndarray:
    """Centre of volume of solids [m]; `otherwise` where there are none."""
    weighted = [solid.volume * solid.centre_of_volume for solid in solids]
    return np.sum(weighted, axis=0) / sum(solid.volume for solid in solids) if solids else otherwise


def _below(model: mujoco.MjModel, body: int) -> list[int]:
    found = {body}
    for link in range(body + 1, model.nbody):
        if int(model.body_parentid[link]) in found:
            found.add(link)
    return sorted(found)


def _welded(model: mujoco.MjModel, body: int) -> list[int]:
    weld = model.body_weldid
    return [link for link in _below(model, body) if weld[link] == weld[body]]


def geoms_of(model: mujoco.MjModel, bodies: Iterable[int], named: list[str] | None) -> list[int]:
    """The geoms of a hull: those named; else those of MuJoCo's ellipsoid fluid, else group 3, else all."""
    geoms = [
        geom
        for body in bodies
        for geom in range(model.body_geomadr[body], model.body_geomadr[body] + model.body_geomnum[body])
    ]
    if named is not None:
        return [geom for geom in geoms if model.geom(geom).name in named]
    fluid = [geom for geom in geoms if model.geom_fluid[geom, 0] > 0]
    return fluid or [geom for geom in geoms if model.geom_group[geom] == HULL_GROUP] or geoms


def _box(model: mujoco.MjModel, body: int, named: list[str] | None) -> tuple[np.ndarray, np.ndarray]:
    """Middle and extents [m] of the box along the body's axes; of that of the same inertia where there are no geoms."""
    corners = []
    for geom in geoms_of(model, _welded(model, body), named):
        place, axes = geom_pose(model, geom, body)
        centre, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
        reach = np.abs(axes) @ half
        corners += [place + axes @ centre - reach, place + axes @ centre + reach]
    if corners:
        low, high = np.min(corners, axis=0), np.max(corners, axis=0)
        return (low + high) / 2, high - low
    moments = model.body_inertia[body]
    sums = moments.sum() - 2 * moments
    return model.body_ipos[body].copy(), np.sqrt(6 * np.maximum(sums, 0) / max(model.body_mass[body], 1e-300))


def _whole(model: mujoco.MjModel, body: int) -> tuple[float, np.ndarray]:
    """Volume [m^3] and centre [m, body frame] of the whole hull, by the plugin; those given where they are given."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    data.xpos[body] = [0, 0, -DEEP]
    part = submerged(model, data, name_of(model, body))
    return part.volume, part.centre


def own_volume(model: mujoco.MjModel, body: int, density: float) -> float:
    """Volume that a body alone displaces [m^3]: what gravity compensation says, else that of its hull's geoms."""
    return _volume_of(model, [body], density)


def _displaced(model: mujoco.MjModel, body: int, density: float) -> float:
    """The same of a body with its tree where it is the first of one [m^3]."""
    bodies = _below(model, body) if model.body_rootid[body] == body else [body]
    return _volume_of(model, bodies, density)


def _volume_of(model: mujoco.MjModel, bodies: list[int], density: float) -> float:
    compensated = sum(model.body_gravcomp[link] * model.body_mass[link] for link in bodies)
    if compensated > 0:
        return float(compensated / density)
    return sum(solid.volume for solid in _solids(model, bodies[0], geoms_of(model, bodies, None)))


def _solids(model: mujoco.MjModel, body: int, geoms: Iterable[int]) -> list[Solid]:
    """The closed shapes among geoms, in a body's frame."""
    return [found for geom in geoms if (found := solid_of(model, geom, body)) is not None]


def _surfaced(
    model: mujoco.MjModel, body: int, instance: Instance, middle: np.ndarray, extent: np.ndarray
) -> tuple[Solid, ...]:
    """The shapes of a hull that a surface cuts; the ellipsoid of its extents where it has no geoms."""
    solids = _solids(model, body, geoms_of(model, _welded(model, body), instance.hull))
    _check_apart(model, body, instance, solids)
    return tuple(solids) or (Solid(ELLIPSOID, middle, np.eye(3), extent / 2),)


def _check_apart(model: mujoco.MjModel, body: int, instance: Instance, solids: Sequence[Solid]) -> None:
    """Refuse shapes that overlap."""
    for second, solid in enumerate(solids):
        for other in solids[:second]:
            low, high = np.maximum(solid.bounds[0], other.bounds[0]), np.minimum(solid.bounds[1], other.bounds[1])
            if np.all(high - low > 1e-9):
                raise DataError(
                    f"waterline of instance `{instance.name}`, hull of body `{name_of(model, body)}`: boxes round two "
                    "of its geoms overlap, and what they share would count twice in MuJoCo Warp; name geoms that do "
                    "not in attribute `hull`"
                )


def _check_centre(model: mujoco.MjModel, body: int, instance: Instance, way: np.ndarray) -> None:
    """Refuse a hull that the plugin has another shape of. way: from its centre there to that here [m]."""
    is_given = instance.body == body and instance.centre_of_buoyancy is not None
    if not is_given and np.linalg.norm(way) > CLOSE:
        raise DataError(
            f"waterline of instance `{instance.name}`, hull of body `{name_of(model, body)}`: its centre is "
            f"{np.linalg.norm(way):.3g} m off the plugin's,\nwhich takes an ellipsoid for a mesh that crosses itself; "
            "give it a mesh that does not"
        )
