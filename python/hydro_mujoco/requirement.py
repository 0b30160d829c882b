"""The MuJoCo that the package needs, checked before what needs it is imported."""

from types import ModuleType

#: The first release with `mujoco.batch`, and with entry points for plugins.
OLDEST = (4, 0, 0)
#: The command that brings one.
INSTALL = "pip install 'mujoco==4.0.0'"


def mujoco_module() -> ModuleType:
    """The `mujoco` of this Python, of whatever version.

    Raises:
        ImportError: there is none, or what is there is broken.
    """
    try:
        import mujoco
    except ImportError as error:
        if getattr(error, "name", None) != "mujoco":
            raise ImportError(f"mujoco cannot be imported ({error}): {INSTALL}") from error
        raise ImportError(f"hydro_mujoco needs MuJoCo, and there is none: {INSTALL}") from error
    if not hasattr(mujoco, "__version__"):
        places = ", ".join(mujoco.__path__)
        raise ImportError(f"hydro_mujoco needs MuJoCo, and {places} is a folder without it: {INSTALL}")
    return mujoco


def check(version: str) -> None:
    """Refuse a MuJoCo that is too old."""
    found = tuple(int(part) for part in version.split(".")[:3] if part.isdigit())
    if found < OLDEST:
        raise ImportError(
            f"hydro_mujoco needs MuJoCo {'.'.join(map(str, OLDEST))}, and mujoco {version} is installed: {INSTALL}"
        )


def check_installed() -> None:
    """Refuse the MuJoCo of this Python, or its absence."""
    check(mujoco_module().__version__)
