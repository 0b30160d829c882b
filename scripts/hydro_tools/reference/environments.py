"""docs/reference-envs.md."""

import inspect
import re

from hydro_mujoco.envs.b1_swim import B1SwimEnv
from hydro_mujoco.envs.rov_station import RovStationEnv

#: Name of an environment -> its class, whose docstring is its documentation.
ENVIRONMENTS = {"B1Swim-v0": B1SwimEnv, "RovStation-v0": RovStationEnv}


def page() -> str:
    """The page, of the docstrings of the environments."""
    parts = [
        "<!-- Written by python scripts/make_reference.py from the classes of hydro_mujoco.envs; do not edit. -->",
        "# Environments in full",
        "How they are made, many at once, speeds: [envs.md](envs.md).",
    ]
    for name, kind in ENVIRONMENTS.items():
        text = inspect.getdoc(kind) or ""
        # Below the name of the environment.
        parts += [f"## {name}", re.sub(r"^## ", "### ", text, flags=re.MULTILINE)]
    return "\n\n".join(parts) + "\n"
