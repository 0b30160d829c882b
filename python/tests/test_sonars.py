"""`hydro_mujoco.sensors` against closed forms: sonars, acoustic positioning, and all of them in an environment."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hydro_mujoco import plugin
from hydro_mujoco.sensors import Dvl, ImagingSonar, Multibeam, Pressure, SideScan, Usbl
from seabed import ON_THE_WORLD, move, scene

pytestmark = [
    pytest.mark.skipif(not plugin.built_library().is_file(), reason="no plugin library: cargo build --release"),
    pytest.mark.filterwarnings("ignore"),
]
EXACT = {"range_noise": 0, "range_scale_noise": 0}
TILT = st.tuples(*[st.floats(-0.1, 0.1)] * 2, st.floats(-1, 1))


@given(TILT, st.floats(-9, -1))
@settings(max_examples=30, deadline=None)
def test_a_multibeam_over_a_plane(tilt, z):
    model, data = scene(depth=14)
    move(model, data, place=(3, -2, z), quat=(1, *tilt))
    sonar = Multibeam(model, "rov", beams=33, swath=100, reach=(0.1, 150), **EXACT)
    reading = sonar.read(data)
    axes = data.body("rov").xmat.reshape(3, 3)
    beams = np.column_stack([0 * sonar.angles, np.sin(sonar.angles), -np.cos(sonar.angles)])
    down = -(beams @ axes.T)[:, 2]
    np.testing.assert_allclose(reading.ranges, (14 + z) / down, rtol=1e-9)
    np.testing.assert_allclose(reading.intensity, down**2, rtol=1e-9)
    bottom = data.body("rov").xpos + reading.points @ axes.T
    np.testing.assert_allclose(bottom[:, 2], -14, atol=1e-9)


def test_a_multibeam_sees_a_ball_on_the_bottom_and_not_beyond_reach():
    ball = '<geom name="ball" size="1.5" pos="0 4 -8"/>'
    model, data = scene(depth=10, more=ball)
    sonar = Multibeam(model, "rov", beams=121, swath=120, reach=(0.1, 15.0), **EXACT)
    reading = sonar.read(data)
    towards = np.arctan2(4, 6)
    off = np.abs(sonar.angles - towards)
    distance = np.hypot(4, 6)
    seen = off < np.arcsin(1.5 / distance) - 1e-6
    expected = distance * np.cos(off[seen]) - np.sqrt(1.5**2 - (distance * np.sin(off[seen])) ** 2)
    np.testing.assert_allclose(reading.ranges[seen], expected, rtol=1e-9)
    assert seen.sum() > 15
    beyond = ~seen & (8 / np.cos(sonar.angles) > 15)
    assert beyond.sum() > 4 and np.isnan(reading.ranges[beyond]).all() and (reading.intensity[beyond] == 0).all()
    assert np.isnan(reading.points[beyond]).all()


def test_echoes_pass_the_vehicle_and_markers_and_end_at_the_surface():
    wall = '<geom name="wall" type="box" size="0.5 50 50" pos="8.5 0 0"/>'
    model, data = scene(depth=10, more=wall)
    # Up through the hull, the fin below, and the marker at 2.5 m; a wall that reaches out of the water.
    sonar = Multibeam(model, "nose", beams=1, swath=10, **EXACT)
    np.testing.assert_allclose(sonar.read(data).ranges, [10 - 2.1])
    flat = Multibeam(model, "rov", beams=3, swath=20, **EXACT)
    # Turned so that -z looks along +x: the first and the last beam go 10 degrees to the sides, all meet the wall.
    ranges = flat.read(move(model, data, quat=(np.sqrt(0.5), 0, -np.sqrt(0.5), 0))).ranges
    np.testing.assert_allclose(ranges, [8 / np.cos(np.radians(10)), 8, 8 / np.cos(np.radians(10))], rtol=1e-9)
    # 30 degrees up from there the wall is met 2.6 m above the water.
    half = np.radians(120) / 2
    up = flat.read(move(model, data, quat=(np.cos(half), 0, -np.sin(half), 0))).ranges
    assert np.isnan(up).all()
    level = np.radians(100) / 2
    assert np.isfinite(flat.read(move(model, data, quat=(np.cos(level), 0, -np.sin(level), 0))).ranges).all()


def test_errors_and_weak_echoes_of_a_multibeam():
    model, data = scene(depth=12)
    sonar = Multibeam(model, "rov", beams=64, swath=120, range_noise=0.02, range_scale_noise=0.002, weakest=0.5)
    errors = []
    for tick in range(300):
        reading = sonar.read(move(model, data, time=0.1 * tick))
        errors.append(reading.ranges - 10 / np.cos(sonar.angles))
    heard = np.abs(sonar.angles) < np.radians(45)
    np.testing.assert_array_equal(np.isfinite(errors), np.broadcast_to(heard, (300, 64)))
    deviation = np.hypot(0.02, 0.002 * 10 / np.cos(sonar.angles[heard]))
    np.testing.assert_allclose(np.std(errors, axis=0)[heard], deviation, rtol=0.2)


def test_a_picture_of_a_wall():
    wall = '<geom name="wall" type="box" size="0.5 50 50" pos="9.5 0 0"/>'
    model, data = scene(depth=90, more=wall)
    move(model, data, place=(0, 0, -30))
    sonar = ImagingSonar(model, "rov", beams=31, width=80, height=12, bins=300, reach=(1, 31), speckle=False)
    image = sonar.read(data)
    for beam, bearing in enumerate(image.bearings):
        filled = image.ranges[image.intensity[:, beam] > 0]
        nearest = 9 / np.cos(bearing)
        assert nearest - 0.1 < filled[0] <= nearest + 0.1
        assert filled[-1] == pytest.approx(nearest / np.cos(np.radians(6)), abs=0.11)
        # Mean of cos^2 bearing cos^2 elevation over the beam's height.
        h = np.radians(6)
        mean = np.cos(bearing) ** 2 * (0.5 + np.sin(2 * h) / (4 * h))
        assert image.intensity[:, beam].sum() == pytest.approx(mean, rel=1e-3)


def test_what_stands_on_the_bottom_casts_a_shadow():
    post = '<geom name="post" type="box" size="0.2 0.2 0.5" pos="5.2 0 -7.5"/>'
    model, data = scene(depth=8, more=post)
    move(model, data, place=(0, 0, -6))
    # 2 m above the bottom; the post's top edge, 1 m above it, shades the bottom from 5.4 m to 10.8 m ahead.
    sonar = ImagingSonar(model, "rov", beams=3, width=30, height=50, rays=4000, bins=400, reach=(1, 21), speckle=False)
    image = sonar.read(data)
    shaded = (image.ranges > np.hypot(5.45, 1.9)) & (image.ranges < np.hypot(10.7, 2))
    assert image.intensity[shaded, 1].max() == 0
    assert (image.intensity[shaded, 0] > 0).all()
    behind = (image.ranges > np.hypot(10.9, 2)) & (image.ranges < 16)
    assert (image.intensity[behind, 1] > 0).all()
    face = (image.ranges > 5.05) & (image.ranges < np.hypot(5, 2))
    assert image.intensity[face, 1].sum() > 10 * image.intensity[face, 0].sum()


def test_speckle_is_exponential_and_noise_fills_the_picture():
    wall = '<geom name="wall" type="box" size="0.5 50 50" pos="9.5 0 0"/>'
    model, data = scene(depth=90, more=wall)
    move(model, data, place=(0, 0, -30))
    given = {"beams": 64, "width": 10, "height": 0.2, "rays": 1, "bins": 20, "reach": (1, 21)}
    plain = ImagingSonar(model, "rov", speckle=False, **given).read(data).intensity
    sonar = ImagingSonar(model, "rov", **given)
    ratios = []
    for tick in range(60):
        ratios.append(sonar.read(move(model, data, time=float(tick))).intensity[plain > 0] / plain[plain > 0])
    assert np.mean(ratios) == pytest.approx(1, abs=0.05) and np.std(ratios) == pytest.approx(1, abs=0.08)
    noisy = ImagingSonar(model, "rov", speckle=False, background=0.01, **given).read(data).intensity
    assert np.mean(noisy - plain) == pytest.approx(0.01, rel=0.1) and (noisy > 0).all()


def test_a_side_scan_over_a_plane():
    model, data = scene(depth=9)
    move(model, data, place=(0, 0, -2), quat=(1, 0, 0, 0.7))
    sonar = SideScan(model, "rov", depression=(10, 80), rays=50_000, bins=60, reach=(1, 31), speckle=False)
    line = sonar.read(data)
    # Depression at the edges of the bins; sin^2 of it is Lambert's.
    edges = np.arcsin(np.minimum(7 / (line.ranges[:, None] + [-0.25, 0.25]), 1))
    edges = np.clip(edges, *np.radians([10, 80]))
    whole = 0.5 * edges - 0.25 * np.sin(2 * edges)
    expected = (whole[:, 0] - whole[:, 1]) / np.radians(70)
    np.testing.assert_allclose(line.port, expected, atol=2e-5)
    np.testing.assert_allclose(line.starboard, expected, atol=2e-5)
    assert (line.port[line.ranges < 7] == 0).all() and line.port[line.ranges > 7.5].min() > 0


def test_a_side_scan_has_shadows_on_the_side_of_what_casts_them():
    post = '<geom name="post" type="box" size="0.3 0.2 0.5" pos="0 -6.2 -8.5"/>'
    model, data = scene(depth=9, more=post)
    move(model, data, place=(0, 0, -6))
    # 3 m above the bottom: the top edge, 1 m above it, shades the bottom from 6.4 m to 9.6 m to starboard.
    line = SideScan(model, "rov", rays=20_000, bins=300, reach=(1, 31), speckle=False).read(data)
    shaded = (line.ranges > np.hypot(6.5, 2.05)) & (line.ranges < np.hypot(9.5, 3))
    assert line.starboard[shaded].max() == 0 and line.port[shaded].min() > 0
    behind = (line.ranges > np.hypot(9.8, 3)) & (line.ranges < 20)
    assert line.starboard[behind].min() > 0
    noisy = SideScan(model, "rov", background=0.01).read(data)
    assert noisy.port.min() > 0 and not np.array_equal(noisy.port, noisy.starboard)


PLAIN = {"range_noise": 0, "angle_noise": 0}


def positions(model, data, usbl, steps, place, beacon):
    """Fixes of a transceiver and a transponder at `place(t)` and `beacon(t)`."""
    fixes = []
    for tick in range(steps):
        time = tick * model.opt.timestep
        data.mocap_pos[0] = beacon(time)
        fix = usbl.poll(move(model, data, place=place(time), time=time))
        if fix is not None:
            fixes.append((tick, fix))
    return fixes


@given(st.floats(-600, 600), st.floats(-600, 600), st.floats(-60, -3), st.floats(-1, 1))
@settings(max_examples=15, deadline=None)
def test_a_transponder_at_rest(x, y, z, yaw):
    model, data = scene(depth=100, half=2000.0)
    move(model, data, quat=(1, 0, 0, yaw), place=(0, 0, -2))
    usbl = Usbl(model, "rov", "beacon", period=5.0, turnaround=0.05, **PLAIN)
    fixes = positions(model, data, usbl, 250, lambda t: (0, 0, -2), lambda t: (x, y, z))
    way = np.array([x, y, z + 2])
    distance = np.linalg.norm(way)
    ((tick, fix),) = fixes
    assert fix.range == pytest.approx(distance, abs=1e-6)
    assert fix.time == pytest.approx(2 * distance / 1500 + 0.05) and fix.sent == 0
    # The first call after its arrival.
    assert fix.time <= tick * 0.01 + 1e-9 < fix.time + 0.0101
    axes = data.body("rov").xmat.reshape(3, 3)
    np.testing.assert_allclose(axes @ fix.position, way, atol=1e-6)
    ahead, aside, up = axes.T @ way
    assert fix.elevation == pytest.approx(np.arctan2(up, np.hypot(ahead, aside)), abs=1e-7)
    # Straight below there is no bearing.
    if np.hypot(ahead, aside) > 1e-3:
        assert fix.bearing == pytest.approx(np.arctan2(aside, ahead))


def test_both_move_while_the_sound_is_under_way():
    model, data = scene(depth=100, half=2000.0)
    usbl = Usbl(model, "rov", "beacon", period=100.0, **PLAIN)
    # Both along x, head on: closed form of the meeting of sound and body.
    v, w, start, c = 3.0, -8.0, 700.0, 1500.0
    ((_, fix),) = positions(model, data, usbl, 130, lambda t: (v * t, 0, -20), lambda t: (start + w * t, 0, -20))
    heard = start / (c - w)
    there = start + w * heard
    back = heard + (there - v * heard) / (c + v)
    assert fix.time == pytest.approx(back, abs=1e-9)
    assert fix.range == pytest.approx(0.5 * c * back, abs=1e-6)
    np.testing.assert_allclose(fix.position / fix.range, [1, 0, 0], atol=1e-9)


def test_pings_repeat_and_are_lost():
    wall = '<geom name="wall" type="box" size="0.5 50 50" pos="9.5 0 0"/>'
    model, data = scene(depth=100, half=2000.0, more=wall)

    def heard(place, beacon, **given):
        usbl = Usbl(model, "rov", "beacon", **{"period": 0.5, **PLAIN, **given})
        return positions(model, data, usbl, 210, lambda t: place, lambda t: beacon)

    assert len(heard((0, 0, -20), (-80, 0, -40))) == 4
    assert not heard((0, 0, -20), (80, 0, -40))  # behind the wall
    assert not heard((0, 0, -20), (-80, 0, 0.5)) and not heard((0, 0, 0.5), (-80, 0, -20))  # out of the water
    assert not heard((0, 0, -20), (-80, 0, -40), reach=50.0)
    lost = heard((0, 0, -20), (-80, 0, -40), period=0.11, dropout=0.5)
    assert 3 < len(lost) < 16


def test_errors_and_time_going_back():
    model, data = scene(depth=100, half=2000.0)
    usbl = Usbl(model, "rov", "beacon", period=0.1, range_noise=0.5, angle_noise=1.0)
    fixes = positions(model, data, usbl, 6000, lambda t: (0, 0, -20), lambda t: (0, 45, -20))
    fixes = [fix for _, fix in fixes]
    assert len(fixes) > 500
    assert np.std([fix.range for fix in fixes]) == pytest.approx(0.5, rel=0.1)
    assert np.std([fix.bearing for fix in fixes]) == pytest.approx(np.radians(1), rel=0.1)
    assert np.std([fix.elevation for fix in fixes]) == pytest.approx(np.radians(1), rel=0.1)
    again = positions(model, data, usbl, 40, lambda t: (0, 0, -20), lambda t: (0, 45, -20))
    assert again[0][1].time == pytest.approx(0.06) and again[0][1].range == fixes[0].range


def test_sensors_in_a_gymnasium_environment():
    gymnasium = pytest.importorskip("gymnasium")
    import hydro_mujoco.envs  # noqa: F401

    class Instruments(gymnasium.ObservationWrapper):
        """Adds what a DVL and a pressure sensor read to the observation."""

        def __init__(self, env):
            super().__init__(env)
            self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (env.observation_space.shape[0] + 4,))

        def reset(self, *, seed=None, options=None):
            self.env.reset(seed=seed, options=options)
            inner = self.env.unwrapped
            number = int(inner.np_random.integers(2**31))
            # Of the episode's model: each sea has its own.
            self.dvl, self.pressure = Dvl(inner.model, "rov", seed=number), Pressure(inner.model, "rov", seed=number)
            return self.observation(inner.task.observe(inner._state())[0]), {}

        def observation(self, observation):
            data = self.env.unwrapped.data
            return np.concatenate([observation, self.dvl.read(data).water, [self.pressure.read(data).depth]])

    def episode():
        env = Instruments(gymnasium.make("hydro_mujoco/RovStation-v0", seas=2))
        first, _ = env.reset(seed=5)
        rows = [first]
        for _ in range(5):
            observation, _, terminated, _, _ = env.step(np.zeros(8, np.float32))
            rows.append(observation)
            assert np.isfinite(observation).all() and not terminated
        depth, z = rows[-1][-1], env.unwrapped.data.body("rov").xpos[2]
        assert depth == pytest.approx(-z, abs=0.35)  # of the waves
        env.close()
        return np.array(rows)

    np.testing.assert_array_equal(episode(), episode())


@pytest.mark.parametrize("place", ["floor", "wall"])
@pytest.mark.parametrize("turned", [False, True])
def test_usbl_finds_what_is_fixed_to_the_floor_or_to_a_wall(place, turned):
    model, data = scene(more=ON_THE_WORLD)
    ends = (place, "rov") if turned else ("rov", place)
    ((_, fix),) = positions(model, data, Usbl(model, *ends, **PLAIN), 10, lambda t: (0, 0, -2), lambda t: (0, 0, -20))
    assert fix.range == pytest.approx(np.linalg.norm(data.site(place).xpos - data.body("rov").xpos))
