"""Many threads that create, step and free models at once; each must get the run that one thread alone gets.

The registry of checkpoints and instances is the only thing that simulations share, and it is this that is stressed: the
same checkpoints and definitions come and go on all threads. MuJoCo frees the interpreter's lock while it steps.
"""

import itertools
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco import batch, rollout

from ..released import RELEASED
from . import motion
from .catalogue import Effect
from .scenes import robot, vehicle

#: Steps of a run.
STEPS = 50
#: Effects that a vehicle has at a time.
AT_ONCE = 4


@dataclass
class Count:
    """Models made and runs that differed, over all threads."""

    models: int = 0
    runs: int = 0
    broken: int = 0


def makers(effects: Sequence[Effect]) -> list[Callable[[], mujoco.MjModel]]:
    """Functions that compile a model, each for itself."""
    made: list[Callable[[], mujoco.MjModel]] = [lambda name=name: robot(name, [], "Euler") for name in RELEASED]
    for first in range(0, len(effects), AT_ONCE):
        group = list(effects[first : first + AT_ONCE])
        made.append(lambda group=group: vehicle(group, "implicitfast", True))
    return made


def stress(effects: Sequence[Effect], threads: int, seconds: float) -> Count:
    """Create, step and free on `threads` threads for a time; then step in a batch and in rollouts of as many."""
    # What a checkpoint outside its training range says is not the matter here.
    mujoco.set_mju_user_warning(lambda text: None)
    made = makers(effects)
    expected = [_run(make()) for make in made]
    count, guard = Count(), threading.Lock()
    end = time.monotonic() + seconds

    def work(first: int) -> None:
        for turn in itertools.count(first):
            if time.monotonic() > end:
                return
            index = turn % len(made)
            same = _run(made[index]()) == expected[index]
            with guard:
                count.models += 1
                count.runs += 1
                count.broken += not same

    workers = [threading.Thread(target=work, args=(number,)) for number in range(threads)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    for make, state in zip(made, expected):
        for same in _together(make(), threads, state):
            count.runs += 1
            count.broken += not same
    return count


def _run(model: mujoco.MjModel) -> bytes:
    data = mujoco.MjData(model)
    motion.start(model, data, "violent", 1)
    mujoco.mj_step(model, data, STEPS)
    return _state(model, data).tobytes()


def _state(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    state = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, state, kind)
    return state


def _together(model: mujoco.MjModel, threads: int, expected: bytes) -> Iterator[bool]:
    """A batch, and a rollout, of as many simulations as threads, all from the same start."""
    data = mujoco.MjData(model)
    motion.start(model, data, "violent", 1)
    begin = _state(model, data)
    many = batch.Batch(model, threads, threads)
    for name in ("qpos", "qvel"):
        many.bind(name)[:] = getattr(data, name)
    many.step(nstep=STEPS)
    for number in range(threads):
        yield _state(model, many.get_data(number)).tobytes() == expected
    each = [mujoco.MjData(model) for _ in range(threads)]
    with rollout.Rollout(nthread=threads) as runner:
        states, _ = runner.rollout(model, each, np.tile(begin, (threads, 1)), nstep=STEPS)
    for number in range(threads):
        yield states[number, -1].tobytes() == expected
