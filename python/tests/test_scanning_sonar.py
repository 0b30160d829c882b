"""`hydro_mujoco.sensors.ScanningSonar` against closed forms: ranges by angle, times of beams, distortion by motion."""

import re

import mujoco
import numpy as np
import pytest

from hydro_mujoco import DataError, plugin
from hydro_mujoco.sensors import ImagingSonar, ScanningSonar
from seabed import move, scene

pytestmark = [
    pytest.mark.skipif(not plugin.built_library().is_file(), reason="no plugin library: cargo build --release"),
    pytest.mark.filterwarnings("ignore"),
]
WALL = '<geom name="wall" type="box" size="0.5 500 50" pos="9.5 0 0"/>'
#: A thin beam; a ping takes 0.02 s.
THIN = {"width": 0.02, "height": 0.02, "across": 1, "rays": 1, "speckle": False, "bins": 290, "reach": (0.5, 15.0)}


def scan(model, data, sonar, seconds, pose=lambda t: {}, *, step=0.005):
    """Beams of a sonar whose vehicle has `pose(t)`."""
    beams = []
    for tick in range(round(seconds / step) + 1):
        time = tick * step
        beam = sonar.poll(move(model, data, time=time, **({"place": (0, 0, -30)} | pose(time))))
        if beam is not None:
            beams.append((time, beam))
    return beams


def first(ranges, intensity):
    """Nearest range with an echo [m], not a number without one."""
    found = np.flatnonzero(intensity)
    return ranges[found[0]] if len(found) else np.nan


def test_a_full_turn_takes_the_time_of_its_pings_and_the_head_stays_for_each():
    model, data = scene(depth=90)
    sonar = ScanningSonar(model, "rov", step=3.6, **THIN)
    beams = scan(model, data, sonar, 2.5)
    # 100 steps of 0.02 s each.
    np.testing.assert_allclose([beam.time for _, beam in beams], 0.02 * np.arange(125), atol=1e-9)
    np.testing.assert_allclose([heard - beam.time for heard, beam in beams], 0.02, atol=1e-9)
    np.testing.assert_allclose([beam.angle for _, beam in beams], np.radians(3.6 * (np.arange(125) % 100)))
    assert beams[100][1].time == pytest.approx(2.0)
    # Two reaches by the speed of sound and the pause, at the next call.
    slow = ScanningSonar(model, "rov", step=90, pause=0.1, sound_speed=1400.0, **THIN)
    beams = scan(model, data, slow, 1.0)
    np.testing.assert_allclose([heard - beam.time for heard, beam in beams], 0.025, atol=1e-9)
    np.testing.assert_allclose(np.diff([beam.time for _, beam in beams]), 0.125, atol=1e-9)
    assert slow.sweep().times == pytest.approx([0.5, 0.625, 0.75, 0.875])


def test_a_sector_goes_to_and_fro_and_has_both_borders():
    model, data = scene(depth=90)
    sonar = ScanningSonar(model, "rov", sector=(150, 210), step=25, **THIN)
    beams = scan(model, data, sonar, 0.23)
    # The step becomes 20 degrees.
    there = [150, 170, 190, 210, 190, 170, 150, 170, 190, 210, 190]
    np.testing.assert_allclose(np.degrees([beam.angle for _, beam in beams]), there)
    np.testing.assert_allclose(np.degrees(sonar.sweep().angles), [150, 170, 190, 210])
    np.testing.assert_allclose(sonar.sweep().times, [0.12, 0.14, 0.2, 0.18], atol=1e-9)
    one = ScanningSonar(model, "rov", sector=(-10, 10), step=50, **THIN)
    angles = [beam.angle for _, beam in scan(model, data, one, 0.1)]
    np.testing.assert_allclose(np.degrees(angles), [-10, 10, -10, 10, -10])


def test_range_bins_of_a_wall_and_a_ball_by_angle():
    ball = '<geom name="ball" size="1.5" pos="-3 5 -30"/>'
    model, data = scene(depth=90, more=WALL + ball)
    sonar = ScanningSonar(model, "rov", step=1.0, **THIN)
    scan(model, data, sonar, 7.5, lambda t: {"quat": (1, 0.04, -0.08, 0.3)})
    sweep = sonar.sweep()
    assert sweep.intensity.shape == (360, 290) and np.isfinite(sweep.times).all()
    # Along the beams of a head on a tilted vehicle.
    beams = np.column_stack([np.cos(sweep.angles), np.sin(sweep.angles), 0 * sweep.angles])
    beams = beams @ data.body("rov").xmat.reshape(3, 3).T
    along = beams @ (-3, 5, 0)
    chord = 1.5**2 - (3**2 + 5**2 - along**2)
    hits = (chord > 0) & (along > 0)
    expected = np.where(hits, along - np.sqrt(np.maximum(chord, 0)), np.nan)
    ahead = 9 / beams[:, 0]
    expected = np.where((ahead > 0) & (ahead <= 15), ahead, expected)
    seen = np.array([first(sweep.ranges, row) for row in sweep.intensity])
    np.testing.assert_allclose(seen, expected, atol=0.025 + 1e-9)
    wall = np.isfinite(seen) & (ahead > 0)
    assert hits.sum() > 20 and wall.sum() > 90
    np.testing.assert_allclose(sweep.intensity[wall].sum(axis=1), beams[wall, 0] ** 2, rtol=1e-6)


def test_a_beam_has_a_width_and_a_height():
    model, data = scene(depth=90, more=WALL)
    given = THIN | {"width": 40.0, "height": 12.0, "across": 80, "rays": 64}
    sonar = ScanningSonar(model, "rov", sector=(10, 30), step=20, **given)
    (_, beam), *_ = scan(model, data, sonar, 0.02)
    filled = beam.ranges[beam.intensity > 0]
    # From -10 to 30 degrees of bearing, 6 degrees up and down.
    far = 9 / np.cos(np.radians(30)) / np.cos(np.radians(6))
    assert filled[0] == pytest.approx(9, abs=0.03) and filled[-1] == pytest.approx(far, abs=0.08)
    bearing, h = np.radians([-10, 30]), np.radians(6)
    across = 0.5 + np.diff(np.sin(2 * bearing))[0] / (4 * np.diff(bearing)[0])
    assert beam.intensity.sum() == pytest.approx(across * (0.5 + np.sin(2 * h) / (4 * h)), rel=1e-3)


def test_motion_distorts_the_sweep_as_its_times_tell():
    model, data = scene(depth=90, more=WALL)
    v, turn = 0.8, np.radians(12)
    pose = lambda t: {"place": (v * t, 0, -30), "quat": (np.cos(turn * t / 2), 0, 0, np.sin(turn * t / 2))}  # noqa: E731
    sonar = ScanningSonar(model, "rov", sector=(-40, 40), step=0.5, **THIN)
    scan(model, data, sonar, 3.22, pose)
    sweep = sonar.sweep()
    np.testing.assert_allclose(sweep.times, 0.02 * np.arange(161), atol=1e-9)
    seen = np.array([first(sweep.ranges, row) for row in sweep.intensity])
    moved = (9 - v * sweep.times) / np.cos(sweep.angles + turn * sweep.times)
    np.testing.assert_allclose(seen[moved < 15], moved[moved < 15], atol=0.025 + 1e-9)
    # A vehicle that takes the sweep for one picture is off by metres.
    assert np.abs(seen - 9 / np.cos(sweep.angles))[moved < 15].max() > 2


def test_the_same_motion_gives_the_same_beams_and_time_going_back_resets():
    model, data = scene(depth=90, more=WALL)
    sonar = ScanningSonar(model, "rov", sector=(-30, 30), seed=3, background=0.01, reach=(1, 15))
    runs = [[beam for _, beam in scan(model, data, sonar, 0.3)] for _ in range(2)]
    assert len(runs[0]) == 15 and all(np.array_equal(a.intensity, b.intensity) for a, b in zip(*runs))
    assert [beam.angle for beam in runs[0]] == [beam.angle for beam in runs[1]]
    assert not np.array_equal(runs[0][0].intensity, runs[0][1].intensity)
    other = ScanningSonar(model, "rov", sector=(-30, 30), seed=4, background=0.01, reach=(1, 15))
    assert not np.array_equal(scan(model, data, other, 0.03)[0][1].intensity, runs[0][0].intensity)
    assert np.isfinite(sonar.sweep().times).sum() == 15
    sonar.reset()
    assert np.isnan(sonar.sweep().times).all() and not sonar.sweep().intensity.any()
    # A restored state: the ping under way is forgotten, a new one goes out.
    assert sonar.poll(move(model, data, time=9.0)) is None
    assert sonar.poll(move(model, data, time=5.0)) is None
    assert sonar.poll(move(model, data, time=5.02)).time == 5.0


def test_a_beam_is_a_column_of_the_imaging_sonar():
    model, data = scene(depth=9, more='<geom name="post" type="box" size="0.2 0.2 0.5" pos="5.2 3 -8.5"/>')
    shared = {"height": 60.0, "rays": 500, "bins": 200, "reach": (1, 15), "speckle": False}
    image = ImagingSonar(model, "nose", beams=3, width=60, **shared).read(move(model, data, place=(0, 0, -5)))
    sonar = ScanningSonar(model, "nose", sector=(-30, 30), step=30, width=1, across=1, **shared)
    beams = scan(model, data, sonar, 0.06, lambda t: {"place": (0, 0, -5)})
    np.testing.assert_allclose([beam.intensity for _, beam in beams], image.intensity.T, atol=1.01 / 500)
    assert image.intensity.sum() > 0.05


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"sector": (10, 10)}, "sector is 10 to 10 degrees; expected least < most, 360 at most apart"),
        ({"sector": (0, 400)}, "sector is 0 to 400 degrees; expected least < most, 360 at most apart"),
        ({"sector": (float("nan"), 20)}, "sector is nan to 20 degrees; expected least < most"),
        ({"sector": 5}, "sector is 5; expected 2 numbers"),
        ({"step": 0}, "step is 0 degrees; expected at least 0.01 degrees"),
        ({"width": 0}, "width is 0 degrees; expected above 0 and below 180"),
        ({"height": 180}, "height is 180 degrees; expected above 0 and below 180"),
        ({"across": 0}, "across is 0; expected a whole number, at least 1"),
        ({"rays": 1.5}, "rays is 1.5; expected a whole number, at least 1"),
        ({"across": 1000, "rays": 1000}, "1000000 rays a ping; expected at most 200000"),
        ({"bins": 0}, "bins is 0; expected a whole number, at least 1"),
        ({"reach": (5, 2)}, "reach is 5 to 2 m; expected 0 <= least < most"),
        ({"reach": ("x", "20")}, "reach is ('x', '20'); expected 2 numbers"),
        ({"width": "x"}, "width is x degrees; expected above 0 and below 180"),
        ({"reach": 5}, "reach is 5; expected 2 numbers"),
        ({"sound_speed": 0}, "sound_speed is 0 m/s; expected at least 1 m/s"),
        ({"pause": -1}, "pause is -1 s; expected at least 0 s"),
        ({"background": -1}, "background is -1; expected at least 0"),
        ({"seed": -1}, "seed is -1; expected a whole number, 0 to 2^63 - 1"),
    ],
)
def test_refusals(given, text):
    model, _ = scene()
    with pytest.raises(DataError, match=re.escape(text)):
        ScanningSonar(model, "rov", **given)


def test_reach_may_be_words():
    model, _ = scene()
    ranges = [ScanningSonar(model, "rov", reach=reach).sweep().ranges for reach in (("0.5", "20"), (0.5, 20))]
    np.testing.assert_array_equal(*ranges)


def test_refusals_of_places_and_data():
    model, _ = scene()
    with pytest.raises(DataError, match="no site or body is called `head`"):
        ScanningSonar(model, "head")
    with pytest.raises(DataError, match="the data are not of the model"):
        ScanningSonar(model, "rov").poll(mujoco.MjData(scene()[0]))
