"""The catalogue of effects that `hydro gap` can name."""

import os
from dataclasses import dataclass
from typing import Any

from ..program import existing, run_json


@dataclass(frozen=True)
class Parameter:
    """A parameter of an effect.

    `null`, `prior_sd`, `lower` and `upper` are of the example in `hydro gap effects --json`, in `unit`; None:
    unbounded. `optional`: a file of effects may leave it out.
    """

    name: str
    unit: str
    null: float
    prior_sd: float
    lower: float | None
    upper: float | None
    optional: bool


@dataclass(frozen=True)
class Effect:
    """An effect: what it acts on (`body`, `joint`, `actuator`, `sensor`, ...), its equation, its source, its
    parameters.

    `idealised`: nature's form differs a little from the equation. `placement`: where a patched model holds it.
    """

    id: str
    target: str
    summary: str
    equation: str
    source: str
    idealised: bool
    placement: str
    parameters: tuple[Parameter, ...]


def effects(folder: str | os.PathLike[str] | None = None) -> dict[str, Effect]:
    """All effects by their ids, which do not change without a new schema.

    Args:
        folder: of effects of your own, NAME.toml each (docs/own-effects.md); they follow the catalogue as `user.NAME`.

    Raises:
        DataError: the folder or an effect in it is at fault.

    >>> from hydro_mujoco import gap
    >>> drag = gap.effects()["quadratic_drag"]
    >>> drag.target, [(each.name, each.unit) for each in drag.parameters][0]
    ('body', ('surge', 'N s^2/m^2'))
    """
    words = [] if folder is None else ["--effects", str(existing("folder", folder))]
    found = run_json(["gap", "effects", *words], progress=False)
    return {entry["id"]: _effect(entry) for entry in found["effects"]}


def _effect(entry: dict[str, Any]) -> Effect:
    plain = {name: entry[name] for name in Effect.__dataclass_fields__ if name != "parameters"}
    parameters = tuple(
        Parameter(**{name: each.get(name) for name in Parameter.__dataclass_fields__}) for each in entry["parameters"]
    )
    return Effect(**plain, parameters=parameters)
