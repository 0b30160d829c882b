"""`hydro_mujoco.sensors.Ins` with aids: normalised errors by chi-square, bounds, losses."""

import numpy as np
import pytest

from hydro_mujoco import plugin
from hydro_mujoco.sensors import Dvl, Gps, Imu, Ins, Pressure
from navigation import circle, error
from seabed import move, scene

pytestmark = [
    pytest.mark.skipif(not plugin.built_library().is_file(), reason="no plugin library: cargo build --release"),
    pytest.mark.filterwarnings("ignore"),
]


def aided(model, data, seed, *, seconds=40.0, step=0.5, **given):
    """Error and reading of an `Ins` with DVL and pressure after a way along the circle."""
    dvl, pressure = Dvl(model, "nose", seed=seed), Pressure(model, "nose", seed=seed)
    ins = Ins(model, "rov", dvl=dvl, pressure=pressure, seed=seed, **({"period": 2.0} | given))
    for tick in range(round(seconds / step) + 1):
        place, velocity = circle(model, data, tick * step)
        reading = ins.read(data)
    return error(reading, place, velocity, data.body("rov").xmat), reading


def test_normalised_errors_of_the_filter_are_chi_square():
    model, data = scene(depth=30, mounted="0.96 0 0 0.28")
    runs = [aided(model, data, seed) for seed in range(40)]
    # Chi-square of 360 degrees of freedom (40 runs, 9 numbers), within 3.3 standard deviations.
    squares = np.array([found @ np.linalg.solve(reading.covariance, found) for found, reading in runs])
    assert squares.mean() == pytest.approx(9, abs=3.3 * np.sqrt(2 * 9 / 40))
    # Each of the nine alone: of 40 degrees of freedom.
    single = np.array([(found / reading.deviation.ravel()) ** 2 for found, reading in runs]).mean(axis=0)
    assert (single > 0.35).all() and (single < 1.9).all()


def test_a_coarse_pressure_sensor_is_believed_no_more_than_its_step():
    model, data = scene(depth=30)
    squares = []
    for seed in range(12):
        pressure = Pressure(model, "nose", noise=0.0, bias=0.0, resolution=3000.0, seed=seed)
        ins = Ins(model, "rov", dvl=Dvl(model, "nose", seed=seed), pressure=pressure, period=2.0, seed=seed)
        for tick in range(41):
            move(model, data, place=(0, 0, -5.13 - 0.02 * seed), velocity=(0, 0, 0), time=tick)
            reading = ins.read(data)
        found = error(reading, data.body("rov").xpos, np.zeros(3), data.body("rov").xmat)
        squares.append(found[2] ** 2 / reading.covariance[2, 2])
        assert reading.deviation.ravel()[2] < 0.3
    assert np.mean(squares) < 3


def test_out_of_the_water_pressure_tells_no_height():
    model, data = scene(depth=30)
    ins = Ins(model, "rov", pressure=Pressure(model, "nose"), period=0.5)
    heights = {}
    for tick in range(121):
        # Three seconds under water and three on deck.
        height = -2.0 if tick < 60 else 1.5
        move(model, data, place=(0, 0, height), velocity=(0, 0, 0), time=0.05 * tick)
        reading = ins.read(data)
        heights[tick] = height - reading.position[2], reading.deviation.ravel()[2]
    assert abs(heights[59][0]) < 4 * heights[59][1]
    # The step to the deck is no motion that the inertial unit feels: from there on the estimate is not drawn to the surface.
    assert heights[120][0] == pytest.approx(heights[60][0], abs=0.2) and heights[120][1] > heights[59][1]


def test_in_waves_it_needs_to_know_their_noise_of_depth():
    model, data = scene(depth=30, waves=[{"height": 1.0, "period": 6.0}])
    calm, told = (
        np.mean([found @ np.linalg.solve(reading.covariance, found) for found, reading in runs])
        for runs in ([aided(model, data, seed, depth_noise=noise) for seed in range(8)] for noise in (0.0, 0.3))
    )
    assert told == pytest.approx(9, abs=3.3 * np.sqrt(2 * 9 / 8)) and calm > 15


def test_aided_by_dvl_and_pressure_the_error_is_a_share_of_the_way():
    model, data = scene(depth=30)
    # Half a turn, so that errors of heading and scale do not close up: way 94 m.
    runs = [aided(model, data, seed, seconds=58.8) for seed in range(10)]
    way = 20 * 0.08 * 58.8
    flat = np.array([np.hypot(*found[:2]) for found, _ in runs])
    # 0.3 degrees of heading are 0.5 % of the way, beside 0.1 m of the first fix; without aids it is 25 m and more.
    assert np.sqrt(np.mean(flat**2)) < 0.005 * way + 0.15
    assert np.abs([found[2] for found, _ in runs]).max() < 0.05
    assert np.abs([found[3:6] for found, _ in runs]).max() < 0.03
    free = Ins(model, "rov", seed=0)
    for tick in range(118):
        place, _ = circle(model, data, 0.5 * tick)
        reading = free.read(data)
    assert np.hypot(*(place - reading.position)[:2]) > 5 * flat.max()


def test_a_dvl_that_loses_the_bottom_lets_it_drift():
    model, data = scene(depth=100)  # beyond the DVL's reach of 50 m
    lost, reading = aided(model, data, 0)
    assert np.hypot(*lost[:2]) > 1 and np.hypot(*reading.deviation[0, :2]) > 5
    assert abs(lost[2]) < 0.1


def test_fixes_and_gps_bound_it():
    pytest.importorskip("pymap3d")
    model, data = scene(depth=100)
    spread = []
    for seed in range(20):
        ins, random = Ins(model, "rov", seed=seed), np.random.default_rng(seed)
        for tick in range(121):
            place, velocity = circle(model, data, 0.5 * tick)
            reading = ins.read(data)
            if tick % 20 == 19:
                ins.fix(place + 0.5 * random.standard_normal(3), 0.5)
        reading = ins.read(data)
        found = error(reading, place, velocity, data.body("rov").xmat)
        spread.append(found[:6] @ np.linalg.solve(reading.covariance[:6, :6], found[:6]))
        assert np.abs(found[:3]).max() < 3
    assert np.mean(spread) == pytest.approx(6, abs=3.3 * np.sqrt(2 * 6 / 20))
    # Afloat: a receiver 0.3 m above the surface, whose slow error the filter knows.
    squares = []
    for seed in range(20):
        gps = Gps(model, "rov", origin=(41.7, -8.9, 60.0), seed=seed)
        ins = Ins(model, "rov", gps=gps, period=1.0, seed=seed)
        for tick in range(61):
            reading = ins.read(move(model, data, place=(0, 0, 0.3), velocity=(0, 0, 0), time=float(tick)))
        found = error(reading, np.array([0, 0, 0.3]), np.zeros(3), data.body("rov").xmat)
        squares.append(found @ np.linalg.solve(reading.covariance, found))
    assert np.mean(squares) == pytest.approx(9, abs=3.3 * np.sqrt(2 * 9 / 20))


@pytest.mark.parametrize("alignment", [0.0, 0.1])
@pytest.mark.parametrize("height", [-5.0, 0.5])
def test_perfect_aids_of_a_perfect_unit_leave_no_error(alignment, height):
    model, data = scene(depth=30)
    aids = {"dvl": Dvl(model, "rov", velocity_noise=0, scale_error=0)}
    if height < 0:
        aids["pressure"] = Pressure(model, "rov", noise=0, bias=0)
    else:
        pytest.importorskip("pymap3d")
        aids["gps"] = Gps(model, "rov", origin=(0, 0, 0), noise=(0, 0), slow_noise=(0, 0))
    imu = Imu(**{name: 0.0 for name in vars(Imu()) if name != "memory"})
    aligned = dict.fromkeys(("position", "velocity", "tilt", "heading"), alignment)
    ins = Ins(model, "rov", imu=imu, **aids, **aligned)
    for tick in range(101):
        reading = ins.read(move(model, data, place=(0, 0, height), time=0.2 * tick))
    found = error(reading, np.array([0, 0, height]), np.zeros(3), data.body("rov").xmat)
    assert np.isfinite(reading.covariance).all()
    assert found[2] == pytest.approx(0, abs=1e-4) and np.abs(found[3:6]).max() < 1e-4
