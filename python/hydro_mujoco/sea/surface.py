"""The surface of the sea as MuJoCo draws it: a skin of the world, which nothing collides with and no ray meets."""

import mujoco
import numpy as np

from ..errors import DataError
from ..water import body_number
from .grid import Grid
from .water import water_about

#: Name of the skin, of its material, of the body that holds it, of the light.
NAME = "hydro_sea"
#: Fewest and most cells a side.
CELLS = (8, 1024)
#: Exponent of the stretching: cells stay small about the middle.
STRETCH = 5


def add_surface(
    spec: mujoco.MjSpec,
    *,
    size: float = 600.0,
    cells: int = 256,
    cell: float = 0.25,
    rgba: tuple[float, float, float, float] = (0.1, 0.35, 0.45, 0.9),
    sun: tuple[float, float] | None = (150.0, 15.0),
) -> mujoco.MjSpec:
    """Add the surface of a sea to a spec; returns the spec, changed. `Surface` moves it.

    It is a square grid, fine about its middle and coarse towards the horizon: a skin, which has no mass, collides with
    nothing and is no target of rays.

    Args:
        spec: not compiled yet.
        size: side of the square [m].
        cells: of a side, 8 to 1024.
        cell: side of the cells at the middle [m]; `size / cells` at most. A quarter of the shortest wave's length or of
            the smallest thing that floats will do.
        rgba: colour, 0 to 1 each.
        sun: direction towards a light that is added [degrees]: counterclockwise from world x, above the horizon. A low
            one shows the slopes; None where the scene has lights of its own from the side.

    Raises:
        DataError: the spec has a surface already, or a number is out of bounds.
    """
    if any(skin.name == NAME for skin in spec.skins):
        raise DataError(f"the spec has a skin `{NAME}` already: a model has one surface")
    if not CELLS[0] <= cells <= CELLS[1]:
        raise DataError(f"cells is {cells}; expected {CELLS[0]} to {CELLS[1]}")
    if not 0 < cell <= size / cells or not np.isfinite(size):
        raise DataError(f"cell is {cell} m and size {size} m; expected 0 < cell <= size / cells, {size / cells:g} m")
    _add_mesh(spec, size, cells, cell)
    spec.add_material(name=NAME, rgba=rgba, specular=0.8, shininess=0.8)
    if sun is not None:
        azimuth, elevation = np.radians(sun)
        down = [-np.cos(elevation) * np.cos(azimuth), -np.cos(elevation) * np.sin(azimuth), -np.sin(elevation)]
        spec.worldbody.add_light(
            name=NAME,
            type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
            dir=down,
            diffuse=[1.0] * 3,
            specular=[0.8] * 3,
            castshadow=False,
        )
    return spec


def _add_mesh(spec: mujoco.MjSpec, size: float, cells: int, cell: float) -> None:
    """Add the skin of a flat square; arguments of `add_surface`."""
    along = np.linspace(-1, 1, cells + 1)
    fine = cell * cells / size
    axis = 0.5 * size * (fine * along + (1 - fine) * along**STRETCH)
    vertices = np.zeros((cells + 1, cells + 1, 3))
    vertices[..., 0], vertices[..., 1] = axis[:, None], axis
    index = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    here, x, y, both = index[:-1, :-1], index[1:, :-1], index[:-1, 1:], index[1:, 1:]
    faces = np.stack([here, x, both, here, both, y], axis=-1)
    spec.worldbody.add_body(name=NAME)
    spec.add_skin(
        name=NAME,
        material=NAME,
        vert=vertices.ravel(),
        face=faces.ravel(),
        bodyname=[NAME],
        bindpos=[0, 0, 0],
        bindquat=[1, 0, 0, 0],
        vertid=[index.ravel().tolist()],
        vertweight=[np.ones(index.size).tolist()],
    )


class Surface:
    """The drawn surface of the sea about a body; `update` moves it before a picture is taken.

    What is drawn is `Water.level`: the components that the plugin applies, at the time of `data`. Waves shorter than
    two cells are left out, which far away are all but the longest. The vertices are in the model, so that every
    `mujoco.Renderer` of this model shows them; several simulations of one model share one surface.

    >>> import mujoco, hydro_mujoco as hydro
    >>> spec = mujoco.MjSpec.from_string('''<mujoco><worldbody><body name="boat"><freejoint/>
    ...   <geom type="box" size="1 0.5 0.25" mass="400"/></body></worldbody></mujoco>''')
    >>> spec = hydro.add_water(spec, body="boat", effects={"hydrostatics": {}}, waterline=0,
    ...   waves=[{"height": 0.3, "period": 4.5}])
    >>> spec = hydro.sea.add_surface(spec, cells=64)
    >>> model = spec.compile(); data = mujoco.MjData(model)
    >>> surface = hydro.sea.Surface(model, "boat")
    >>> mujoco.mj_forward(model, data); surface.update(data)
    """

    def __init__(self, model: mujoco.MjModel, body: str):
        """Find the surface of a model and the water about a body.

        Args:
            model: compiled, of a spec that `add_surface` was given. body: name of one with water about it, which has a
                waterline; the middle of the grid follows it.

        Raises:
            DataError: there is no such body, or no surface, or the water about the body has none.
        """
        skin = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SKIN, NAME)
        if skin < 0:
            raise DataError(f"the model has no skin `{NAME}`: hydro_mujoco.sea.add_surface adds it to the spec")
        self._body = body_number(model, body)
        self.water = water_about(model, self._body)
        waterline = self.water.waterline
        if waterline is None:
            raise DataError(f"the water about body `{body}` has no surface: its instance needs a `waterline`")
        self._still = waterline
        start, number = model.skin_vertadr[skin], model.skin_vertnum[skin]
        side = int(np.sqrt(number))
        self._vertices = model.skin_vert[start : start + number].reshape(side, side, 3)
        self._x, self._y = self._vertices[:, 0, 0].copy(), self._vertices[0, :, 1].copy()
        waves = self.water.waves
        self._grid = None if waves is None else Grid(waves, self._x, self._y, fade=True)

    def update(self, data: mujoco.MjData, centre: tuple[float, float] | None = None) -> None:
        """Set the vertices to the surface at the time of `data`.

        centre: x, y [m] of the middle of the grid; by default the body's, in whole cells.
        """
        middle = data.xpos[self._body, :2] if centre is None else np.asarray(centre, float)
        half = len(self._x) // 2
        cell = self._x[half + 1] - self._x[half]
        offset = cell * np.round(middle / cell)
        level = 0.0 if self._grid is None else self._grid.elevation(data.time, offset)
        self._vertices[..., 0] = (self._x + offset[0])[:, None]
        self._vertices[..., 1] = self._y + offset[1]
        self._vertices[..., 2] = self._still + level
