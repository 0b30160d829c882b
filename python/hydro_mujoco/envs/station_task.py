"""Task of the vehicle: station-keeping in a current and waves."""

import mujoco
import numpy as np
from gymnasium.spaces import Box

from .. import packaged
from ..plugin import load_plugin
from .attitude import about_axis, about_z, product, to_body
from .scenery import add_camera, add_goal, add_surface
from .seas import draw_seas
from .task import Start, State, Task, nearness

#: Physics steps of 5 ms a step.
FRAME_SKIP = 10
#: Depth of the station [m], how far from it an episode starts and ends [m], how tilted it starts [rad].
DEPTHS, OFFSET, LOST, TILT = (1.0, 3.0), 0.5, 3.0, 0.2
#: An episode begins at a time in the wave train up to this [s].
LONGEST = 1e4
#: Elements of an observation.
WIDTH = 3 + 3 + 3 + 3 + 3 + 8


class Station(Task):
    """Stay at the goal's position, turned to its x axis."""

    frame_skip = FRAME_SKIP
    observation_space = Box(-np.inf, np.inf, (WIDTH,), np.float64)
    action_space = Box(-1.0, 1.0, (8,), np.float32)

    def __init__(self, seas: int, sea_seed: int, current: float, wave_height: float):
        """Compile a model for each sea; arguments of `draw_seas`."""
        load_plugin()
        self.scene = packaged.scene("rov")
        spec = mujoco.MjSpec.from_file(self.scene)
        add_goal(spec, 0.05)
        add_surface(spec, 0.0)
        add_camera(spec.body("rov"))
        water = spec.plugins[0]
        models = []
        for sea in draw_seas(seas, sea_seed, current, wave_height):
            water.config = {**water.config, "current": sea.current, "waves": sea.waves}
            models.append(spec.compile())
        self.models = tuple(models)

    def start(self, random: np.random.Generator) -> Start:
        sea = int(random.integers(len(self.models)))
        # A multiple of the physics step.
        step = self.models[sea].opt.timestep
        time = float(random.integers(int(LONGEST / step))) * step
        heading = random.uniform(-np.pi, np.pi)
        goal = np.array([*random.uniform(-50, 50, 2), -random.uniform(*DEPTHS)])
        direction = random.normal(size=3)
        qpos = np.empty(7)
        qpos[:3] = goal + random.uniform(0, OFFSET) * direction / np.sqrt(direction @ direction)
        tilt = about_axis(random.normal(size=3), random.uniform(0, TILT))
        qpos[3:] = product(about_z(heading + random.uniform(-0.5, 0.5)), tilt)
        return Start(sea, time, qpos, np.zeros(6), np.zeros(8), goal, about_z(heading))

    def controls(self, state: State, action: np.ndarray) -> np.ndarray:
        return action

    def observe(self, state: State) -> np.ndarray:
        return np.concatenate(
            [
                to_body(state.axes, state.offset),
                to_body(state.axes, state.forward),
                state.axes[:, 2],
                to_body(state.axes, state.qvel[:, :3]),
                state.qvel[:, 3:6],
                state.ctrl,
            ],
            axis=1,
        )

    def terms(self, state: State) -> dict[str, np.ndarray]:
        return {
            "reward_place": nearness(state.distance),
            "reward_heading": 0.25 * state.alignment,
            "reward_effort": -0.1 * np.sum(state.ctrl * state.ctrl, axis=1) / 8,
        }

    def measures(self, state: State) -> dict[str, np.ndarray]:
        return {"distance": state.distance, "heading_cosine": state.alignment}

    def ended(self, state: State) -> np.ndarray:
        return (state.distance > LOST) | (state.upright < 0)
