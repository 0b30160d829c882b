"""`hydro_mujoco.sensors` against closed forms: DVL, pressure, GPS."""

import re

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hydro_mujoco as hydro
from hydro_mujoco import DataError, plugin
from hydro_mujoco.sensors import Dvl, Gps, ImagingSonar, Multibeam, Pressure, SideScan, Usbl
from hydro_mujoco.sensors.noise import Noise
from seabed import move, scene

pytestmark = [
    pytest.mark.skipif(not plugin.built_library().is_file(), reason="no plugin library: cargo build --release"),
    pytest.mark.filterwarnings("ignore"),
]
EXACT = {"velocity_noise": 0, "scale_error": 0, "range_noise": 0}
QUIET = {"noise": 0, "bias": 0}
TILT = st.tuples(*[st.floats(-0.15, 0.15)] * 2, st.floats(-1, 1))
THREE = st.tuples(*[st.floats(-2, 2)] * 3)


def axes(data, site="nose"):
    return data.site(site).xmat.reshape(3, 3)


@given(TILT, THREE, THREE, st.floats(-1, 1))
@settings(max_examples=25, deadline=None)
def test_bottom_track_of_a_tilted_turning_vehicle_over_a_moving_plane(tilt, velocity, rate, bottom):
    model, data = scene(depth=12, mounted="0.96 0 0 0.28")
    move(model, data, quat=(1, *tilt), velocity=velocity, rate=rate, bottom=bottom)
    reading = Dvl(model, "nose", **EXACT).read(data)
    frame, origin = axes(data), data.site("nose").xpos
    # Velocity of the nose by rigid-body kinematics.
    body = data.body("rov").xmat.reshape(3, 3)
    nose = np.array(velocity) + body @ np.cross(rate, model.site("nose").pos)
    np.testing.assert_allclose(reading.bottom, frame.T @ (nose - [bottom, 0, 0]), atol=1e-9)
    azimuths = np.radians([45, 135, 225, 315])
    beams = np.array([[0.5 * np.cos(a), 0.5 * np.sin(a), -np.sqrt(0.75)] for a in azimuths])
    np.testing.assert_allclose(reading.ranges, -(12 + origin[2]) / (beams @ frame.T)[:, 2], rtol=1e-9)


def test_a_level_dvl_over_a_plane():
    model, data = scene(depth=10)
    reading = Dvl(model, "rov", angle=20, **EXACT).read(move(model, data, velocity=(1, 2, 3)))
    assert reading.altitude == pytest.approx(8.0)
    np.testing.assert_allclose(reading.ranges, 8 / np.cos(np.radians(20)))
    np.testing.assert_allclose(reading.bottom, [1, 2, 3])
    np.testing.assert_allclose(reading.water, [1, 2, 3])


def test_a_bottom_that_turns_moves_otherwise_at_every_point():
    model, data = scene(depth=10)
    reading = Dvl(model, "rov", **EXACT).read(move(model, data, place=(5, -3, -2), turn=0.2))
    # What it adds at the feet of the beams is across each of them.
    np.testing.assert_allclose(reading.bottom, [-0.2 * 3, -0.2 * 5, 0], atol=1e-9)


def test_water_track_is_relative_to_the_layer():
    profile = [{"depth": 0, "velocity": [0.6, 0, 0]}, {"depth": 100, "velocity": [0, 0.4, 0]}]
    model, data = scene(depth=60, current={"schema": "hydro-current/1", "profile": profile})
    move(model, data, velocity=(0.5, 0, 0.1), quat=(1, 0, 0, 1))
    reading = Dvl(model, "rov", layer=(4, 12), reach=(0.1, 80), **EXACT).read(data)
    share = (2 + 8 * np.cos(np.radians(30))) / 100  # depth of the layer's middle
    relative = np.array([0.5 - 0.6 * (1 - share), -0.4 * share, 0.1])
    np.testing.assert_allclose(reading.water, axes(data).T @ relative, atol=1e-12)
    np.testing.assert_allclose(reading.bottom, axes(data).T @ [0.5, 0, 0.1], atol=1e-12)


def test_water_track_in_waves_is_the_orbital_velocity():
    waves = [{"height": 1.0, "period": 9.0, "direction": 30}]
    model, data = scene(depth=90, waves=waves)
    layer = (0.10, 0.14)
    for time in (0.0, 2.0, 5.0):
        reading = Dvl(model, "rov", layer=layer, **EXACT).read(move(model, data, time=time))
        omega = 2 * np.pi / 9
        decay = np.exp(omega**2 / 9.81 * -(2 + 0.12 * np.cos(np.radians(30))))
        along = 0.5 * omega * decay * np.cos(omega * time)
        up = -0.5 * omega * decay * np.sin(omega * time)
        expected = -np.array([along * np.cos(np.radians(30)), along * np.sin(np.radians(30)), up])
        np.testing.assert_allclose(reading.water, expected, atol=2e-3)


def test_a_dvl_loses_the_bottom_and_the_water():
    model, data = scene(depth=10)
    dvl = Dvl(model, "rov", reach=(0.1, 9.0), layer=(1, 5), **EXACT)
    far = dvl.read(move(model, data, place=(0, 0, -2)))  # 9.24 m along the beams
    assert np.isnan(far.ranges).all() and np.isnan(far.bottom).all() and np.isnan(far.altitude)
    assert np.isfinite(far.water).all()
    near = dvl.read(move(model, data, place=(0, 0, -5.1)))  # 4.9 m above: the side lobe meets the bottom before 5 m
    assert np.isfinite(near.bottom).all() and np.isnan(near.water).all()
    dry = dvl.read(move(model, data, place=(0, 0, 0.01)))
    assert np.isnan(dry.ranges).all() and np.isnan(dry.water).all()
    upwards = dvl.read(move(model, data, place=(0, 0, -2), quat=(0, 1, 0, 0)))
    assert np.isnan(upwards.ranges).all() and np.isnan(upwards.water).all()


def test_three_beams_are_enough_and_two_are_not():
    model, data = scene(depth=10, half=5.0)
    dvl = Dvl(model, "rov", **EXACT)
    reach = 8 * np.tan(np.radians(30)) / np.sqrt(2)  # of each beam's foot from the axes, 3.27 m
    one_off = dvl.read(move(model, data, quat=(0.92388, 0, 0, 0.382683), place=(0, 2.0, -2), velocity=(0.3, 0.2, 0.1)))
    assert np.isfinite(one_off.ranges).sum() == 3
    np.testing.assert_allclose(one_off.bottom, axes(data).T @ [0.3, 0.2, 0.1], atol=1e-9)
    two_off = dvl.read(move(model, data, quat=(1, 0, 0, 0), place=(0, 5.1 - reach, -2)))
    assert np.isfinite(two_off.ranges).sum() == 2 and np.isnan(two_off.bottom).all()


def test_errors_of_a_dvl_have_the_covariance_of_the_beams():
    model, data = scene(depth=10)
    move(model, data, velocity=(1, 0, 0))
    dvl = Dvl(model, "rov", velocity_noise=0.01, scale_error=0, range_noise=0.05, seed=3)
    readings = []
    for tick in range(1500):
        data.time = 0.2 * tick
        readings.append(dvl.read(data))
    spread = np.cov(np.array([each.bottom for each in readings]).T)
    expected = 0.01**2 * np.linalg.inv(dvl.beams.T @ dvl.beams)
    np.testing.assert_allclose(spread, expected, atol=0.12 * expected.max())
    np.testing.assert_allclose(np.std([each.ranges for each in readings]), 0.05, rtol=0.04)
    scales = [
        Dvl(model, "rov", velocity_noise=0, scale_error=0.01, seed=seed).read(data).bottom[0] - 1 for seed in range(200)
    ]
    assert np.std(scales) == pytest.approx(0.01, rel=0.2)
    lost = [np.isnan(Dvl(model, "rov", dropout=0.3, seed=seed).read(data).ranges).mean() for seed in range(200)]
    assert np.mean(lost) == pytest.approx(0.3, abs=0.05)


def test_errors_are_functions_of_seed_name_and_time():
    model, data = scene()
    other = mujoco.MjData(model)
    for each in (data, other):
        move(model, each, place=(0, 0, -2), time=3.0)
    one = Dvl(model, "rov", seed=1)
    first = one.read(data)
    one.read(move(model, data, time=4.0))
    np.testing.assert_array_equal(Dvl(model, "rov", seed=1).read(other).bottom, first.bottom)
    np.testing.assert_array_equal(one.read(other).bottom, first.bottom)
    for changed in (Dvl(model, "rov", seed=2).read(other), Dvl(model, "nose", seed=1).read(other), one.read(data)):
        assert not np.array_equal(changed.bottom, first.bottom)


@given(st.floats(-50, 5))
@settings(max_examples=30, deadline=None)
def test_pressure_of_still_water(z):
    model, data = scene(depth=60, waterline=1.5, density=1025.0)
    move(model, data, place=(0, 0, z))
    reading = Pressure(model, "rov", **QUIET).read(data)
    assert reading.pressure == pytest.approx(101325 + 1025 * 9.81 * max(1.5 - z, 0))
    assert reading.depth == pytest.approx(max(1.5 - z, 0), abs=1e-9)


def test_the_pressure_of_a_wave_decays_with_depth():
    model, data = scene(depth=100, waves=[{"height": 2.0, "period": 6.0}])
    sensor, omega = Pressure(model, "rov", **QUIET), 2 * np.pi / 6
    for depth in (1.5, 10.0, 40.0):
        for time in (0.0, 1.1):
            reading = sensor.read(move(model, data, place=(3, 1, -depth), time=time))
            phase = omega**2 / 9.81 * 3 - omega * time
            wave = np.exp(-(omega**2) / 9.81 * depth) * np.cos(phase)
            assert reading.depth == pytest.approx(depth + wave, abs=1e-9)


def test_errors_of_a_pressure_sensor():
    model, data = scene()
    depths = []
    for tick in range(1500):
        data.time = float(tick)
        depths.append(Pressure(model, "rov", noise=500, bias=0, seed=tick % 7).read(data).pressure)
    assert np.std(depths) == pytest.approx(500, rel=0.07)
    biases = [Pressure(model, "rov", noise=0, bias=200, seed=seed).read(data).pressure for seed in range(300)]
    assert np.std(biases) == pytest.approx(200, rel=0.15)
    stepped = Pressure(model, "rov", resolution=250, seed=1).read(data).pressure
    assert stepped % 250 == 0


def test_a_gps_without_pymap3d_says_what_to_install(monkeypatch):
    model, _ = scene()

    def missing(name):
        raise ImportError(name)

    monkeypatch.setattr("hydro_mujoco.extras.import_module", missing)
    with pytest.raises(DataError, match=r"Gps needs the package pymap3d: pip install 'hydro-mujoco\[gps\]'"):
        Gps(model, "rov", origin=(41.7, -8.9, 60.0))


def test_errors_of_neighbouring_times_share_nothing():
    noise = Noise(0, "x")
    words = [noise.generator(time).integers(2**63, size=64) for time in (1.0, np.nextafter(1.0, 2), 2.0)]
    assert len({int(word) for series in words for word in series}) == 3 * 64


def test_slow_noise_is_normal():
    values = np.array([Noise(seed, "x").slow(17.0, 30.0, 5) for seed in range(1000)])
    assert np.mean(values) == pytest.approx(0, abs=0.04)
    assert np.std(values) == pytest.approx(1, abs=0.03)
    assert np.mean(values**4) == pytest.approx(3, abs=0.35)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda m: Dvl(m, "nosee"), "no site or body is called `nosee`; there are the sites: `nose`, `beacon`"),
        (
            lambda m: Pressure(m, "bottom"),
            "body `bottom` and those above it carry no hydro.wrench; these do: `rov`, `buoy`",
        ),
        (lambda m: Dvl(m, "nose", angle=90), "angle is 90 degrees; expected above 0 and below 90"),
        (lambda m: Dvl(m, "nose", reach=(5, 5)), "reach is 5 to 5 m; expected 0 <= least < most"),
        (lambda m: Dvl(m, "nose", layer=(-1, 5)), "layer is -1 to 5 m; expected 0 <= least < most"),
        (lambda m: Dvl(m, "nose", dropout=1.5), "dropout is 1.5; expected 0 to 1"),
        (lambda m: Dvl(m, "nose", velocity_noise=-1), "velocity_noise is -1 m/s; expected at least 0 m/s"),
        (lambda m: Dvl(m, "nose", seed=-1), "seed is -1; expected a whole number, 0 to 2^63 - 1"),
        (lambda m: Dvl(m, "nose", seed=1.5), "seed is 1.5; expected a whole number"),
        (lambda m: Pressure(m, "nose", noise=float("nan")), "noise is nan Pa; expected at least 0 Pa"),
        (lambda m: Multibeam(m, "nose", beams=0), "beams is 0; expected a whole number, at least 1"),
        (lambda m: Multibeam(m, "nose", swath=360), "swath is 360 degrees; expected above 0 and below 360"),
        (lambda m: Multibeam(m, "nose", weakest=2), "weakest is 2; expected 0 to 1"),
        (lambda m: ImagingSonar(m, "nose", height=0), "height is 0 degrees; expected above 0 and below 180"),
        (lambda m: ImagingSonar(m, "nose", rays=9999), "959904 rays a ping; expected at most 200000"),
        (lambda m: ImagingSonar(m, "nose", bins=0), "bins is 0; expected a whole number, at least 1"),
        (lambda m: Multibeam(m, "nose", beams=3.5), "beams is 3.5; expected a whole number, at least 1"),
        (lambda m: ImagingSonar(m, "nose", rays=True), "rays is True; expected a whole number, at least 1"),
        (lambda m: Dvl(m, "nose", reach=5), "reach is 5; expected 2 numbers"),
        (lambda m: SideScan(m, "nose", depression=(10, 100)), "depression is 10 to 100 degrees; expected 90 at most"),
        (lambda m: SideScan(m, "nose", rays=0), "rays is 0; expected a whole number, at least 1"),
        (lambda m: Usbl(m, "nose", "beacon", sound_speed=0), "sound_speed is 0 m/s; expected at least 1 m/s"),
        (lambda m: Usbl(m, "nose", "beacon", dropout="x"), "dropout is x; expected 0 to 1"),
        (lambda m: Dvl(m, "nose", angle="x"), "angle is x degrees; expected above 0 and below 90"),
        (lambda m: Multibeam(m, "nose", weakest="x"), "weakest is x; expected 0 to 1"),
        (lambda m: Usbl(m, "nose", "beacon", dropout=-1), "dropout is -1; expected 0 to 1"),
        (lambda m: Usbl(m, "nose", "beakon"), "no site or body is called `beakon`"),
    ],
)
def test_refusals(make, text):
    model, _ = scene(two=True)
    with pytest.raises(DataError, match=re.escape(text)):
        make(model)


def test_data_of_another_model_are_refused():
    model, data = scene()
    _, other = scene()
    sensors = (Dvl, Pressure, Multibeam, ImagingSonar, SideScan)
    for sensor in sensors:
        with pytest.raises(DataError, match="the data are not of the model that the sensor at `rov` was made for"):
            sensor(model, "rov").read(other)
    assert hydro.sensors.Pressure(model, "rov").read(data).depth > 1
