"""Modules of optional dependencies."""

from importlib import import_module
from types import ModuleType

from .errors import DataError


def extra(module: str, name: str, what: str) -> ModuleType:
    """Import `module`, or refuse with the command that installs it. what: that needs it."""
    try:
        return import_module(module)
    except ImportError as error:
        raise DataError(
            f"{what} needs the package {error.name or module}: pip install 'hydro-mujoco[{name}]'"
        ) from error
