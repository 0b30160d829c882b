"""What is called before the package is imported: by `import mujoco`, and by the command `hydro`.

It stands apart from `hydro_mujoco`, which imports mujoco and numpy.
"""

import ctypes
import importlib
import importlib.util
import os
import sys
from pathlib import Path

_PACKAGE = Path(__file__).with_name("hydro_mujoco")
_LIBRARY = "libhydro_plugin.so"


def plugin() -> None:
    """Load the plugin of this wheel: the entry point that MuJoCo 4.0.0 and newer call at the end of their import.

    Nothing happens in an editable install, whose library is named by whoever loads it.
    """
    library = _PACKAGE / _LIBRARY
    if library.is_file():
        ctypes.CDLL(str(library))


def program() -> None:
    """Become the program `hydro`, which opens the libmujoco of this Python's mujoco package.

    `hydro trials` is written in Python and runs here.
    """
    if sys.argv[1:2] == ["trials"]:
        trials = importlib.import_module("hydro_mujoco.trials.__main__")
        sys.exit(trials.main(sys.argv[2:]))
    here = _PACKAGE / "bin" / "hydro"
    # A checkout's.
    built = _PACKAGE.parents[1] / "target" / "release" / "hydro"
    path = next((path for path in (here, built) if path.is_file()), None)
    if path is None:
        sys.exit(f"hydro: no program in {here} or {built}; in a checkout: cargo build --release")
    mujoco = importlib.util.find_spec("mujoco")
    folders = mujoco.submodule_search_locations if mujoco else None
    libraries = sorted(Path(folders[0]).glob("libmujoco.so*")) if folders else []
    if path == here and libraries:
        os.environ.setdefault("HYDRO_MUJOCO_LIBRARY", str(libraries[-1]))
    os.execv(path, ["hydro", *sys.argv[1:]])
