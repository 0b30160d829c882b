"""The plugin library: where it is, and loading it into this process."""

import ctypes
import os
import sys
import warnings
from functools import cache
from pathlib import Path
from typing import Any

import mujoco

import hydro_mujoco_entry

from .errors import DataError

#: Name of the force plugin in an MJCF's <extension>.
WRENCH = "hydro.wrench"
#: Environment variables: the library itself, the folder that holds it.
LIBRARY, FOLDER = "HYDRO_PLUGIN", "HYDRO_PLUGIN_DIR"


def library_name() -> str:
    """File name of the plugin library on this system."""
    return {"darwin": "libhydro_plugin.dylib", "win32": "hydro_plugin.dll"}.get(sys.platform, "libhydro_plugin.so")


def built_library(variable: str = LIBRARY) -> Path:
    """The plugin library that an environment variable names, else the newest that cargo has built; it may not exist.

    variable: of the library itself; FOLDER counts where it is not set.
    """
    if variable in os.environ:
        return Path(os.environ[variable])
    if FOLDER in os.environ:
        return Path(os.environ[FOLDER], library_name())
    packaged = Path(__file__).with_name(library_name())
    if packaged.is_file():
        return packaged
    target = Path(__file__).resolve().parents[2] / "target"
    built = target.glob(f"*/{library_name()}")
    return max(built, key=lambda path: path.stat().st_mtime, default=target / "release" / library_name())


def is_loaded() -> bool:
    """True where this process knows `hydro.wrench`."""
    return bool(_mujoco().mjp_getPlugin(WRENCH.encode(), None))


def attribute(model: mujoco.MjModel, instance: int, name: str) -> str | None:
    """Value of an attribute of a plugin instance of a compiled model; "" where it is not given.

    None where the instance's plugin has no such attribute.
    """
    found = _mujoco().mj_getPluginConfig(ctypes.c_void_p(model._address), instance, name.encode())
    return None if found is None else found.decode()


def loaded_copies() -> list[Path]:
    """Files of the plugin library in this process, in the order of their names."""
    try:
        maps = Path("/proc/self/maps").read_text(encoding="utf-8")
    except OSError:
        return []
    paths = {line[line.index("/") :] for line in maps.splitlines() if "/libhydro_plugin" in line}
    return [Path(path) for path in sorted(paths)]


def load_plugin(path: Path | None = None) -> None:
    """Register the library's plugins in this process, unless they are registered already.

    path: `built_library()` by default.
    """
    if is_loaded():
        return
    path = path or built_library()
    if not path.is_file():
        raise DataError(
            f"plugin library {path}: no such file; install the wheel, or build it with `cargo build --release`, or "
            f"name it by --plugin or {LIBRARY}"
        )
    said: list[str] = []
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(said.append)
    try:
        mujoco.mj_loadPluginLibrary(str(path.resolve()))
    except mujoco.FatalError as error:
        raise DataError(f"plugin library {path}: {error}") from error
    finally:
        mujoco.set_mju_user_warning(before)
    if not is_loaded():
        # A library says it once a process, which may have been at `import mujoco`.
        words = said or hydro_mujoco_entry.said
        reason = "; ".join(text.removeprefix("hydro: ") for text in words) or "and says nothing of it"
        raise DataError(f"plugin library {path} did not register {WRENCH}: {reason}")
    for text in said:
        warnings.warn(text, stacklevel=2)


def declare(spec: mujoco.MjSpec, name: str, config: dict[str, str], *users: Any) -> None:
    """Declare an instance of `hydro.wrench` in a spec.

    users: what uses it, elements with a `plugin`: the body that carries it, a sensor that reads it.
    """
    spec.activate_plugin(WRENCH)
    spec.add_plugin(name=name, plugin_name=WRENCH, active=True).config = config
    for user in users:
        user.plugin.plugin_name, user.plugin.name, user.plugin.active = WRENCH, name, True


@cache
def _mujoco() -> ctypes.CDLL:
    """The MuJoCo of this process, for functions that its Python package lacks."""
    found = sorted(path for path in Path(mujoco.__file__).parent.glob("libmujoco*"))
    if not found:
        raise DataError("the mujoco package has no libmujoco beside it")
    library = ctypes.CDLL(str(found[0]))
    library.mjp_getPlugin.restype = ctypes.c_void_p
    library.mj_getPluginConfig.restype = ctypes.c_char_p
    return library
