"""A task: pure functions of MuJoCo's state, many environments at once, one a row.

All that an episode remembers is in MuJoCo's state: the goal is the pose of the mocap body `goal`.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np
from gymnasium.spaces import Box

from ..errors import DataError
from .attitude import dot, length, rotation


@dataclass(frozen=True)
class Start:
    """The start of an episode of one environment."""

    #: Which of the task's models.
    model: int
    #: Time [s]: where in the wave train.
    time: float
    #: Shapes (nq,), (nv,), (nu,).
    qpos: np.ndarray
    qvel: np.ndarray
    ctrl: np.ndarray
    #: Pose of the goal: position [m], shape (3,), quaternion w x y z, shape (4,).
    goal: np.ndarray
    goal_quaternion: np.ndarray


@dataclass(frozen=True)
class State:
    """State of n environments: MuJoCo's arrays, one row each, and what follows from them."""

    #: [s], shape (n,).
    time: np.ndarray
    #: Shapes (n, nq), (n, nv), (n, nu).
    qpos: np.ndarray
    qvel: np.ndarray
    ctrl: np.ndarray
    #: Pose of the goal, shapes (n, 3), (n, 4).
    goal: np.ndarray
    goal_quaternion: np.ndarray

    @cached_property
    def axes(self) -> np.ndarray:
        """Axes of the free body in the world, its columns, shape (n, 3, 3)."""
        return rotation(self.qpos[:, 3:7])

    @cached_property
    def upright(self) -> np.ndarray:
        """Cosine of the tilt, shape (n,)."""
        return self.axes[:, 2, 2]

    @cached_property
    def offset(self) -> np.ndarray:
        """From the free body to the goal, in the world [m], shape (n, 3)."""
        return self.goal - self.qpos[:, :3]

    @cached_property
    def distance(self) -> np.ndarray:
        """From the free body to the goal [m], shape (n,)."""
        return length(self.offset)

    @cached_property
    def forward(self) -> np.ndarray:
        """The goal's x axis in the world, shape (n, 3)."""
        return rotation(self.goal_quaternion)[:, :, 0]

    @cached_property
    def alignment(self) -> np.ndarray:
        """Cosine between the x axes of the free body and the goal, shape (n,)."""
        return dot(self.axes[:, :, 0], self.forward)

    @cached_property
    def forward_speed(self) -> np.ndarray:
        """Along the goal's x axis [m/s], shape (n,)."""
        return dot(self.qvel[:, :3], self.forward)


@dataclass(frozen=True)
class Outcome:
    """What a step gave n environments."""

    #: Shape (n, k).
    observation: np.ndarray
    #: Shape (n,).
    reward: np.ndarray
    #: Shape (n,).
    terminated: np.ndarray
    #: Terms of the reward and measures, by name, each of shape (n,).
    info: dict[str, np.ndarray]


class Task(ABC):
    """Models, spaces, start, observation and reward."""

    #: MJCF that the models are made of.
    scene: str
    #: One a water; an episode runs in one of them.
    models: tuple[mujoco.MjModel, ...]
    #: Physics steps a step of the environment.
    frame_skip: int
    observation_space: Box
    action_space: Box

    @abstractmethod
    def start(self, random: np.random.Generator) -> Start:
        """Draw the start of an episode."""

    @abstractmethod
    def controls(self, state: State, action: np.ndarray) -> np.ndarray:
        """Controls of the actuators, shape (n, nu), for actions between -1 and 1, shape (n, nu)."""

    @abstractmethod
    def observe(self, state: State) -> np.ndarray:
        """Observations, shape (n, k)."""

    @abstractmethod
    def terms(self, state: State) -> dict[str, np.ndarray]:
        """Terms of the reward, each of shape (n,); the reward is their sum in this order."""

    @abstractmethod
    def measures(self, state: State) -> dict[str, np.ndarray]:
        """What `info` holds beside the terms, each of shape (n,)."""

    @abstractmethod
    def ended(self, state: State) -> np.ndarray:
        """True where an episode ends, shape (n,)."""

    def outcome(self, state: State, before: np.ndarray) -> Outcome:
        """What a step gave.

        before: time at the step's start [s], shape (n,). A simulation that blew up, which MuJoCo starts anew, ends its
        episode with a reward and an observation of zeros.
        """
        steady = (state.time > before) & np.isfinite(state.qpos).all(axis=1) & np.isfinite(state.qvel).all(axis=1)
        with np.errstate(invalid="ignore", over="ignore"):
            terms = self.terms(state)
            info = {name: np.where(steady, values, 0.0) for name, values in {**terms, **self.measures(state)}.items()}
            observation = np.where(steady[:, None], self.observe(state), 0.0)
            ended = self.ended(state) | ~steady
        reward = np.zeros(len(before))
        for name in terms:
            reward = reward + info[name]
        return Outcome(observation, reward, ended, info)


def nearness(distance: np.ndarray) -> np.ndarray:
    """1 at the goal, a half at 0.25 m from it, falling with the square of the distance [m]."""
    scaled = distance / 0.25
    return 1 / (1 + scaled * scaled)


def checked(action: object, shape: tuple[int, ...]) -> np.ndarray:
    """An action as numbers between -1 and 1, clipped.

    Raises:
        DataError: it has another shape, or a number in it is not finite.
    """
    numbers = np.asarray(action, dtype=np.float64)
    if numbers.shape != shape:
        raise DataError(f"action: its shape is {numbers.shape}, expected {shape}")
    if not np.isfinite(numbers).all():
        wrong = np.argwhere(~np.isfinite(numbers))[0]
        place = ", ".join(map(str, wrong))
        raise DataError(f"action[{place}] is {numbers[tuple(wrong)]}; expected a number between -1 and 1")
    return np.clip(numbers, -1.0, 1.0)
