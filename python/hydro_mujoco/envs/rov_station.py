"""`hydro_mujoco/RovStation-v0`."""

from typing import Any

from gymnasium.utils import EzPickle
from gymnasium.vector import AutoresetMode

from .single import WaterEnv
from .station_task import Station
from .vector import WaterVectorEnv


class RovStationEnv(WaterEnv, EzPickle):
    """
    ## Description
    A BlueROV2 (heavy) keeps its station 1 to 3 m below the surface in a current with gusts and in waves. Scene `rov`,
    numbers of M. von Benzon et al., J. Mar. Sci. Eng. 10(12), 1898 (2022): 13.5 kg, 1 % more buoyancy than weight,
    added mass, linear and quadratic drag, eight thrusters.

    The sea is drawn at reset: one of `seas` seas (each a mean current of up to `current` in a random direction, gusts
    of a tenth of it with a time constant of 10 s, a JONSWAP spectrum of up to `wave_height` and 4 to 7 s peak
    period), a place within 100 m x 100 m and a time within 10,000 s of its wave train, and the heading to keep. The
    seas are compiled when the environment is made and depend on `sea_seed` alone: train with one, evaluate with
    another.

    ## Action Space
    `Box(-1, 1, (8,), float32)`: commands of the thrusters, held for a step. Each of the first four pulls with up to
    40 N at 45 degrees in the horizontal; the others with up to 40 N along z.

    | Num | Action | Min | Max | Name in the scene | Thrust at 1, body axes [N] |
    | --- | ------ | --- | --- | ----------------- | -------------------------- |
    | 0 | fore, right | -1 | 1 | t1 | 28.3, 28.3, 0 |
    | 1 | fore, left | -1 | 1 | t2 | 28.3, -28.3, 0 |
    | 2 | aft, right | -1 | 1 | t3 | 28.3, -28.3, 0 |
    | 3 | aft, left | -1 | 1 | t4 | 28.3, 28.3, 0 |
    | 4-7 | vertical: fore right, fore left, aft right, aft left | -1 | 1 | t5-t8 | 0, 0, 40 |

    ## Observation Space
    `Box(-Inf, Inf, (23,), float64)`; axes are the vehicle's, x forward, y left, z up. The current is not observed.

    | Num | Observation | Min | Max | Unit |
    | --- | ----------- | --- | --- | ---- |
    | 0-2 | from the vehicle to the station | -Inf | Inf | m |
    | 3-5 | the direction to face | -1 | 1 | 1 |
    | 6-8 | the vertical | -1 | 1 | 1 |
    | 9-11 | velocity over ground | -Inf | Inf | m/s |
    | 12-14 | angular velocity | -Inf | Inf | rad/s |
    | 15-22 | commands of the last step | -1 | 1 | 1 |

    ## Rewards
    The sum of the terms below a step of 0.05 s; each is in `info` by its name.

    | Term | Value |
    | ---- | ----- |
    | `reward_place` | 1/(1 + (distance/0.25 m)^2) |
    | `reward_heading` | 0.25 times the cosine of the angle to the direction to face |
    | `reward_effort` | -0.1 times the mean square of the commands |

    `info` also holds `distance` to the station [m] and `heading_cosine`.

    ## Starting State
    Up to 0.5 m from the station, turned by up to 0.5 rad from the heading to keep, tilted by up to 0.2 rad, at rest.

    ## Episode End
    Terminated: more than 3 m from the station; upside down; the simulation blew up (reward and observation are then
    zeros). Truncated: after 600 steps, 30 s.

    ## Arguments
    `seas`: number of seas, 8. `sea_seed`: 0. `current`: 0.5 m/s, at most 2. `wave_height`: 0.4 m, at most 1. Others are
    MujocoEnv's: `render_mode`, `width`, `height`, `camera_name`, ...

    ```python
    import gymnasium, hydro_mujoco.envs
    env = gymnasium.make("hydro_mujoco/RovStation-v0", sea_seed=1, current=0.3)
    ```
    """

    metadata: dict[str, Any] = {**WaterEnv.metadata, "render_fps": 20}

    def __init__(self, seas: int = 8, sea_seed: int = 0, current: float = 0.5, wave_height: float = 0.4, **kwargs: Any):
        EzPickle.__init__(self, seas, sea_seed, current, wave_height, **kwargs)
        super().__init__(Station(seas, sea_seed, current, wave_height), **kwargs)


class RovStationVectorEnv(WaterVectorEnv):
    """Many `RovStationEnv`, stepped by `mujoco.batch`: `gymnasium.make_vec("hydro_mujoco/RovStation-v0", 64)`."""

    def __init__(
        self,
        num_envs: int = 1,
        max_episode_steps: int = 600,
        seas: int = 8,
        sea_seed: int = 0,
        current: float = 0.5,
        wave_height: float = 0.4,
        nthread: int = 0,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
    ):
        """Arguments of RovStationEnv, and those of WaterVectorEnv."""
        water = Station(seas, sea_seed, current, wave_height)
        super().__init__(water, num_envs, max_episode_steps, nthread=nthread, autoreset_mode=autoreset_mode)
