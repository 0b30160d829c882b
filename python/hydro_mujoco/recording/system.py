"""A compiled model, ready to be recorded: what moves, which numbers are features, where the water's wrench is read."""

import pickle
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Protocol

import mujoco
import numpy as np

from ..plugin import load_plugin
from .features import OUTPUTS, Layout


@dataclass(frozen=True)
class Compiled:
    """A model that can be sent to another process: the plugin library that it needs is loaded there first."""

    model: mujoco.MjModel
    library: Path | None = None

    def __reduce__(self) -> tuple:
        return _restored, (pickle.dumps(self.model), self.library)


def _restored(content: bytes, library: Path | None) -> Compiled:
    if library is not None:
        load_plugin(library)
    return Compiled(pickle.loads(content), library)


@dataclass(frozen=True)
class Lift:
    """`body_gravcomp` by the density of the water: `fixed` + density x `by_density`, [nbody] each."""

    fixed: np.ndarray
    by_density: np.ndarray

    def at(self, density: np.ndarray) -> np.ndarray:
        """Its values [m, nbody] at densities [m] kg/m^3."""
        return self.fixed + density[:, None] * self.by_density


class Meter(Protocol):
    """Reads a wrench that MuJoCo does not keep in joint space."""

    def read(self, state: dict[str, np.ndarray]) -> np.ndarray:
        """Wrench [m, 6] on the base, base frame, at states by field: qpos, qvel, time, plugin_state [m, ...]."""
        ...


@dataclass(frozen=True)
class Bounds:
    """Speeds beyond which a simulation has exploded: the base's [m/s], of its rotation and of joints [rad/s]."""

    speed: float
    rate: float


@dataclass(frozen=True)
class System:
    """A model whose trajectories are recorded.

    base: number of the body whose frame is the base frame.
    outputs: components of the wrench that are recorded, of `features.OUTPUTS`.
    has_fluid: MuJoCo's own fluid counts. lift: `gravcomp` counts, as buoyancy.
    meter: makes what reads the rest of the water's wrench, for m simulations; still_meter: the buoyancy in that.
    """

    compiled: Compiled
    sample_period: float
    base: int
    layout: Layout
    outputs: tuple[int, ...] = tuple(range(len(OUTPUTS)))
    has_fluid: bool = True
    lift: Lift | None = None
    meter: Callable[[int], Meter] | None = None
    still_meter: Callable[[int], Meter] | None = None
    bounds: Bounds | None = None

    @property
    def model(self) -> mujoco.MjModel:
        """The compiled model."""
        return self.compiled.model

    @property
    def knows_buoyancy(self) -> bool:
        """True where the buoyancy in the wrench is told."""
        return self.lift is not None or self.still_meter is not None

    @property
    def substeps(self) -> int:
        """Physics steps in a sample."""
        return round(self.sample_period / self.model.opt.timestep)

    @cached_property
    def turning(self) -> list[int]:
        """Degrees of freedom of the base's tree, less those that translate the base."""
        model = self.model
        root = model.body_rootid[self.base]
        of_tree = [i for i in range(model.nv) if model.body_rootid[model.dof_bodyid[i]] == root]
        return [i for i in of_tree if i not in self.layout.base.translating]
