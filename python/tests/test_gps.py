"""`hydro_mujoco.sensors.Gps` against closed forms."""

import re

import numpy as np
import pytest

from hydro_mujoco import DataError, plugin
from hydro_mujoco.sensors import Gps
from seabed import move, scene

pytestmark = [
    pytest.mark.skipif(not plugin.built_library().is_file(), reason="no plugin library: cargo build --release"),
    pytest.mark.filterwarnings("ignore"),
]
PERFECT = {"slow_noise": (0, 0), "noise": (0, 0)}
ORIGIN = (41.7, -8.9, 60.0)


@pytest.mark.parametrize("east", [0.0, 90.0, -35.0])
def test_a_gps_s_degrees_are_those_of_the_ellipsoid_s_radii(east):
    model, data = scene(waterline=-3.0)
    x, y = 120.0, -340.0
    move(model, data, place=(x, y, 2.0))
    fix = Gps(model, "rov", origin=ORIGIN, east=east, **PERFECT).read(data)
    turn = np.radians(east)
    to_east, to_north = x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)
    # Radii of curvature of WGS84; a tangent plane agrees to the second order.
    a, squared, latitude = 6378137.0, 0.00669437999014, np.radians(ORIGIN[0])
    w = 1 - squared * np.sin(latitude) ** 2
    meridian, normal = a * (1 - squared) / w**1.5, a / np.sqrt(w)
    dlat = np.degrees(to_north / (meridian + 62))
    dlon = np.degrees(to_east / ((normal + 62) * np.cos(latitude)))
    metre = np.degrees(1 / a)
    assert fix.latitude - ORIGIN[0] == pytest.approx(dlat, abs=0.02 * metre)
    assert fix.longitude - ORIGIN[1] == pytest.approx(dlon, abs=0.03 * metre)
    assert fix.height == pytest.approx(62 + (x * x + y * y) / 2 / a, abs=1e-3)
    np.testing.assert_allclose(fix.position, [x, y, 2.0])


def test_a_gps_has_a_fix_above_the_waves_only():
    model, data = scene(waves=[{"height": 1.0, "period": 6.0}])
    gps = Gps(model, "nose", origin=ORIGIN, **PERFECT)
    move(model, data, place=(0, 0, 0.3), time=0.0)  # the nose is 0.2 m above still water, under a crest of 0.5 m
    under = gps.read(data)
    assert not under.is_fixed and np.isnan(under.latitude) and np.isnan(under.position).all()
    assert gps.read(move(model, data, time=3.0)).is_fixed
    margin = Gps(model, "nose", origin=ORIGIN, margin=0.8, **PERFECT)
    assert not margin.read(data).is_fixed


def test_errors_of_a_gps_are_slow_and_white():
    model, data = scene(waterline=-5.0)
    times = np.arange(0, 4000, 25.0)
    positions = []
    for seed in range(25):
        gps = Gps(model, "rov", origin=ORIGIN, slow_noise=(2.0, 4.0), time_constant=200, noise=(0, 0), seed=seed)
        series = []
        for time in times:
            data.time = time
            series.append(gps.read(data).position - data.body("rov").xpos)
        positions.append(series)
    errors = np.array(positions)
    np.testing.assert_allclose(errors.std(axis=(0, 1)), [2, 2, 4], rtol=0.15)
    lag = 8  # one time constant
    share = (errors[:, lag:] * errors[:, :-lag]).mean(axis=(0, 1)) / errors.var(axis=(0, 1))
    np.testing.assert_allclose(share, np.exp(-1), atol=0.15)
    white = Gps(model, "rov", origin=ORIGIN, slow_noise=(0, 0), noise=(0.5, 1.0))
    series = []
    for time in times:
        data.time = time
        series.append(white.read(data).position - data.body("rov").xpos)
    np.testing.assert_allclose(np.std(series, axis=0), [0.5, 0.5, 1.0], rtol=0.15)


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"origin": (95, 0, 0)}, "origin is 95, 0, 0; expected latitude -90 to 90"),
        ({"origin": (1, 2)}, "origin is (1, 2); expected 3 numbers"),
        ({"noise": 0.5}, "noise is 0.5; expected 2 numbers"),
        ({"origin": (0, 0, float("nan"))}, "origin is 0, 0, nan; expected latitude -90 to 90"),
        ({"east": float("inf")}, "east is inf degrees; expected a finite number"),
        ({"time_constant": 0}, "time_constant is 0 s; expected at least 0.001 s"),
        ({"noise": (0.1, -1)}, "noise is -1.0 m; expected at least 0 m"),
        ({"margin": -1}, "margin is -1 m; expected at least 0 m"),
    ],
)
def test_refusals_of_a_gps(given, text):
    model, _ = scene()
    with pytest.raises(DataError, match=re.escape(text)):
        Gps(model, "nose", **({"origin": ORIGIN} | given))
