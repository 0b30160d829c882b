"""Water for MuJoCo, from Python.

water.py       `add_water(spec, body=...)`, `wrench(model, data, body)`
submersion.py  `submerged(model, data, body)`
velocity_products.py  `drag_tensors(name, ...)`: drag by products of two velocities, as effects
sea/           the sea about a body: `sea.water(model, body)`, and its surface drawn by MuJoCo
sensors/       sensors of underwater vehicles: DVL, pressure, GPS, sonars, USBL, acoustic and optical modems, INS
packaged.py    scenes, checkpoints, examples and the library that come with the package
record/        `record(model, out)`, and the command `python -m hydro_mujoco.record`
trials/        logs of real vehicles as trials for `hydro gap`: `trials.from_mcap(...)`, `python -m hydro_mujoco.trials`
training.py    `train(data, out)`, `evaluate(checkpoint, data)`
learned.py     `with_checkpoint`: a scene with a checkpoint in place of its water
envs/          Gymnasium environments, one and many at once (`import hydro_mujoco.envs`)
warp/          the water in MuJoCo Warp, many worlds at once (`import hydro_mujoco.warp`)
gap/           `gap.run(nominal, trials, out=...)`, `gap.effects()`
recording/     what every recorder has: plans, simulation, shards, folder, manifest
jobs/          independent jobs, here or in processes
boundary_elements.py  results of Capytaine and other programs, for the attribute `potential_flow`
plugin.py      the plugin library: where it is, how it is loaded
program.py     the program `hydro`, run for a function
extras.py      modules of optional dependencies, or the command that installs them
doctor.py      `python -m hydro_mujoco`: whether the plugin acts here
"""

from importlib import import_module
from typing import TYPE_CHECKING

from . import requirement
from .errors import DataError, Notice
from .version import __version__

if TYPE_CHECKING:
    from . import gap, sea, sensors, trials
    from .boundary_elements import from_capytaine, potential_flow
    from .learned import with_checkpoint
    from .packaged import checkpoint, examples, library, scene
    from .record import record
    from .submersion import Submerged, submerged
    from .training import Trained, evaluate, train
    from .velocity_products import drag_tensors
    from .water import add_water, wrench

__all__ = [
    "DataError",
    "Notice",
    "Submerged",
    "Trained",
    "__version__",
    "add_water",
    "checkpoint",
    "drag_tensors",
    "evaluate",
    "examples",
    "from_capytaine",
    "gap",
    "library",
    "potential_flow",
    "record",
    "scene",
    "sea",
    "sensors",
    "submerged",
    "train",
    "trials",
    "with_checkpoint",
    "wrench",
]

#: What needs MuJoCo -> its module; a name without one is itself a module.
_FROM = {
    "Submerged": ".submersion",
    "Trained": ".training",
    "add_water": ".water",
    "checkpoint": ".packaged",
    "drag_tensors": ".velocity_products",
    "evaluate": ".training",
    "examples": ".packaged",
    "from_capytaine": ".boundary_elements",
    "gap": None,
    "library": ".packaged",
    "potential_flow": ".boundary_elements",
    # The folder `record` can be called like the function in it.
    "record": None,
    "scene": ".packaged",
    "sea": None,
    "sensors": None,
    "submerged": ".submersion",
    "train": ".training",
    "trials": None,
    "with_checkpoint": ".learned",
    "wrench": ".water",
}


def __getattr__(name: str) -> object:
    """What needs MuJoCo is imported where it is first asked for, after a look at which MuJoCo that is."""
    if name not in _FROM:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    requirement.check_installed()
    module = _FROM[name]
    return import_module(f".{name}", __name__) if module is None else getattr(import_module(module, __name__), name)
