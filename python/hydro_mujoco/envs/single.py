"""One environment of a task."""

from typing import Any

import mujoco
import numpy as np
from gymnasium.envs.mujoco import MujocoEnv
from gymnasium.spaces import Box

from .scenery import CAMERA
from .task import State, Task, checked


class WaterEnv(MujocoEnv):
    """A task as Gymnasium's MujocoEnv: `model` and `data` are those of the present episode's water."""

    metadata: dict[str, Any] = {"render_modes": ["human", "rgb_array", "depth_array", "rgbd_tuple"]}

    def __init__(self, task: Task, **kwargs: Any):
        """Make the simulations.

        kwargs: of MujocoEnv: render_mode, width, height, camera_id, camera_name, max_geom, visual_options,
            default_camera_config.
        """
        self.task = task
        # A free camera of Gymnasium's does not follow.
        if kwargs.get("camera_id") is None:
            kwargs.setdefault("camera_name", CAMERA)
        # Without the arrows of the plugin's force and torque.
        kwargs.setdefault("visual_options", {int(mujoco.mjtVisFlag.mjVIS_PERTOBJ): False})
        super().__init__(task.scene, task.frame_skip, task.observation_space, **kwargs)

    def reset_model(self) -> np.ndarray:
        """Draw an episode and start it; returns its first observation.

        MujocoEnv has reset the data of the last episode, and so all data that an episode was in.
        """
        start = self.task.start(self.np_random)
        self._take(start.model)
        data = self.data
        data.time, data.qpos[:], data.qvel[:], data.ctrl[:] = start.time, start.qpos, start.qvel, start.ctrl
        data.mocap_pos[0], data.mocap_quat[0] = start.goal, start.goal_quaternion
        mujoco.mj_forward(self.model, data)
        return self.task.observe(self._state())[0]

    # Python's floats, as Env has it; MujocoEnv has NumPy's.
    def step(  # type: ignore[override]
        self, action: np.ndarray
    ) -> tuple[np.ndarray, float, bool, bool, dict[str, float]]:
        action = checked(action, self.task.action_space.shape)
        before = np.array([self.data.time])
        self.do_simulation(self.task.controls(self._state(), action[None])[0], self.frame_skip)
        outcome = self.task.outcome(self._state(), before)
        if self.render_mode == "human":
            self.render()  # type: ignore[no-untyped-call]
        info = {name: float(values[0]) for name, values in outcome.info.items()}
        return outcome.observation[0], float(outcome.reward[0]), bool(outcome.terminated[0]), False, info

    def _initialize_simulation(self) -> tuple[mujoco.MjModel, mujoco.MjData]:
        """The first of the task's models; data are made where an episode first needs them."""
        for model in self.task.models:
            shown = model.vis.global_
            shown.offwidth, shown.offheight = max(shown.offwidth, self.width), max(shown.offheight, self.height)
        self._data: dict[int, mujoco.MjData] = {0: mujoco.MjData(self.task.models[0])}
        return self.task.models[0], self._data[0]

    def _set_action_space(self) -> Box:
        self.action_space = self.task.action_space
        return self.action_space

    def _take(self, number: int) -> None:
        """Make one of the task's models that of the episode, and of the pictures."""
        self.model = self.task.models[number]
        if number not in self._data:
            self._data[number] = mujoco.MjData(self.model)
        self.data = self._data[number]
        for shown in (self.mujoco_renderer, self.mujoco_renderer.viewer):
            if shown is not None:
                shown.model, shown.data = self.model, self.data

    def _state(self) -> State:
        data = self.data
        return State(
            time=np.array([data.time]),
            qpos=data.qpos[None],
            qvel=data.qvel[None],
            ctrl=data.ctrl[None],
            goal=data.mocap_pos[:1],
            goal_quaternion=data.mocap_quat[:1],
        )
