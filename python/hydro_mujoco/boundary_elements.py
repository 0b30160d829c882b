"""Results of a boundary element program as the attribute `potential_flow` of `hydro.wrench`.

Added mass and damping by frequency become an added mass of infinite frequency and a memory (W. E. Cummins,
Schiffstechnik 9, 1962; T. F. Ogilvie, 5th Symposium on Naval Hydrodynamics, 1964). The memory is a sum of second-order
systems, each with a weight that is a positive semidefinite matrix, so that it is stable and never gives energy whatever
the fit (positive real; T. Perez and T. I. Fossen, Modeling, Identification and Control 30, 2009, say why it must be).
"""

import json
import os
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .errors import DataError, Notice
from .recording.files import write_beside

SCHEMA = "hydro-potential-flow/1"
#: Motions, in the order of every axis of six.
DOFS = ("Surge", "Sway", "Heave", "Roll", "Pitch", "Yaw")
#: Error of the damping (root mean square, in parts of the damping's) at which the fit is done, and is refused.
DONE, TOLERANCE = 0.02, 0.1
#: Systems that are tried.
COUNTS = (6, 8, 12, 16, 24)
#: Damping at the highest frequency, in parts of its greatest, above which the list ends too early.
TAIL = 0.2
#: Damping below this part of its greatest needs no system.
LOW = 0.02
#: Iterations of the fit.
ITERATIONS = 3000


def potential_flow(
    frequency: ArrayLike,
    added_mass: ArrayLike,
    damping: ArrayLike,
    *,
    volume: float,
    point: Sequence[float] = (0, 0, 0),
    direction: ArrayLike | None = None,
    excitation: ArrayLike | None = None,
    out: str | os.PathLike | None = None,
) -> dict[str, Any]:
    """Hydrodynamic coefficients by frequency, as a file `hydro-potential-flow/1`.

    Args:
        frequency: angular frequencies [rad/s], (n,), ascending and above zero; they should reach to where the damping
            has died away.
        added_mass: (n, 6, 6) [kg, kg m, kg m^2], in the order surge, sway, heave, roll, pitch, yaw.
        damping: radiation damping, (n, 6, 6) [N s/m, N s, N m s].
        volume: displaced at the draught [m^3].
        point: of the body's frame [m] that the moments are about.
        direction: of travel of the waves [degrees], (m,), from the body's x towards its y.
        excitation: force of waves of 1 m, Froude-Krylov and diffraction together [N/m, N], (n, m, 6), complex: F(t) =
            Re X exp(-i w t) where the elevation above `point` is cos(w t). That is Capytaine's convention; WAMIT's and
            NEMOH's is the conjugate.
        out: path of a file to write.

    Returns:
        The file's content. `json.dumps` of it, or the path, is the attribute's value.

    Raises:
        DataError: arrays that do not fit each other; damping that is negative or too rough to be met within 10 %.

    >>> import numpy as np, hydro_mujoco as hydro
    >>> w = np.linspace(0.1, 20, 200)
    >>> mass, damping = np.zeros((2, 200, 6, 6))
    >>> mass[:] = np.eye(6)
    >>> damping[:, 2, 2] = 300 * w**2 / ((5 - w**2) ** 2 + 4 * w**2)  # heave alone
    >>> file = hydro.potential_flow(w, mass, damping, volume=0.4)
    >>> sorted(file)
    ['added_mass', 'point', 'radiation', 'schema', 'volume']
    """
    w = np.asarray(frequency, float)
    if w.ndim != 1 or len(w) < 8 or not np.isfinite(w).all() or (np.diff(w) <= 0).any() or w[0] <= 0:
        raise DataError(f"frequency has shape {w.shape}; expected at least 8 ascending numbers above zero [rad/s]")
    mass, damping = _shaped("added_mass", added_mass, (len(w), 6, 6)), _shaped("damping", damping, (len(w), 6, 6))
    systems = _systems(w, (damping + damping.transpose(0, 2, 1)) / 2)
    at_infinity = _at_infinity(w, mass, systems)
    at_infinity = (at_infinity + at_infinity.T) / 2
    a, b, c = _realisation(systems)
    file = {
        "schema": SCHEMA,
        "volume": float(volume),
        "point": [float(x) for x in point],
        "added_mass": at_infinity.tolist(),
    }
    if len(a):
        file["radiation"] = {"a": a.tolist(), "b": b.tolist(), "c": c.tolist()}
    if excitation is not None:
        directions = np.atleast_1d(np.asarray(direction, float)) if direction is not None else np.zeros(0)
        force = _shaped("excitation", excitation, (len(w), len(directions), 6), complex).reshape(-1, 6)
        file["excitation"] = {
            "frequency": w.tolist(),
            "direction": directions.tolist(),
            "real": force.real.tolist(),
            "imaginary": force.imag.tolist(),
        }
    if out is not None:
        write_beside(Path(out), json.dumps(file).encode())
    return file


def from_capytaine(
    results: Mapping[str, Any],
    *,
    volume: float,
    point: Sequence[float] = (0, 0, 0),
    out: str | os.PathLike | None = None,
) -> dict[str, Any]:
    """Results of Capytaine (`BEMSolver().fill_dataset`, an `xarray.Dataset`) for one rigid body.

    The body lies at its draught, upright, its rotation centre at the origin of Capytaine's axes or above or below it;
    the data set holds frequencies, all six motions by Capytaine's names, and wave directions where waves are to push.

    Args:
        results: the data set.
        volume: displaced at the draught [m^3].
        point: where Capytaine's rotation centre lies in the body's frame of the MJCF [m].
        out: path of a file to write.

    Raises:
        DataError: as `potential_flow`; several bodies, depths or speeds in one data set; a motion that is missing.
    """
    missing = {"added_mass", "radiation_damping", "omega"} - {*results.keys(), *getattr(results, "coords", ())}
    if missing:
        raise DataError(f"the data set has no {', '.join(sorted(missing))}; it has: {', '.join(map(str, results))}")
    names = [str(name) for name in np.asarray(results["radiating_dof"]).ravel()]
    order = []
    for dof in DOFS:
        found = [at for at, name in enumerate(names) if name.split("__")[-1] == dof]
        if len(found) != 1:
            raise DataError(f"the data set has the motions {', '.join(names)}; expected one {dof}, of one body")
        order += found
    influenced = [str(name) for name in np.asarray(results["influenced_dof"]).ravel()]
    forces = [influenced.index(names[at]) for at in order]
    w = np.asarray(results["omega"], float).ravel()

    def of(name: str, *last: str) -> np.ndarray:
        array = results[name]
        extra = [dim for dim in array.dims if dim not in {"omega", *last} and array.sizes[dim] > 1]
        if extra:
            raise DataError(f"{name} has several of {', '.join(extra)}; choose one before: results.isel(...)")
        array = array.squeeze([dim for dim in array.dims if dim not in {"omega", *last}])
        return np.asarray(array.transpose("omega", *last))

    matrix = ("influenced_dof", "radiating_dof")
    mass = of("added_mass", *matrix)[:, forces][:, :, order]
    damping = of("radiation_damping", *matrix)[:, forces][:, :, order]
    finite = np.isfinite(w) & (w > 0)
    direction = excitation = None
    if "diffraction_force" in results:
        last = ("wave_direction", "influenced_dof")
        whole = of("diffraction_force", *last) + of("Froude_Krylov_force", *last)
        direction = np.degrees(np.asarray(results["wave_direction"], float).ravel())
        excitation = whole[finite][:, :, forces]
    ascending = np.argsort(w[finite])
    return potential_flow(
        w[finite][ascending],
        mass[finite][ascending],
        damping[finite][ascending],
        volume=volume,
        point=point,
        direction=direction,
        excitation=None if excitation is None else excitation[ascending],
        out=out,
    )


def _shaped(name: str, value: ArrayLike, shape: tuple[int, ...], kind: type = float) -> np.ndarray:
    array: np.ndarray = np.asarray(value, kind)
    if array.shape != shape:
        raise DataError(f"{name} has shape {array.shape}; expected {shape}")
    odd = np.argwhere(~np.isfinite(array))
    if len(odd):
        raise DataError(
            f"{name}{odd[0].tolist()} is {array[tuple(odd[0])]}, the first of {len(odd)} of {array.size} numbers that "
            "are not finite; expected finite ones"
        )
    return array


class _System(NamedTuple):
    """2 zeta w0 s / (s^2 + 2 zeta w0 s + w0^2) times a matrix: its real part is a bell about w0, nowhere below zero."""

    frequency: float
    width: float
    weight: np.ndarray

    def response(self, w: np.ndarray) -> np.ndarray:
        """Complex frequency response without the weight, shape of `w`."""
        band = 2 * self.width * self.frequency
        return band * 1j * w / (self.frequency**2 - w**2 + band * 1j * w)


def _systems(w: np.ndarray, damping: np.ndarray) -> list[_System]:
    """The fewest systems whose damping meets the given one."""
    greatest = np.einsum("wii->wi", damping).max(axis=0)
    if greatest.max(initial=0) <= 0:
        return []
    used = np.flatnonzero(greatest > 1e-6 * greatest[:3].max(initial=0))
    scale = np.sqrt(greatest[used])
    given = damping[:, used][:, :, used] / np.outer(scale, scale)
    size = np.einsum("wii->wi", given).max(axis=1)
    if size[-1] > TAIL:
        warnings.warn(
            f"damping at the highest frequency, {w[-1]:.3g} rad/s, is {100 * size[-1]:.0f} % of its greatest: list "
            "higher ones, for the memory of short waves is a guess",
            Notice,
            stacklevel=3,
        )
    large = w[size > LOW]
    # Every frequency weighs as much as the band that it stands for.
    bands = np.sqrt(np.gradient(w))[:, None, None]
    best: tuple[float, list[_System]] = (np.inf, [])
    for count in COUNTS:
        centres = np.geomspace(large[0], large[-1] * 1.05, count)
        width = 0.75 * (centres[1] / centres[0] - 1)
        bells = np.stack([_System(centre, width, np.eye(1)).response(w).real for centre in centres], axis=1)
        weights = _positive_fit(bells * bands[:, :, 0], given * bands)
        rest = (np.einsum("wk,kij->wij", bells, weights) - given) * bands
        error = float(np.linalg.norm(rest) / np.linalg.norm(given * bands))
        whole = np.zeros((count, 6, 6))
        whole[np.ix_(np.arange(count), used, used)] = weights * np.outer(scale, scale)
        if error < best[0]:
            best = error, [_System(*system) for system in zip(centres, [width] * count, whole, strict=True)]
        if error < DONE:
            break
    error, systems = best
    if error > TOLERANCE:
        raise DataError(
            f"the damping is met to {100 * error:.0f} %; expected {100 * TOLERANCE:.0f} %. "
            "Damping is nowhere negative, and smooth where the list has no irregular frequency (Capytaine: give the "
            "mesh a lid, and panels of an eighth of the shortest wave)"
        )
    return systems


def _positive_fit(bells: np.ndarray, given: np.ndarray) -> np.ndarray:
    """Positive semidefinite weights, (k, n, n), of bells, (w, k), whose sum is nearest to matrices, (w, n, n).

    Accelerated projected gradient: A. Beck and M. Teboulle, SIAM Journal on Imaging Sciences 2, 2009.
    """
    gram = bells.T @ bells
    target = np.einsum("wk,wij->kij", bells, given)
    step = 1 / np.linalg.eigvalsh(gram)[-1]
    weights = ahead = np.zeros_like(target)
    momentum = 1.0
    for _ in range(ITERATIONS):
        moved = ahead - step * (np.einsum("kl,lij->kij", gram, ahead) - target)
        values, vectors = np.linalg.eigh((moved + moved.transpose(0, 2, 1)) / 2)
        projected = np.einsum("kia,ka,kja->kij", vectors, np.maximum(values, 0), vectors)
        following = (1 + np.sqrt(1 + 4 * momentum**2)) / 2
        ahead = projected + (momentum - 1) / following * (projected - weights)
        weights, momentum = projected, following
    return weights


def _at_infinity(w: np.ndarray, mass: np.ndarray, systems: list[_System]) -> np.ndarray:
    """A(inf) = A(w) - Im K(i w) / w (Ogilvie), the mean over the frequencies.

    Where the damping's tail is missing it stands for that too: the added mass is right at the given frequencies.
    """
    rest = mass.copy()
    for system in systems:
        rest -= (system.response(w).imag / w)[:, None, None] * system.weight
    return rest.mean(axis=0)


def _realisation(systems: list[_System]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x' = a x + b u, y = c x: two numbers for each eigenvector of a system's weight."""
    blocks, inputs, outputs = [], [], []
    largest = max((np.linalg.eigvalsh(_scaled(system.weight)).max() for system in systems), default=0)
    for frequency, width, weight in systems:
        scale = np.sqrt(np.maximum(np.diag(weight), np.finfo(float).tiny))
        values, vectors = np.linalg.eigh(_scaled(weight))
        band = 2 * width * frequency
        for value, vector in zip(values, vectors.T * scale, strict=True):
            if value > 1e-3 * largest:
                blocks.append(np.array([[-band, -frequency], [frequency, 0]]))
                inputs.append(np.stack([band * np.sqrt(value) * vector, np.zeros(6)]))
                outputs.append(np.stack([np.sqrt(value) * vector, np.zeros(6)], axis=1))
    a = np.zeros((2 * len(blocks), 2 * len(blocks)))
    for at, block in enumerate(blocks):
        a[2 * at : 2 * at + 2, 2 * at : 2 * at + 2] = block
    if not blocks:
        return a, np.zeros((0, 6)), np.zeros((6, 0))
    return a, np.concatenate(inputs), np.concatenate(outputs, axis=1)


def _scaled(weight: np.ndarray) -> np.ndarray:
    """The weight with ones on its diagonal."""
    scale = np.sqrt(np.maximum(np.diag(weight), np.finfo(float).tiny))
    return weight / np.outer(scale, scale)
