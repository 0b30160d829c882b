"""Gymnasium environments in water; importing this package registers them.

b1_swim.py      `hydro_mujoco/B1Swim-v0`: a quadruped swims, holds or goes to a waypoint in learned water
rov_station.py  `hydro_mujoco/RovStation-v0`: a BlueROV2 keeps station in current and waves
single.py       one environment over `gymnasium.envs.mujoco.MujocoEnv`
vector.py       many environments over `mujoco.batch`
task.py         what both drive: a task, pure functions of MuJoCo's state
b1_tasks.py     the tasks of the quadruped
station_task.py the task of the vehicle
seas.py         seas drawn at random, one compiled model each
scenery.py      the goal's marker, the still surface, the camera that follows
attitude.py     rotations of arrays
"""

try:
    from gymnasium import register, registry
except ImportError as error:
    raise ImportError("hydro_mujoco.envs needs Gymnasium: pip install 'hydro-mujoco[gym]'") from error

#: Name -> module, classes, steps of an episode.
_ENVIRONMENTS = {
    "B1Swim-v0": ("b1_swim", "B1Swim", 750),
    "RovStation-v0": ("rov_station", "RovStation", 600),
}

for _name, (_module, _class, _steps) in _ENVIRONMENTS.items():
    if f"hydro_mujoco/{_name}" not in registry:
        register(
            id=f"hydro_mujoco/{_name}",
            entry_point=f"{__name__}.{_module}:{_class}Env",
            vector_entry_point=f"{__name__}.{_module}:{_class}VectorEnv",
            max_episode_steps=_steps,
        )
