"""Tasks of the quadruped B1 in learned water: swim, hold, waypoint."""

import os
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
from gymnasium.spaces import Box

from .. import packaged
from ..errors import DataError
from ..plugin import load_plugin
from .attitude import about_axis, about_z, dot, product, rotation, to_body
from .scenery import add_goal
from .task import Start, State, Task, nearness

#: Lift of foam at the centre of mass [N]: the weight of 62.58 kg that the 58 L of the hulls do not carry.
TRIM = (62.58 - 58.0) * 9.81
#: Physics steps of 2 ms a step.
FRAME_SKIP = 10
#: Joint angles about which actions move, hip, thigh, calf [rad], and how far: what the released checkpoints have seen.
MIDDLE = np.tile([0.0, 0.75, -1.5], 4)
REACH = np.tile([0.65, 1.1, 0.85], 4)
#: Fastest target of a joint [rad/s].
FASTEST = 6.0
#: An episode ends this far from the goal's depth [m], and where the trunk's z axis is below the horizon.
DEEPEST = 1.5
#: Greatest turn and speeds of a start: [rad], [m/s], [rad/s].
TILT, DRIFT, SPIN = 0.15, 0.05, 0.1
#: Elements of an observation.
WIDTH = 3 + 3 + 3 + 12 + 12 + 12 + 3 + 3


class B1Task(Task):
    """What the three tasks share."""

    frame_skip = FRAME_SKIP
    observation_space = Box(-np.inf, np.inf, (WIDTH,), np.float64)
    action_space = Box(-1.0, 1.0, (12,), np.float32)

    def __init__(self, checkpoint: str | os.PathLike = "b1-relaxation"):
        """Compile the scene.

        checkpoint: name of a released one, or the folder of one that was trained for B1.
        """
        folder = Path(checkpoint)
        known = folder if (folder / "card.json").is_file() else packaged.checkpoint(os.fspath(checkpoint))
        load_plugin()
        self.scene = packaged.scene("b1_swim")
        spec = mujoco.MjSpec.from_file(self.scene)
        foam = '{"schema": "hydro-effects/1", "effects": [{"effect": "net_buoyancy", "target": "trunk", "parameters": '
        foam += f'{{"force": {TRIM!r}}}}}]}}'
        water = spec.plugins[0]
        water.config = {**water.config, "checkpoint": str(Path(known).resolve()), "effects": foam}
        add_goal(spec, 0.08)
        self.models = (spec.compile(),)
        self._home = self.models[0].key_qpos[0].copy()
        self._period = self.frame_skip * self.models[0].opt.timestep

    def start(self, random: np.random.Generator) -> Start:
        goal, goal_quaternion = self.goal(random)
        heading = random.uniform(-np.pi, np.pi)
        tilt = about_axis(random.normal(size=3), random.uniform(0, TILT))
        qpos = self._home.copy()
        qpos[3:7] = product(about_z(heading), tilt)
        qpos[7:] += random.uniform(-0.1, 0.1, 12)
        qvel = np.zeros(18)
        qvel[:3], qvel[3:6] = random.uniform(-DRIFT, DRIFT, 3), random.uniform(-SPIN, SPIN, 3)
        turned = product(about_z(heading), goal_quaternion)
        place = rotation(about_z(heading)[None])[0] @ goal
        return Start(0, 0.0, qpos, qvel, qpos[7:].copy(), place, turned)

    def goal(self, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """The goal's pose as seen from the start, x forward: position [m], quaternion."""
        return np.zeros(3), about_z(0.0)

    def controls(self, state: State, action: np.ndarray) -> np.ndarray:
        most = FASTEST * self._period
        return state.ctrl + np.clip(MIDDLE + REACH * action - state.ctrl, -most, most)

    def observe(self, state: State) -> np.ndarray:
        return np.concatenate(
            [
                state.axes[:, 2],
                state.qvel[:, 3:6],
                to_body(state.axes, state.qvel[:, :3]),
                (state.qpos[:, 7:] - MIDDLE) / REACH,
                state.qvel[:, 6:] / FASTEST,
                (state.ctrl - MIDDLE) / REACH,
                to_body(state.axes, state.offset),
                to_body(state.axes, state.forward),
            ],
            axis=1,
        )

    def measures(self, state: State) -> dict[str, np.ndarray]:
        return {
            "distance": state.distance,
            "depth_error": state.offset[:, 2],
            "forward_speed": state.forward_speed,
            "upright": state.upright,
        }

    def ended(self, state: State) -> np.ndarray:
        return (np.abs(state.offset[:, 2]) > DEEPEST) | (state.upright < 0)

    def _common(self, state: State) -> dict[str, np.ndarray]:
        """Terms of every task: attitude, depth, effort."""
        joints = state.qvel[:, 6:] / FASTEST
        return {
            "reward_upright": 0.5 * state.upright,
            "reward_depth": -0.5 * np.abs(state.offset[:, 2]),
            "reward_effort": -0.02 * np.sum(joints * joints, axis=1),
        }


class Swim(B1Task):
    """Swim forward, in the direction of the goal's x axis."""

    def terms(self, state: State) -> dict[str, np.ndarray]:
        return {
            "reward_forward": 10.0 * state.forward_speed,
            "reward_heading": 0.5 * state.alignment,
            **self._common(state),
        }


class Hold(B1Task):
    """Hold place, depth and attitude at the goal's pose."""

    def terms(self, state: State) -> dict[str, np.ndarray]:
        return {
            "reward_place": nearness(state.distance),
            "reward_heading": 0.5 * state.alignment,
            **self._common(state),
        }


class Waypoint(B1Task):
    """Go to the goal's position, 1.5 to 3 m ahead and up to 60 degrees aside, up to 0.4 m up or down."""

    #: Distance at which it is reached [m], and the reward of that.
    reached, bonus = 0.3, 500.0

    def goal(self, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        angle, far = random.uniform(-np.pi / 3, np.pi / 3), random.uniform(1.5, 3.0)
        place = np.array([far * np.cos(angle), far * np.sin(angle), random.uniform(-0.4, 0.4)])
        return place, about_z(angle)

    def terms(self, state: State) -> dict[str, np.ndarray]:
        toward = state.offset / np.maximum(state.distance, 1e-9)[:, None]
        return {
            "reward_progress": 10.0 * dot(state.qvel[:, :3], toward),
            "reward_reached": np.where(state.distance < self.reached, self.bonus, 0.0),
            **self._common(state),
        }

    def ended(self, state: State) -> np.ndarray:
        return super().ended(state) | (state.distance < self.reached)


#: Name -> task.
TASKS: dict[str, Callable[..., B1Task]] = {"swim": Swim, "hold": Hold, "waypoint": Waypoint}


def b1_task(name: str, checkpoint: str | os.PathLike) -> B1Task:
    """The task of a name.

    Raises:
        DataError: there is none of this name, or no such checkpoint.
    """
    if name not in TASKS:
        raise DataError(f"task is {name!r}; there are: {', '.join(TASKS)}")
    return TASKS[name](checkpoint)
