"""Water for MuJoCo, from Python.

water.py      `add_water(spec, body=...)`, `wrench(model, data, body)`
packaged.py   scenes, checkpoints, examples and the library that come with the package
record/       `record(model, out)`, and the command `python -m hydro_mujoco.record`
learned.py    `with_checkpoint`: a scene with a checkpoint in place of its water
trials/       logs of real vehicles as trials for `hydro gap`: `trials.from_mcap(...)`, `python -m hydro_mujoco.trials`
recording/    what every recorder has: plans, simulation, shards, folder, manifest
jobs/         independent jobs, here or in processes
plugin.py     the plugin library: where it is, how it is loaded
doctor.py     `python -m hydro_mujoco`: whether the plugin acts here
"""

from importlib import import_module
from typing import TYPE_CHECKING

from .errors import DataError, Notice
from .version import __version__

if TYPE_CHECKING:
    from . import trials
    from .learned import with_checkpoint
    from .packaged import checkpoint, examples, library, scene
    from .record import record
    from .water import add_water, wrench

__all__ = [
    "DataError",
    "Notice",
    "__version__",
    "add_water",
    "checkpoint",
    "examples",
    "library",
    "record",
    "scene",
    "trials",
    "with_checkpoint",
    "wrench",
]

#: What needs MuJoCo -> its module.
_FROM = {
    "add_water": ".water",
    "checkpoint": ".packaged",
    "examples": ".packaged",
    "library": ".packaged",
    "scene": ".packaged",
    "with_checkpoint": ".learned",
    "wrench": ".water",
}


def __getattr__(name: str) -> object:
    """What needs MuJoCo is imported where it is first asked for, after a look at which MuJoCo that is."""
    if name in ("record", "trials"):
        import_module(".requirement", __name__)
        # The folder `record` can be called like the function in it.
        return import_module(f".{name}", __name__)
    if name in _FROM:
        import_module(".requirement", __name__)
        return getattr(import_module(_FROM[name], __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
