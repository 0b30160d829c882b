"""What is called before the package is imported: by `import mujoco`, and by the command `hydro`.

It stands apart from `hydro_mujoco`, which imports mujoco and numpy.
"""

import importlib
import importlib.util
import os
import sys
from pathlib import Path

_PACKAGE = Path(__file__).with_name("hydro_mujoco")
_LIBRARY = "libhydro_plugin.so"
#: Environment variables: another program than the package's; the libmujoco that it opens.
PROGRAM, MUJOCO = "HYDRO_PROGRAM", "HYDRO_MUJOCO_LIBRARY"
#: What the library said when `import mujoco` loaded it: why it registered nothing.
said: list[str] = []


def plugin() -> None:
    """Load the plugin of this wheel: the entry point that MuJoCo 4.0.0 and newer call at the end of their import.

    Nothing happens in an editable install, whose library is named by whoever loads it.

    Raises:
        ImportError: the library registers nothing, and why; MuJoCo makes a RuntimeWarning of it.
    """
    library = _PACKAGE / _LIBRARY
    if not library.is_file():
        return
    mujoco = sys.modules["mujoco"]
    # Else MuJoCo prints what the library says, and writes it into MUJOCO_LOG.TXT in the working folder.
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(said.append)
    try:
        mujoco.mj_loadPluginLibrary(str(library))
    finally:
        mujoco.set_mju_user_warning(before)
    if said:
        raise ImportError("; ".join(text.removeprefix("hydro: ") for text in said))


def find_program() -> Path:
    """The program `hydro`: what the environment names, else the package's, else the newest that cargo has built.

    Raises:
        FileNotFoundError: there is none; the message says where it was looked for.
    """
    if named := os.environ.get(PROGRAM):
        if not Path(named).is_file():
            raise FileNotFoundError(f"{PROGRAM} is {named}: no such file")
        return Path(named)
    packaged = _PACKAGE / "bin" / "hydro"
    if packaged.is_file():
        return packaged
    target = _PACKAGE.parents[1] / "target"
    built = [path for path in target.glob("*/hydro") if path.is_file()]
    if not built:
        raise FileNotFoundError(f"no program in {packaged} or {target}; in a checkout: cargo build --release")
    return max(built, key=lambda path: path.stat().st_mtime)


def environment() -> dict[str, str]:
    """The environment with the libmujoco of this Python's mujoco package, for the program to open."""
    found = importlib.util.find_spec("mujoco")
    folders = found.submodule_search_locations if found else None
    libraries = sorted(Path(folders[0]).glob("libmujoco.so*")) if folders else []
    own = {MUJOCO: str(libraries[-1])} if libraries else {}
    return own | dict(os.environ)


def program() -> None:
    """Become the program `hydro`, which opens the libmujoco of this Python's mujoco package.

    `hydro trials` is written in Python and runs here.
    """
    if sys.argv[1:2] == ["trials"]:
        trials = importlib.import_module("hydro_mujoco.trials.__main__")
        sys.exit(trials.main(sys.argv[2:]))
    try:
        path = find_program()
    except FileNotFoundError as error:
        sys.exit(f"hydro: {error}")
    os.execve(path, ["hydro", *sys.argv[1:]], environment())
