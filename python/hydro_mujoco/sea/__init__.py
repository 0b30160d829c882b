"""The sea about a body: its surface, its motion, and a picture of it.

water.py       `water(model, body)`: level, velocity and pressure, as the plugin applies them
surface.py     `add_surface(spec)` and `Surface(model, body)`: the surface as MuJoCo draws it
grid.py        `Grid`: elevation on large grids, fast
waves.py       linear waves: elevation, velocity and pressure at points
spectrum.py    the components of a spectrum
current.py     currents: profile, grid, random part, a part that a program sets
random.py      numbers from a seed and a counter
attributes.py  what the instances of `hydro.wrench` of a compiled model say
"""

from .grid import Grid
from .surface import Surface, add_surface
from .water import Water, water
from .waves import Waves

__all__ = ["Grid", "Surface", "Water", "Waves", "add_surface", "water"]
