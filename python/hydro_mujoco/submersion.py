"""How much of a body is under water."""

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import cast

import mujoco
import numpy as np

from .errors import DataError
from .plugin import loaded_copies
from .water import body_number

#: What `hydro_submerged` returns (src/mujoco/wrench/submerged.rs).
DONE, REFUSED, IDLE = 0, 1, 2
#: Bytes for its reason.
ROOM = 512


@dataclass(frozen=True)
class Submerged:
    """The part of a body's hull that is under water.

    Attributes:
        volume: [m^3].
        share: of the whole hull, 0 to 1.
        centre: of that part [m], in the body's frame, shape (3,); `centre_of_buoyancy` where the instance gives it.
    """

    volume: float
    share: float
    centre: np.ndarray


def submerged(model: mujoco.MjModel, data: mujoco.MjData, body: str) -> Submerged:
    """How much of a body is under water, as the plugin's buoyancy sees it at the pose that `data` holds.

    That is the present one after `mj_forward`, and that of the step's start after `mj_step`. The hull is that of the
    body with what is welded to it (docs/plugin.md, attribute `hull`); waves count, as planes over it or, where they
    are short, panel by panel. Without a `waterline` everything is submerged.

    Args:
        model: compiled. data: of that model. body: name of one that carries `hydro.wrench`, or that an effect of it
            acts on.

    Raises:
        DataError: there is no such body, no water is about it, or the plugin does not act in this process.

    Source: the library's function `hydro_submerged`, the same code as the effect `hydrostatics`.

    >>> import mujoco, hydro_mujoco as hydro
    >>> spec = mujoco.MjSpec.from_string('''<mujoco><worldbody><body name="hull" pos="0 0 0.25"><freejoint/>
    ...   <geom type="box" size="0.5 0.5 0.5" mass="250"/></body></worldbody></mujoco>''')
    >>> spec = hydro.add_water(spec, body="hull", effects={"hydrostatics": {}}, waterline=0)
    >>> model = spec.compile(); data = mujoco.MjData(model); mujoco.mj_forward(model, data)
    >>> part = hydro.submerged(model, data, "hull")
    >>> round(part.volume, 6), round(part.share, 6), part.centre.round(6).tolist()
    (0.25, 0.25, [0.0, 0.0, -0.375])
    """
    number = body_number(model, body)
    out = np.zeros(5)
    reason = ctypes.create_string_buffer(ROOM)
    numbers = out.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
    model_at, data_at = ctypes.c_void_p(model._address), ctypes.c_void_p(data._address)
    status = _acting_function()(model_at, data_at, number, numbers, reason, ROOM)
    if status == REFUSED:
        raise DataError(f"{reason.value.decode()}: hydro_mujoco.add_water gives it water")
    if status != DONE:
        raise DataError("internal fault of the plugin library; MuJoCo's warning says which")
    return Submerged(float(out[0]), float(out[1]), out[2:])


@cache
def _acting_function() -> Callable[..., int]:
    """`hydro_submerged` of the copy of the library that registered in this process."""
    for library in loaded_copies():
        try:
            function = ctypes.CDLL(str(library)).hydro_submerged
        except (OSError, AttributeError) as error:
            raise DataError(f"plugin library {library} lacks a function of this version ({error})") from error
        function.restype = ctypes.c_int
        if function(None, None, -1, None, None, 0) != IDLE:
            return cast(Callable[..., int], function)
    raise DataError("the plugin hydro.wrench does not act in this process: python -m hydro_mujoco says why")
