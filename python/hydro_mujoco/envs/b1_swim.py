"""`hydro_mujoco/B1Swim-v0`."""

import os
from typing import Any

from gymnasium.utils import EzPickle
from gymnasium.vector import AutoresetMode

from .b1_tasks import b1_task
from .single import WaterEnv
from .vector import WaterVectorEnv


class B1SwimEnv(WaterEnv, EzPickle):
    """
    ## Description
    A Unitree B1, a quadruped of 62.58 kg with twelve servos, under water: the force on its trunk is that of a trained
    checkpoint, evaluated by the plugin `hydro.wrench` every 10 ms (scene `b1_swim`). Foam of 44.9 N lift at the
    centre of mass trims it to near neutral: held still, it rises or sinks by up to 0.8 m in 15 s (20 starts,
    `b1-relaxation`). The tasks (argument `task`):

    - `swim`: swim in the direction of the goal's x axis, at the starting depth.
    - `hold`: stay at the goal's position and heading, which are those of the start.
    - `waypoint`: come within 0.3 m of a point 1.5 to 3 m ahead, up to 60 degrees aside, up to 0.4 m up or down.

    ## Action Space
    `Box(-1, 1, (12,), float32)`: targets of the servos (kp 200 N m/rad, kv 8 N m s/rad). Joint order FR, FL, RR, RL x
    hip, thigh, calf; a target moves at most 6 rad/s.

    | Num | Action | Min | Max | Target at 0 | at -1, 1 | Unit |
    | --- | ------ | --- | --- | ----------- | -------- | ---- |
    | 0, 3, 6, 9 | hip of FR, FL, RR, RL | -1 | 1 | 0 | -0.65, 0.65 | rad |
    | 1, 4, 7, 10 | thigh of FR, FL, RR, RL | -1 | 1 | 0.75 | -0.35, 1.85 | rad |
    | 2, 5, 8, 11 | calf of FR, FL, RR, RL | -1 | 1 | -1.5 | -2.35, -0.65 | rad |

    ## Observation Space
    `Box(-Inf, Inf, (51,), float64)`; axes are the trunk's, x forward, y left, z up.

    | Num | Observation | Min | Max | Unit |
    | --- | ----------- | --- | --- | ---- |
    | 0-2 | the vertical | -1 | 1 | 1 |
    | 3-5 | angular velocity | -Inf | Inf | rad/s |
    | 6-8 | velocity over ground | -Inf | Inf | m/s |
    | 9-20 | joint angles, less the angle at action 0, over the reach of the action | -Inf | Inf | 1 |
    | 21-32 | joint velocities over 6 rad/s | -Inf | Inf | 1 |
    | 33-44 | targets, scaled as the angles | -1 | 1 | 1 |
    | 45-47 | from the trunk to the goal | -Inf | Inf | m |
    | 48-50 | the goal's x axis | -1 | 1 | 1 |

    ## Rewards
    The sum of the terms below a step of 0.02 s; each is in `info` by its name.

    | Term | Value | Task |
    | ---- | ----- | ---- |
    | `reward_forward` | 10 times the speed along the goal's x axis [m/s] | `swim` |
    | `reward_place` | 1/(1 + (distance/0.25 m)^2) | `hold` |
    | `reward_heading` | 0.5 times the cosine between the trunk's x axis and the goal's | `swim`, `hold` |
    | `reward_progress` | 10 times the speed toward the goal [m/s] | `waypoint` |
    | `reward_reached` | 500 where the goal is reached | `waypoint` |
    | `reward_upright` | 0.5 times the vertical component of the trunk's z axis | all |
    | `reward_depth` | -0.5 times the distance from the goal's depth [m] | all |
    | `reward_effort` | -0.02 times the sum of (joint velocity / 6 rad/s)^2 | all |

    `info` also holds `distance` to the goal [m], `depth_error` [m, goal above the trunk], `forward_speed` [m/s, along
    the goal's x axis] and `upright` [cosine of the tilt].

    ## Starting State
    The pose `home` with any heading, tilted by up to 0.15 rad, joints off by up to 0.1 rad, moving by up to 0.05 m/s
    and 0.1 rad/s on each axis. The force of the checkpoint starts as its `initial_force` says (docs/plugin.md).

    ## Episode End
    Terminated: more than 1.5 m from the goal's depth; the trunk's z axis below the horizon; the goal reached
    (`waypoint`); the simulation blew up (reward and observation are then zeros). Truncated: after 750 steps, 15 s.

    ## Arguments
    `task`: `"swim"`, `"hold"` or `"waypoint"`. `checkpoint`: name of a released one, `"b1-relaxation"`, `"b1-strip"`
    (water that remembers, and acts on the legs) or `"b1-task2"`, or a folder. Others are MujocoEnv's: `render_mode`,
    `width`, `height`, `camera_name`, ...

    ```python
    import gymnasium, hydro_mujoco.envs
    env = gymnasium.make("hydro_mujoco/B1Swim-v0", task="waypoint", checkpoint="b1-relaxation")
    ```
    """

    metadata: dict[str, Any] = {**WaterEnv.metadata, "render_fps": 50}

    def __init__(self, task: str = "swim", checkpoint: str | os.PathLike = "b1-relaxation", **kwargs: Any):
        EzPickle.__init__(self, task, checkpoint, **kwargs)
        super().__init__(b1_task(task, checkpoint), **kwargs)


class B1SwimVectorEnv(WaterVectorEnv):
    """Many `B1SwimEnv`, stepped by `mujoco.batch`: `gymnasium.make_vec("hydro_mujoco/B1Swim-v0", 64)`."""

    def __init__(
        self,
        num_envs: int = 1,
        max_episode_steps: int = 750,
        task: str = "swim",
        checkpoint: str | os.PathLike = "b1-relaxation",
        nthread: int = 0,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
    ):
        """Arguments of B1SwimEnv, and those of WaterVectorEnv."""
        water = b1_task(task, checkpoint)
        super().__init__(water, num_envs, max_episode_steps, nthread=nthread, autoreset_mode=autoreset_mode)
