"""Water for MuJoCo, from Python: record a data set from any MJCF, put a trained checkpoint into it.

record/       `record(model, out)`, and the command `python -m hydro_mujoco.record`
checkpoint.py a scene with a checkpoint in place of its water
recording/    what every recorder has: plans, simulation, shards, folder, manifest
jobs/         independent jobs, here or in processes
plugin.py     the plugin library: where it is, how it is loaded
"""

from importlib import import_module
from typing import TYPE_CHECKING

from .errors import DataError, Notice
from .version import __version__

if TYPE_CHECKING:
    from .checkpoint import with_checkpoint
    from .record import record

__all__ = ["DataError", "Notice", "__version__", "record", "with_checkpoint"]


def __getattr__(name: str) -> object:
    """What needs MuJoCo is imported where it is first asked for."""
    if name == "record":
        # The folder `record` can be called like the function in it.
        return import_module(".record", __name__)
    if name == "with_checkpoint":
        return import_module(".checkpoint", __name__).with_checkpoint
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
