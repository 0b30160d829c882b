"""The attributes of an instance that belong to its checkpoint."""

from dataclasses import dataclass, field

import mujoco
import numpy as np

from ...errors import DataError
from ...plugin import attribute
from ...sea import attributes
from .card import Card, read_card

#: Density of fresh water [kg/m^3].
FRESH_WATER = 1000.0


@dataclass(frozen=True)
class Settings:
    """A checkpoint, and how it acts.

    Attributes:
        joints: what the card's are called in the model, if otherwise. outputs: `wrench`, `generalised` or nothing.
        initial_force: [N, N m], shape (f,); None: estimated. wrench_scale: factors on the wrench, shape (6,).
        density: of the water, as the network gets it [kg/m^3].
    """

    card: Card
    density: float
    joints: list[str] = field(default_factory=list)
    outputs: str = ""
    initial_force: np.ndarray | None = None
    wrench_scale: np.ndarray = field(default_factory=lambda: np.ones(6))


def settings(model: mujoco.MjModel, number: int, where: str) -> Settings | None:
    """The checkpoint of an instance that the plugin has read and found right; None without one.

    Raises:
        DataError: it is of a kind that MuJoCo Warp does not get, or its files are gone.
    """

    def text(name: str) -> str:
        return (attribute(model, number, name) or "").strip()

    if not text("checkpoint"):
        return None
    folder = attributes.find(text("checkpoint"))
    if folder is None:
        raise DataError(f"{where}: attribute `checkpoint`: {text('checkpoint')} is no folder any more")
    initial, scale = text("initial_force"), text("wrench_scale")
    density = attributes.number(model, number, "density")
    return Settings(
        card=read_card(folder, where, text("solver")),
        density=FRESH_WATER if density is None else density,
        joints=text("joints").split(),
        outputs=text("outputs"),
        initial_force=None if initial in ("", "estimate") else np.array(initial.split(), dtype=float),
        wrench_scale=np.array(scale.split(), dtype=float) if scale else np.ones(6),
    )
