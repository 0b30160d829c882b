"""What of the plugin acts in MuJoCo Warp, and the refusal of the rest."""

from collections.abc import Iterable
from typing import NoReturn

import mujoco
import mujoco_warp as mjw

from ..errors import DataError

#: Effects on bodies, and on the water.
EFFECTS = (
    "added_mass",
    "linear_drag",
    "quadratic_drag",
    "cross_flow_drag",
    "munk_moment",
    "lift",
    "net_buoyancy",
    "buoyancy_offset",
    "hydrostatics",
    "constant_force",
    "wake_memory",
    "basset_history",
    "current",
)
#: Attributes of an instance of `hydro.wrench`.
ATTRIBUTES = (
    *("effects", "density", "waterline", "current", "waves", "hull", "volume", "centre_of_buoyancy"),
    *("checkpoint", "joints", "solver", "initial_force", "wrench_scale", "outputs"),
)
#: The other attributes.
WITHOUT = ("potential_flow", "engine")
#: Keys of the attribute `current` where it is JSON.
CURRENTS = ("schema", "velocity", "profile", "random")
INTEGRATORS = ("Euler", "implicit", "implicitfast", "RK4")

_INTEGRATOR = mujoco.mjtIntegrator
_SUPPORTED_INTEGRATORS = (
    _INTEGRATOR.mjINT_EULER,
    _INTEGRATOR.mjINT_IMPLICIT,
    _INTEGRATOR.mjINT_IMPLICITFAST,
    _INTEGRATOR.mjINT_RK4,
)


def refuse(where: str, what: str, supported: Iterable[str]) -> NoReturn:
    """Raise the error of what MuJoCo Warp does not get."""
    raise DataError(
        f"{where}: {what} is not supported in MuJoCo Warp, only in the plugin;\nsupported: {', '.join(supported)}"
    )


def check_options(option: mjw.Option, *, memory: str) -> None:
    """Refuse options of a Warp model under which the water would not act, or not rightly.

    memory: the first part of the water that has one, in words; empty where none has.

    Raises:
        DataError: the integrator, sleeping, or passive forces that are disabled.
    """
    if memory and option.integrator == _INTEGRATOR.mjINT_RK4:
        # It is brought on once a step, and RK4 asks for forces four times.
        refuse("option integrator", f"`RK4` with {memory}", INTEGRATORS[:-1])
    if option.integrator not in _SUPPORTED_INTEGRATORS:
        name = _INTEGRATOR(option.integrator).name.removeprefix("mjINT_").lower()
        refuse("option integrator", f"`{name}`", INTEGRATORS)
    if option.enableflags & mujoco.mjtEnableBit.mjENBL_SLEEP:
        refuse("option flag sleep", "`enable`", ("disable",))
    disabled = mujoco.mjtDisableBit.mjDSBL_SPRING | mujoco.mjtDisableBit.mjDSBL_DAMPER
    if (option.disableflags & disabled) == disabled:
        raise DataError(
            "option flags spring and damper are both `disable`: then there are no passive forces, and no water acts"
        )
