"""Trajectories of the Task 2 data set."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hydro_mujoco.recording import shards
from hydro_mujoco.recording.plan import Plan, Stream
from hydro_mujoco.recording.simulation import Recording
from hydro_mujoco.recording.system import System

from . import plan
from .regime import Regime
from .scene import Scene
from .waters import ELLIPSOID, IN_INERTIA, Water

#: Noise added at each step, as a share of the standard deviation of each clean component.
PERTURBATION = 0.1
#: Trajectories of the pilot that measures that deviation, whatever the size of the data set.
PILOT = 64


@dataclass(frozen=True)
class Task2:
    """Makes the plans of Task 2; a `hydro_mujoco.recording.shards.Recorder`."""

    scene: Scene
    regime: Regime
    seed: int
    samples: int
    water: Water = ELLIPSOID
    #: One of `plan.SWITCHING`.
    switch: str = plan.MIXED

    #: A trajectory that diverges is a fault of the scene.
    attempts = 1

    @property
    def system(self) -> System:
        """The scene, as it is recorded."""
        return self.scene.system

    def plan(self, stream: int, index: int, attempt: int) -> Plan:
        """A trajectory."""
        return plan.task2(
            self.seed,
            stream,
            index,
            samples=self.samples,
            joint_range=self.scene.joint_range,
            regime=self.regime,
            switch=self.switch,
        )

    def noise(self, stream: int, index: int) -> np.random.Generator:
        """Random numbers of its noise."""
        return plan.generator(self.seed, Stream.NOISE, stream, index, *self.regime.key)

    def simulate(self, plans: Sequence[Plan]) -> Recording:
        """What the plans lead to."""
        return self.water.simulate(self.scene, plans)

    @cached_property
    def _pilot(self) -> Recording:
        return shards.record(self, Stream.PILOT, 0, PILOT, drawn_again=[])[1]

    def pilot_std(self) -> np.ndarray:
        """Standard deviation [6] of the clean wrench over PILOT trajectories of the regime that are in no split."""
        return shards.deviation([self._pilot], self.system.outputs)

    def added_mass_share(self) -> np.ndarray:
        """Standard deviation [6] of the added mass's force on the base, over that of the wrench without buoyancy."""
        moving = self._pilot.wrench - self._pilot.hydrostatic
        if self.water.added_mass == IN_INERTIA:
            moving = moving + self._pilot.extra["added_mass"]
        parts = (self._pilot.extra["added_mass"], moving)
        added, whole = (values.reshape(-1, moving.shape[-1]).std(axis=0) for values in parts)
        return added / whole
