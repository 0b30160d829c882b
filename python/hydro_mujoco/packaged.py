"""What comes with the package: scenes, checkpoints, examples, the plugin library, by name."""

from pathlib import Path

from .errors import DataError
from .plugin import built_library

#: Folders of scenes below `root()`.
SCENES = ("mjcf", "examples/water", "mjcf/gap", "examples/tether")


def root() -> Path:
    """The folder that holds `mjcf`, `models` and `examples`: the package's own; in a checkout, the checkout."""
    package = Path(__file__).resolve().parent
    return package if (package / "models").is_dir() else package.parents[1]


def scene(name: str) -> str:
    """Path of a scene's MJCF, for `mujoco.MjModel.from_xml_path`.

    Args:
        name: without `.xml`: `b1_swim`, `b1_truth`, `boat`, `rov`, `fish`; those of the nominals begin with `gap/`.

    Raises:
        DataError: there is none of this name; the message lists what there is.

    >>> import mujoco, hydro_mujoco
    >>> mujoco.MjModel.from_xml_path(hydro_mujoco.scene("b1_truth")).nu
    12
    """
    folders = [root() / folder for folder in SCENES]
    for folder in folders:
        path = folder / f"{name}.xml"
        if path.is_file():
            return str(path)
    names = sorted(path.stem for folder in folders[:2] for path in folder.glob("*.xml"))
    names += sorted(f"gap/{path.stem}" for path in folders[2].glob("*.xml"))
    raise DataError(f"no scene is called `{name}`; there are: {', '.join(names)}")


def checkpoint(name: str) -> str:
    """Folder of a released checkpoint, such as `b1-relaxation`, `b1-task2` or `b1-strip` (`models/README.md` has all).

    In an MJCF the name alone does too.

    Raises:
        DataError: there is none of this name; the message lists what there is.

    >>> import hydro_mujoco
    >>> hydro_mujoco.checkpoint("b1-strip").endswith("b1-strip")
    True
    """
    models = root() / "models"
    path = models / name
    if not (path / "card.json").is_file():
        names = sorted(card.parent.name for card in models.glob("*/card.json"))
        raise DataError(f"no checkpoint is called `{name}`; there are: {', '.join(names)}")
    return str(path)


def examples() -> str:
    """The folder of examples: `water/boat.py`, `rov.py`, `fish.py`, `sea.py`, `survey.py`; `tether/`."""
    return str(root() / "examples")


def library() -> str:
    """The plugin library, for `mujoco.mj_loadPluginLibrary` where `import mujoco` did not load it, or for C."""
    return str(built_library())
