"""Many environments of a task, stepped by `mujoco.batch`."""

import os
from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from mujoco.batch import Batch

from ..errors import DataError
from .task import Start, State, Task, checked

#: Arrays of a simulation that make a `State`, and those of the batch.
_FIELDS = {
    "time": "time",
    "qpos": "qpos",
    "qvel": "qvel",
    "ctrl": "ctrl",
    "goal": "mocap_pos",
    "goal_quaternion": "mocap_quat",
}


class WaterVectorEnv(VectorEnv):
    """Environments of a task as Gymnasium's VectorEnv; bit for bit those of `SyncVectorEnv`, at any thread count.

    An environment's episode runs in one of the task's models, so there is a batch for each model, with a row for each
    environment; a step calls each batch for the rows that are in it.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self,
        task: Task,
        num_envs: int,
        max_episode_steps: int,
        *,
        nthread: int = 0,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
    ):
        """Make the simulations.

        Args:
            task: what is done.
            num_envs: environments.
            max_episode_steps: steps after which an episode is truncated.
            nthread: threads that step; 0: one a core, and no more than environments.
            autoreset_mode: when an environment whose episode ended starts anew: `NextStep` (the next step resets it
                and ignores its action) or `SameStep` (`info["final_obs"]` holds the last observation).

        Raises:
            DataError: a number below 1, or autoreset mode `Disabled`.
        """
        for name, number in (("num_envs", num_envs), ("max_episode_steps", max_episode_steps)):
            if number < 1:
                raise DataError(f"{name} is {number}; expected 1 or more")
        mode = AutoresetMode(autoreset_mode)
        if mode == AutoresetMode.DISABLED:
            raise DataError("autoreset_mode is Disabled; expected NextStep or SameStep")
        self.task = task
        self.num_envs = num_envs
        self.render_mode = None
        self.metadata = {**self.metadata, "autoreset_mode": mode, "render_fps": round(1 / self.dt)}
        self.single_observation_space = task.observation_space
        self.single_action_space = task.action_space
        self.observation_space = batch_space(task.observation_space, num_envs)
        self.action_space = batch_space(task.action_space, num_envs)
        threads = min(nthread or len(os.sched_getaffinity(0)), num_envs)
        self._same_step = mode == AutoresetMode.SAME_STEP
        self._most_steps = max_episode_steps
        self._batches = [Batch(model, num_envs, threads) for model in task.models]
        self._batch_of = np.zeros(num_envs, dtype=np.intp)
        self._random: list[np.random.Generator | None] = [None] * num_envs
        self._steps = np.zeros(num_envs, dtype=np.int64)
        self._ended = np.zeros(num_envs, dtype=bool)

    @property
    def dt(self) -> float:
        """Seconds a step."""
        return self.task.models[0].opt.timestep * self.task.frame_skip

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start an episode everywhere, or where `options["reset_mask"]` (bool, shape (num_envs,)) is True.

        seed: one a environment, or a number, which stands for seed, seed + 1, ...; None: each goes on drawing.

        Raises:
            DataError: another number of seeds than of environments, or a mask of another shape or type.
        """
        seeds = [int(seed) + number for number in range(self.num_envs)] if isinstance(seed, int | np.integer) else seed
        if seeds is not None and len(seeds) != self.num_envs:
            raise DataError(f"seed: {len(seeds)} seeds for {self.num_envs} environments; expected one each")
        mask = (options or {}).get("reset_mask")
        if mask is None:
            mask = np.ones(self.num_envs, dtype=bool)
        elif not isinstance(mask, np.ndarray) or mask.dtype != bool or mask.shape != (self.num_envs,):
            raise DataError(f"options['reset_mask'] is {mask!r}; expected an array of {self.num_envs} bool")
        for row in np.flatnonzero(mask).tolist():
            if self._random[row] is None or (seeds is not None and seeds[row] is not None):
                self._random[row], _ = seeding.np_random(None if seeds is None else seeds[row])
        self._start(np.flatnonzero(mask))
        return self.task.observe(self._state()), {}

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        if None in self._random:
            raise ResetNeeded("step before reset: call reset() of all environments first")
        action = checked(actions, (self.num_envs, *self.task.action_space.shape))
        again = self._ended.copy()
        if again.any():
            self._start(np.flatnonzero(again))
        state = self._state()
        controls = self.task.controls(state, action)
        for batch, rows in self._members(~again):
            batch.bind("ctrl")[rows] = controls[rows]
            batch.step(rows.astype(np.int32), nstep=self.task.frame_skip)
        self._steps[~again] += 1
        # Of an environment that has just started anew, the step's start is before its start.
        outcome = self.task.outcome(self._state(), np.where(again, -np.inf, state.time))
        observation = outcome.observation
        reward = np.where(again, 0.0, outcome.reward)
        terminated = outcome.terminated & ~again
        truncated = (self._steps >= self._most_steps) & ~again
        infos: dict[str, Any] = {}
        ended = terminated | truncated
        went_on = ~again & ~(ended & self._same_step)
        for name, values in outcome.info.items():
            if went_on.any():
                infos[name], infos[f"_{name}"] = np.where(went_on, values, 0.0), went_on.copy()
        if self._same_step and ended.any():
            for row in np.flatnonzero(ended).tolist():
                last = {name: float(values[row]) for name, values in outcome.info.items()}
                self._add_info(infos, {"final_obs": observation[row].copy(), "final_info": last}, row)
            self._start(np.flatnonzero(ended))
            observation[ended] = self.task.observe(self._state())[ended]
        self._ended = np.zeros_like(ended) if self._same_step else ended
        return observation, reward, terminated, truncated, infos

    def simulation(self, row: int) -> tuple[mujoco.MjModel, mujoco.MjData]:
        """Model and data of an environment, to draw it or to pass it to any function of MuJoCo."""
        batch = self._batches[self._batch_of[row]]
        model, data = batch.get_model(row), batch.get_data(row)
        mujoco.mj_forward(model, data)
        return model, data

    def close_extras(self, **kwargs: Any) -> None:
        """Let the simulations and their threads go."""
        self._batches.clear()

    def _start(self, rows: np.ndarray) -> None:
        """Draw an episode in each of these environments and start it."""
        starts: dict[int, Start] = {int(row): self.task.start(self._random[row]) for row in rows}
        self._batch_of[rows] = [start.model for start in starts.values()]
        self._steps[rows] = 0
        self._ended[rows] = False
        chosen = np.zeros(self.num_envs, dtype=bool)
        chosen[rows] = True
        for batch, members in self._members(chosen):
            ids = members.astype(np.int32)
            batch.reset(ids, stage=mujoco.mjtStage.mjSTAGE_NONE.value)
            for row in ids:
                for field, of_batch in _FIELDS.items():
                    batch.bind(of_batch)[row] = getattr(starts[int(row)], field)

    def _members(self, chosen: np.ndarray) -> Iterator[tuple[Batch, np.ndarray]]:
        """Each batch with the chosen environments that are in it, where there are any."""
        for number, batch in enumerate(self._batches):
            rows = np.flatnonzero(chosen & (self._batch_of == number))
            if rows.size:
                yield batch, rows

    def _state(self) -> State:
        fields: dict[str, np.ndarray] = {}
        for field, of_batch in _FIELDS.items():
            values = np.empty_like(self._batches[0].bind(of_batch), order="C")
            for batch, rows in self._members(np.ones(self.num_envs, dtype=bool)):
                values[rows] = batch.bind(of_batch)[rows]
            fields[field] = values[:, 0] if of_batch.startswith("mocap") else values
        return State(**fields)
