"""What the instances of `hydro.wrench` of a compiled model say."""

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco

from ..errors import DataError
from ..plugin import attribute, built_library, load_plugin, loaded_copies
from ..reading import read_json
from ..recording.kinematics import name_of

#: Folders between a project and its library, at most (src/plugin/search_path.rs).
LEVELS = 3


def instance_about(model: mujoco.MjModel, body: int) -> int:
    """The instance that a body or the nearest body above it carries, else the only one of the model: its water.

    Raises:
        DataError: there is none, or more than one; the message lists the bodies that carry one.
    """
    load_plugin()
    above = body
    while above > 0:
        if _is_water(model, int(model.body_plugin[above])):
            return int(model.body_plugin[above])
        above = int(model.body_parentid[above])
    if len(only := instances(model)) == 1:
        return only[0]
    carriers = [name_of(model, each) for each in range(model.nbody) if _is_water(model, int(model.body_plugin[each]))]
    there = ", ".join(f"`{name}`" for name in carriers) or "none"
    raise DataError(
        f"body `{name_of(model, body)}` and those above it carry no hydro.wrench; these do: {there}. "
        "hydro_mujoco.add_water gives a body one"
    )


def instances(model: mujoco.MjModel) -> list[int]:
    """All instances of `hydro.wrench` of a model."""
    return [each for each in range(model.nplugin) if _is_water(model, each)]


def number(model: mujoco.MjModel, instance: int, name: str) -> float | None:
    """An attribute that is one number, None where it is not given."""
    text = (attribute(model, instance, name) or "").strip()
    return float(text) if text else None


def document(model: mujoco.MjModel, instance: int, name: str) -> dict[str, Any] | None:
    """An attribute that is JSON or the path of a file with it, None where it is not given.

    Raises:
        DataError: the file is gone, cannot be read, or holds no JSON any more.
    """
    text = (attribute(model, instance, name) or "").strip()
    if not text:
        return None
    if not text.startswith("{"):
        path = find(text)
        if path is None:
            raise DataError(f"attribute `{name}`: {text} is no file any more")
        return read_json(path, f"attribute `{name}`, {path}")
    try:
        return json.loads(text)
    except ValueError as error:
        raise DataError(f"attribute `{name}`: {error}; expected JSON") from error


def find(text: str) -> Path | None:
    """The file or folder that an attribute names, where the plugin looks for it; None where there is none."""
    return next((place for place in _places(text) if place.exists()), None)


def _is_water(model: mujoco.MjModel, instance: int) -> bool:
    return instance >= 0 and attribute(model, instance, "waterline") is not None


def _places(text: str) -> Iterator[Path]:
    """Where the plugin looks for a file: HYDRO_PATH, working directory, the library's folder, the project above it."""
    yield from (Path(folder, text) for folder in os.environ.get("HYDRO_PATH", "").split(os.pathsep) if folder)
    yield Path(text)
    library = next(iter(loaded_copies()), built_library())
    yield library.parent / text
    above = list(library.parents)[: LEVELS + 1]
    yield from (folder / text for folder in above if (folder / "models").is_dir())
    # A bare name is that of a checkpoint.
    yield from (folder / "models" / text for folder in above if Path(text).name == text)
