"""The MuJoCo that the package needs, checked before what needs it is imported."""

#: The first release with `mujoco.batch`, and with entry points for plugins.
OLDEST = (4, 0, 0)


def check(version: str) -> None:
    """Refuse a MuJoCo that is too old."""
    found = tuple(int(part) for part in version.split(".")[:3] if part.isdigit())
    if found < OLDEST:
        raise ImportError(
            f"hydro_mujoco needs MuJoCo {'.'.join(map(str, OLDEST))}, and mujoco {version} is installed: "
            "pip install 'mujoco==4.0.0'"
        )


def check_installed() -> None:
    """Refuse the MuJoCo of this Python, or its absence."""
    try:
        import mujoco
    except ModuleNotFoundError as error:
        if error.name != "mujoco":
            raise
        raise ImportError("hydro_mujoco needs MuJoCo, and there is none: pip install 'mujoco==4.0.0'") from error
    check(mujoco.__version__)
