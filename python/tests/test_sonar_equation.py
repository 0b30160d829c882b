"""The sonar equation of acoustic links against tables and another formula."""

import numpy as np
import pytest

from hydro_mujoco.sensors.sonar_equation import absorption, success, total, transmission_loss


def francois_garrison(frequency, temperature, salinity, depth, acidity):
    """Absorption [dB/km] at a frequency [kHz]: R. E. Francois and G. R. Garrison, J. Acoust. Soc. Am. 72(6), 1982."""
    speed = 1412 + 3.21 * temperature + 1.19 * salinity + 0.0167 * depth
    kelvin = 273 + temperature
    boric = 8.86 / speed * 10 ** (0.78 * acidity - 5)
    at_boric = 2.8 * np.sqrt(salinity / 35) * 10 ** (4 - 1245 / kelvin)
    salt = 21.44 * salinity / speed * (1 + 0.025 * temperature) * (1 - 1.37e-4 * depth + 6.2e-9 * depth**2)
    at_salt = 8.17 * 10 ** (8 - 1990 / kelvin) / (1 + 0.0018 * (salinity - 35))
    water = 4.937e-4 - 2.59e-5 * temperature + 9.11e-7 * temperature**2 - 1.50e-8 * temperature**3
    water *= 1 - 3.83e-5 * depth + 4.9e-10 * depth**2
    relaxations = boric * at_boric / (at_boric**2 + frequency**2) + salt * at_salt / (at_salt**2 + frequency**2)
    return (relaxations + water) * frequency**2


def test_absorption_by_thorp():
    # The sum of Jensen et al., eq. 1.47, worked out by hand, in dB/km.
    by_hand = {0.1: 0.00450, 1: 0.06933, 5: 0.38324, 10: 1.18983, 25: 6.12073, 50: 17.52992, 100: 34.31896}
    for kilohertz, expected in by_hand.items():
        assert 1000 * absorption(1000 * kilohertz) == pytest.approx(expected, rel=1e-3)
    # Another formula, for the water that Thorp's is for.
    for kilohertz in (1, 2, 5, 10, 20, 30):
        other = francois_garrison(kilohertz, 4, 35, 900, 8.0)
        assert 1000 * absorption(1000 * kilohertz) == pytest.approx(other, rel=0.25)
    assert transmission_loss(1000, 25e3, 2) == pytest.approx(60 + 6.1207, abs=1e-3)
    assert transmission_loss(1000, 25e3, 1.5) == pytest.approx(45 + 6.1207, abs=1e-3)
    assert total(80, 80) == pytest.approx(83.0103) and total(80, 40) == pytest.approx(80.0004, abs=1e-4)
    assert success(10, 10, 2) == 0.5 and success(16, 10, 2) == pytest.approx(0.9526, abs=1e-4)
    assert success(9.99, 10, 0) == 0 and success(10, 10, 0) == 1 and success(-1e9, 10, 1e-9) < 1e-300
