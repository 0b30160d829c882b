"""Water in MuJoCo Warp: many worlds at once, on a GPU or a CPU (`import hydro_mujoco.warp`, docs/warp.md).

scene.py      `without_plugin(spec)`: the model that MuJoCo Warp takes
attach.py     `attach(m, model, nworld=...)`: the water of a model, as a callback of MuJoCo Warp's
support.py    what of the plugin acts here, and the refusal of the rest
instances.py  instances of `hydro.wrench` in a compiled model, their attributes read
current.py    a current: uniform, by depth, gusts
waves.py      components of waves, listed or of a spectrum
solids.py     closed shapes of geoms
hull.py       sizes of bodies, and their hulls
swell.py      bodies that waves push
rows.py       effects as numbers, a row a body
arrays.py     these numbers on the device
surface.py    shapes below the surface: Warp functions
wet.py        how much of hulls is under water: Warp functions and kernel
sea.py        surface, waves and current at a place: Warp functions
gusts.py      gusts of each world: Warp kernel
laws.py       laws of the effects: Warp functions
wakes.py      water that remembers the motion: Warp kernel and functions
kernels.py    loads on bodies, and their way into forces, inertia and sensors: Warp kernels
checkpoint/   a checkpoint's force
"""

try:
    import mujoco_warp  # noqa: F401
except ImportError as error:
    raise ImportError("hydro_mujoco.warp needs MuJoCo Warp: pip install 'hydro-mujoco[warp]'") from error

from .attach import Water, attach
from .scene import without_plugin

__all__ = ["Water", "attach", "without_plugin"]
