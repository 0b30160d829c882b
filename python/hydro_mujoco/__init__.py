"""Water for MuJoCo, from Python.

water.py      `add_water(spec, body=...)`, `wrench(model, data, body)`
packaged.py   scenes, checkpoints, examples and the library that come with the package
record/       `record(model, out)`, and the command `python -m hydro_mujoco.record`
learned.py    `with_checkpoint`: a scene with a checkpoint in place of its water
recording/    what every recorder has: plans, simulation, shards, folder, manifest
jobs/         independent jobs, here or in processes
plugin.py     the plugin library: where it is, how it is loaded
doctor.py     `python -m hydro_mujoco`: whether the plugin acts here
"""

from . import requirement as _requirement  # First: it refuses a MuJoCo without what the others import.
from .errors import DataError, Notice
from .learned import with_checkpoint
from .packaged import checkpoint, examples, library, scene

# The function, over the folder of the same name.
from .record import record
from .version import __version__
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
    "with_checkpoint",
    "wrench",
]
del _requirement
