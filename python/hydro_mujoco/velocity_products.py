"""Drag by products of two velocities, from arrays: effects for `add_water`."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from .errors import DataError

#: Axes in the order of rows: forces along x, y, z, moments about them; and the velocities along and about them.
AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
VELOCITIES = "uvwpqr"
#: Second velocities of the products, or their sizes.
SIZES = "abcdef"
#: Units of a coefficient by how many of its three axes turn (force, first, second velocity).
UNITS = ("N s^2/m^2", "N s^2/m", "N s^2", "N m s^2")

Array = np.ndarray | Sequence[Any]


def drag_tensors(name: str, *, modulus: Array | None = None, plain: Array | None = None) -> list[dict[str, Any]]:
    """Forces by products of two velocities, as effects for the list `effects` of `add_water`: one of each array.

    F_i = sum over j, k of modulus[i, j, k] nu_j |nu_k| + plain[i, j, k] nu_j nu_k, i, j, k over surge, sway, heave,
    roll, pitch, yaw; body frame x forward, y left, z up, at the body's origin, nu relative to the water. The arrays
    hold derivatives, so that what resists is negative. They are gz-sim's `<xUabsV>` and `<xUV>`; the forward-speed term
    of others is plain[:, :, 0]. It fades with the submerged part of the hull, as all that water does.

    Products without a modulus that an added mass brings (Kirchhoff's equations) must not be given again beside one.

    Args:
        name: a letter, then letters, digits and `_`; the effects are `user.NAME_modulus` and `user.NAME_plain`.
        modulus, plain: shape (6, 6, 6), SI units.

    Raises:
        DataError: an array of another shape, or a number that is not finite; no number but zeros.
        ValueError, where the model is compiled: a name that is none.

    Source: T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed., Wiley 2021, section 6.4
    (nonlinear damping: second-order modulus functions, and truncated Taylor series).

    >>> import mujoco, numpy as np, hydro_mujoco as hydro
    >>> spec = mujoco.MjSpec.from_string('''<mujoco><option gravity="0 0 0"/><worldbody><body name="hull"><freejoint/>
    ...   <geom type="ellipsoid" size="0.33 0.18 0.1" mass="12"/></body></worldbody></mujoco>''')
    >>> modulus = np.zeros((6, 6, 6)); modulus[0, 0, 0] = -40; modulus[5, 1, 1] = 3
    >>> spec = hydro.add_water(spec, body="hull", effects=hydro.drag_tensors("hull", modulus=modulus))
    >>> model = spec.compile(); data = mujoco.MjData(model)
    >>> data.qvel[:2] = 0.5, -1; mujoco.mj_forward(model, data)
    >>> hydro.wrench(model, data, "hull").round(6).tolist()
    [-10.0, 0.0, 0.0, 0.0, 0.0, -3.0]
    """
    given = {"modulus": modulus, "plain": plain}
    arrays = {kind: _checked(kind, array) for kind, array in given.items() if array is not None}
    effects = [
        {"effect": f"user.{name}_{kind}", "parameters": {"scale": 1.0}, "definition": _definition(kind, array)}
        for kind, array in arrays.items()
        if np.any(array)
    ]
    if not effects:
        raise DataError("modulus, plain: no number but zeros, expected some coefficient")
    return effects


def _definition(kind: str, array: np.ndarray) -> dict[str, Any]:
    second = "abs(nu_{})" if kind == "modulus" else "nu_{}"
    rows = {axis: _row(i, array[i]) for i, axis in enumerate(AXES)}
    return {
        "summary": f"drag by products of two velocities ({kind})",
        "phrase": "drag by products of two velocities",
        "target": "body",
        "medium": "water",
        "parameters": {"scale": {"unit": "1", "lower": 0.0, "upper": 2.0, "null": 0.0, "prior_sd": 1.0}},
        "constants": {f"k{n}": {"value": 1.0, "unit": unit} for n, unit in enumerate(UNITS)},
        "let": {letter: f"nu_{axis}" for letter, axis in zip(VELOCITIES, AXES)}
        | {letter: second.format(axis) for letter, axis in zip(SIZES, AXES)},
        "wrench": {axis: f"scale*({row})" for axis, row in rows.items() if row},
    }


def _checked(key: str, array: Array) -> np.ndarray:
    try:
        found = np.asarray(array, float)
    except (TypeError, ValueError) as error:
        raise DataError(f"{key}: {error}; expected numbers of shape (6, 6, 6)") from error
    if found.shape != (6, 6, 6):
        raise DataError(f"{key}: shape {found.shape}, expected (6, 6, 6)")
    if not np.all(np.isfinite(found)):
        i, j, k = np.argwhere(~np.isfinite(found))[0]
        raise DataError(f"{key}[{i}, {j}, {k}]: {found[i, j, k]}, expected finite numbers")
    return found


def _row(i: int, coefficients: np.ndarray) -> str:
    """The force on an axis, terms by one first velocity and of one unit together; empty where all are zero."""
    parts = []
    for j, first in enumerate(VELOCITIES):
        # Second velocities along the axes, then about them: another unit.
        for turns in (0, 1):
            own = [(k, coefficients[j, k]) for k in range(3 * turns, 3 * turns + 3) if coefficients[j, k] != 0]
            if own:
                terms = "".join(f"{value:+.12g}*{SIZES[k]}" for k, value in own).removeprefix("+")
                parts.append(f"k{(i > 2) + (j > 2) + turns}*{first}*({terms})")
    return "+".join(parts)
