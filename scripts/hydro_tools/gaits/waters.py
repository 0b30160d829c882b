"""The waters in which B1 learns and is judged, each with the same foam that trims it to near neutral."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import mujoco
import numpy as np
from mujoco.batch import Batch

import hydro_mujoco
from hydro_mujoco.envs.b1_tasks import TRIM
from hydro_mujoco.plugin import load_plugin

from ..datasets import DataError, scene
from ..repository import ROOT
from ..strip_water import forces, strips
from ..strip_water.simulation import Simulation, dry
from .generator import PERIOD

#: Drag fitted to the training split of Task 2: `fit_drag.py --out`.
DRAG = Path(__file__).with_name("drag.json")


class Pool(Protocol):
    """n robots in one water, stepped together. Arrays [n, ...] as MuJoCo has them, live."""

    time: np.ndarray
    qpos: np.ndarray
    qvel: np.ndarray
    force: np.ndarray

    def start(self, qpos: np.ndarray, qvel: np.ndarray, ctrl: np.ndarray) -> None:
        """Begin at time 0 in these states."""

    def step(self, ctrl: np.ndarray) -> None:
        """Go on by `PERIOD` with these commands [n, nu]; `force` [n, nu] is then that of the servos."""


class BatchPool:
    """Simulations of one model by `mujoco.batch`: the same bits at any number of threads."""

    def __init__(self, model: mujoco.MjModel, robots: int, threads: int):
        self._batch = Batch(model, robots, min(threads, robots))
        self._substeps = round(PERIOD / model.opt.timestep)
        bind = self._batch.bind
        self.time, self.qpos, self.qvel, self.force = bind("time"), bind("qpos"), bind("qvel"), bind("actuator_force")

    def start(self, qpos: np.ndarray, qvel: np.ndarray, ctrl: np.ndarray) -> None:
        self._batch.reset(stage=mujoco.mjtStage.mjSTAGE_NONE.value)
        self.qpos[:], self.qvel[:], self._batch.bind("ctrl")[:] = qpos, qvel, ctrl

    def step(self, ctrl: np.ndarray) -> None:
        self._batch.bind("ctrl")[:] = ctrl
        self._batch.step(nstep=self._substeps)


class StripPool:
    """Simulations in strip theory with added mass and wakes (`hydro_tools.strip_water`), in numpy: ten times slower."""

    def __init__(self, model: mujoco.MjModel, robots: int, threads: int):
        del threads
        self._run = Simulation(dry(model), forces.water(model, strips.b1()), robots)
        self._substeps = round(PERIOD / model.opt.timestep)
        self._foam = model.body(scene.BASE).id
        self._read()

    def _read(self) -> None:
        datas = self._run.datas
        self.time = np.array([data.time for data in datas])
        self.qpos, self.qvel = np.stack([data.qpos for data in datas]), np.stack([data.qvel for data in datas])
        self.force = np.stack([data.actuator_force for data in datas])

    def start(self, qpos: np.ndarray, qvel: np.ndarray, ctrl: np.ndarray) -> None:
        for data, *state in zip(self._run.datas, qpos, qvel, ctrl):
            mujoco.mj_resetData(self._run.model, data)
            data.qpos[:], data.qvel[:], data.ctrl[:] = state
            data.xfrc_applied[self._foam, 2] = TRIM
        self._run.settle(range(len(self._run.datas)))
        self._read()

    def step(self, ctrl: np.ndarray) -> None:
        ids = range(len(self._run.datas))
        for data, command in zip(self._run.datas, ctrl):
            data.ctrl[:] = command
        for _ in range(self._substeps):
            self._run.step(ids)
        self._read()


@dataclass(frozen=True)
class Water:
    """A water by name, what acts in it, and the name of the water that it stands for."""

    name: str
    what: str
    spec: Callable[[], mujoco.MjSpec]
    stands_for: str
    pool: Callable[[mujoco.MjModel, int, int], Pool] = BatchPool

    def model(self) -> mujoco.MjModel:
        """B1 in this water, its foam at the trunk's centre of mass."""
        spec = self.spec()
        trunk = spec.body(scene.BASE)
        gravity = float(np.linalg.norm(spec.option.gravity))
        trunk.gravcomp = TRIM / (trunk.mass * gravity)
        model = spec.compile()
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SENSOR
        return model

    def robots(self, number: int, threads: int) -> Pool:
        """So many robots in this water."""
        return self.pool(self.model(), number, threads)


def _scene(name: str) -> mujoco.MjSpec:
    load_plugin()
    return mujoco.MjSpec.from_file(str(ROOT / "mjcf" / f"{name}.xml"))


def _learned(checkpoint: str, **attributes: str) -> mujoco.MjSpec:
    spec = _scene("b1_swim")
    water = spec.plugins[0]
    water.config = {**water.config, "checkpoint": str(ROOT / "models" / checkpoint), **attributes}
    return spec


def _drag() -> mujoco.MjSpec:
    spec = _scene("b1_truth")
    spec.option.density = spec.option.viscosity = 0.0
    try:
        fitted = json.loads(DRAG.read_text(encoding="utf-8"))
        effects = {
            f"{kind}_drag": {"point": [0, 0, 0], "matrix": np.diag(np.array(fitted[kind], float).reshape(6))}
            for kind in ("linear", "quadratic")
        }
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise DataError(f"{DRAG}: {error}; expected what `fit_drag.py --out` writes") from error
    return hydro_mujoco.add_water(spec, body=scene.BASE, effects=effects)


WATERS = {
    water.name: water
    for water in (
        Water("learned", "models/b1-relaxation: a wrench on the trunk", lambda: _learned("b1-relaxation"), "truth"),
        Water("drag", "linear and quadratic drag of the trunk, fitted to Task 2; exact buoyancy", _drag, "truth"),
        Water("box", "MuJoCo's inertia box on every link; exact buoyancy", lambda: _scene("b1_box_fluid"), "truth"),
        Water("truth", "MuJoCo's ellipsoid fluid on every link, as identified", lambda: _scene("b1_truth"), "truth"),
        Water(
            "strip-learned",
            "models/b1-strip: a wrench on the trunk, torques on the joints",
            lambda: _learned("b1-strip"),
            "strip",
        ),
        Water(
            "strip-wrench",
            "models/b1-strip, its joint torques left out",
            lambda: _learned("b1-strip", outputs="wrench"),
            "strip",
        ),
        Water("strip", "strip theory with added mass and wakes", lambda: _scene("b1_truth"), "strip", StripPool),
    )
}
#: The waters that others stand for, each with what it is called.
TRUTHS = {"truth": "MuJoCo's ellipsoid fluid", "strip": "strip theory"}


def water(name: str) -> Water:
    """The water of a name.

    Raises:
        DataError: there is none.
    """
    if name not in WATERS:
        raise DataError(f"water is {name!r}; there are: {', '.join(WATERS)}")
    return WATERS[name]
