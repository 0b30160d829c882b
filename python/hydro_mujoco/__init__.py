"""Water for MuJoCo, from Python: record a data set from any MJCF, put a trained checkpoint into it.

record/       `record(model, out)`, and the command `python -m hydro_mujoco.record`
checkpoint.py a scene with a checkpoint in place of its water
recording/    what every recorder has: plans, simulation, shards, folder, manifest
jobs/         independent jobs, here or in processes
plugin.py     the plugin library: where it is, how it is loaded
"""

from .checkpoint import with_checkpoint
from .errors import DataError, Notice

# The function, over the folder of the same name.
from .record import record
from .version import __version__

__all__ = ["DataError", "Notice", "__version__", "record", "with_checkpoint"]
