"""Coefficients of a boundary element program to a memory: against a system whose coefficients are known exactly."""

import json

import numpy as np
import pytest
import xarray

import hydro_mujoco as hydro
from hydro_mujoco.errors import DataError, Notice

W = np.linspace(0.1, 15, 150)
#: A hull's memory: pairs of (frequency [rad/s], width, weight of six), coupled surge and pitch, sway and roll.
SYSTEMS = [
    (3.0, 0.45, [0, 0, 900, 0, 0, 0]),
    (4.5, 0.4, [300, 0, 0, 0, -60, 0]),
    (5.5, 0.5, [0, 400, 0, 30, 0, 0]),
    (6.0, 0.5, [0, 0, 0, 0, 0, 80]),
]
ADDED = np.diag([40.0, 70, 760, 27, 160, 21])


def response(w):
    """K(i w) of the systems."""
    whole = np.zeros((len(w), 6, 6), complex)
    for frequency, width, weights in SYSTEMS:
        band = 2 * width * frequency
        scalar = band * 1j * w / (frequency**2 - w**2 + band * 1j * w)
        root = np.array(weights) / np.sqrt(np.abs(weights).max())
        whole += scalar[:, None, None] * np.outer(root, root)
    return whole


def coefficients():
    """Added mass and damping of the systems at the frequencies."""
    k = response(W)
    return ADDED + k.imag / W[:, None, None], k.real


def of_file(file, w):
    """K(i w) of a file's memory."""
    a, b, c = (np.array(file["radiation"][key]) for key in "abc")
    return np.array([c @ np.linalg.solve(1j * x * np.eye(len(a)) - a, b) for x in w])


def test_a_known_memory_comes_back():
    file = hydro.potential_flow(W, *coefficients(), volume=0.4, point=(0, 0, -0.05))
    found, truth = of_file(file, W), response(W)
    scale = np.sqrt(np.einsum("wii->wi", truth.real).max(axis=0))
    fault = np.abs(found - truth) / np.outer(scale, scale)
    assert fault.max() < 0.06 and np.sqrt((fault**2).mean()) < 0.01
    np.testing.assert_allclose(np.array(file["added_mass"]), ADDED, atol=0.02 * scale.max() ** 2 / 10)
    assert file["point"] == [0, 0, -0.05] and file["volume"] == 0.4


def test_the_memory_is_stable_and_takes_energy_at_every_frequency_whatever_the_data():
    rng = np.random.default_rng(3)
    mass, damping = coefficients()
    size = np.sqrt(np.einsum("wii->wi", damping).max(axis=0))
    noise = 0.03 * rng.standard_normal(damping.shape) * np.outer(size, size)
    file = hydro.potential_flow(W, mass, damping + noise, volume=0.4)
    assert np.linalg.eigvals(np.array(file["radiation"]["a"])).real.max() < 0
    k = of_file(file, np.geomspace(0.01, 1000, 300))
    least = np.linalg.eigvalsh(k + k.conj().transpose(0, 2, 1)).min()
    assert least > -1e-9 * np.abs(k).max()


def test_excitation_and_file(tmp_path):
    excitation = np.arange(len(W) * 2 * 6).reshape(len(W), 2, 6) * (1 - 2j)
    path = tmp_path / "box.json"
    file = hydro.potential_flow(W, *coefficients(), volume=0.4, direction=[0, 90], excitation=excitation, out=path)
    assert json.loads(path.read_text()) == file
    rows = np.array(file["excitation"]["real"]) + 1j * np.array(file["excitation"]["imaginary"])
    np.testing.assert_array_equal(rows.reshape(excitation.shape), excitation)
    assert [entry.name for entry in tmp_path.iterdir()] == ["box.json"]


def test_a_hull_that_makes_no_waves_has_no_memory():
    mass, damping = coefficients()
    file = hydro.potential_flow(W, mass, 0 * damping, volume=1)
    assert "radiation" not in file


def odd(value, *places):
    """Matrices with a value at some places."""
    out = np.zeros((150, 6, 6))
    for place in places:
        out[place] = value
    return out


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"frequency": W[::-1]}, "ascending numbers above zero"),
        ({"frequency": W[:4]}, "at least 8"),
        ({"added_mass": np.zeros((3, 6, 6))}, r"added_mass has shape \(3, 6, 6\); expected \(150, 6, 6\)"),
        ({"damping": odd(np.nan, (3, 2, 1), (9, 0, 0))}, r"damping\[3, 2, 1\] is nan, the first of 2 of 5400 numbers"),
        ({"added_mass": odd(-np.inf, (0, 5, 4))}, r"added_mass\[0, 5, 4\] is -inf.*expected finite ones"),
        ({"excitation": np.zeros((150, 2, 6))}, r"excitation has shape \(150, 2, 6\); expected \(150, 0, 6\)"),
    ],
)
def test_refusals(change, words):
    mass, damping = coefficients()
    given = {"frequency": W, "added_mass": mass, "damping": damping, "volume": 0.4, **change}
    with pytest.raises(DataError, match=words):
        hydro.potential_flow(given.pop("frequency"), given.pop("added_mass"), given.pop("damping"), **given)


def test_damping_that_pushes_is_refused():
    mass, damping = coefficients()
    damping[:, 2, 2] *= np.sign(np.sin(3 * W))
    with pytest.raises(DataError, match="Damping is nowhere negative"):
        hydro.potential_flow(W, mass, damping, volume=0.4)


def data_set(**changed):
    """Results as Capytaine lays them out, motions in another order."""
    dofs = ["Heave", "Surge", "Sway", "Yaw", "Pitch", "Roll"]
    order = [["Surge", "Sway", "Heave", "Roll", "Pitch", "Yaw"].index(dof) for dof in dofs]
    mass, damping = (array[:, order][:, :, order] for array in coefficients())
    force = np.ones((len(W), 1, 6)) * np.array(order) * (1 + 1j)
    matrix, wave = ("omega", "radiating_dof", "influenced_dof"), ("omega", "wave_direction", "influenced_dof")
    variables = {
        "added_mass": (matrix, mass),
        "radiation_damping": (matrix, damping),
        "diffraction_force": (wave, force),
        "Froude_Krylov_force": (wave, force),
    }
    coords = {"omega": W, "radiating_dof": dofs, "influenced_dof": dofs, "wave_direction": [0.5], "rho": 1000.0}
    return xarray.Dataset({**variables, **changed}, coords={**coords})


def test_capytaines_data_set_is_put_in_order():
    file = hydro.from_capytaine(data_set(), volume=0.4)
    plain = hydro.potential_flow(W, *coefficients(), volume=0.4)
    np.testing.assert_allclose(file["added_mass"], plain["added_mass"], rtol=1e-9, atol=1e-9)
    assert file["excitation"]["real"][7] == [0, 2, 4, 6, 8, 10]
    np.testing.assert_allclose(file["excitation"]["direction"], [np.degrees(0.5)])


def test_a_data_set_without_a_motion_is_refused():
    with pytest.raises(DataError, match="expected one Yaw"):
        hydro.from_capytaine(data_set().isel(radiating_dof=[0, 1, 2, 4, 5]), volume=0.4)
    with pytest.raises(DataError, match="no radiation_damping"):
        hydro.from_capytaine(data_set().drop_vars("radiation_damping"), volume=0.4)


def test_a_list_that_ends_early_is_told():
    mass, damping = coefficients()
    with pytest.warns(Notice, match="list higher ones"):
        hydro.potential_flow(W[:40], mass[:40], damping[:40], volume=0.4)
