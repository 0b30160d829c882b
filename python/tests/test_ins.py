"""`hydro_mujoco.sensors.Ins` against closed forms: drift without aids; states and refusals."""

import re

import mujoco
import numpy as np
import pytest

from hydro_mujoco import DataError, plugin
from hydro_mujoco.sensors import Dvl, Imu, Ins, Pressure
from hydro_mujoco.sensors.imu import Motion, increments, matrix
from hydro_mujoco.sensors.noise import Noise
from navigation import circle, error
from seabed import move, scene

pytestmark = [
    pytest.mark.skipif(not plugin.built_library().is_file(), reason="no plugin library: cargo build --release"),
    pytest.mark.filterwarnings("ignore"),
]
IDEAL = dict.fromkeys(
    (
        "gyro_bias",
        "gyro_instability",
        "gyro_walk",
        "accelerometer_bias",
        "accelerometer_instability",
        "accelerometer_walk",
    ),
    0.0,
)
ALIGNED = {"position": 0, "velocity": 0, "tilt": 0, "heading": 0}
G, HOUR = 9.81, 3600.0


def only(**given):
    """An inertial unit with these errors alone."""
    return Imu(**(IDEAL | given))


def drift(ins, model, data, seconds, step=0.5):
    """Error of an `Ins` (true less estimated) at rest: position, velocity and rotation about world axes, last reading."""
    for tick in range(round(seconds / step) + 1):
        reading = ins.read(move(model, data, place=(0, 0, -5), time=tick * step))
    return error(reading, np.array([0, 0, -5.0]), np.zeros(3), data.body("rov").xmat), reading


def test_without_errors_it_follows_every_motion():
    model, data = scene(depth=40, mounted="0.5 0.5 -0.5 0.5")
    ins = Ins(model, "nose", imu=only(), **ALIGNED)
    for tick in range(601):
        circle(model, data, 0.1 * tick)
        reading = ins.read(data)
        site = data.site("nose")
        np.testing.assert_allclose(matrix(reading.attitude), site.xmat.reshape(3, 3), atol=1e-10)
        # The trapezoid's error of position over a step is that of a chord of a circle.
        np.testing.assert_allclose(reading.position, site.xpos, atol=2e-3)
    velocity = np.zeros(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_SITE, site.id, velocity, 0)
    np.testing.assert_allclose(reading.velocity, velocity[3:], atol=1e-9)
    np.testing.assert_allclose(matrix(reading.attitude) @ reading.rate, [0, 0, 0.08], atol=1e-9)
    # Towards the centre, in the middle of the last step; the nose is 0.25 m ahead and 0.05 m inside.
    inwards = -np.array([np.cos(0.08 * 59.95), np.sin(0.08 * 59.95)])
    assert (matrix(reading.attitude) @ reading.acceleration)[:2] @ inwards == pytest.approx(19.95 * 0.08**2, rel=1e-3)


def test_in_a_simulation_without_errors():
    model, data = scene(depth=40)
    ins = Ins(model, "rov", imu=only(), **ALIGNED)
    start = data.joint("free").qvel
    start[:] = 0.5, 0.2, 0, 0.3, -0.2, 0.5
    start = start.copy()
    for _ in range(300):
        last = data.joint("free").qvel[:3].copy()
        mujoco.mj_step(model, data)
        reading = ins.read(data)
    # Semi-implicit Euler takes each step with the velocity at its end, the navigation with the mean of both.
    lag = 0.5 * 0.01 * (last - start[:3])
    np.testing.assert_allclose(reading.position, data.body("rov").xpos - lag, atol=1e-6)
    assert np.abs(lag).max() > 0.005
    np.testing.assert_allclose(matrix(reading.attitude).ravel(), data.body("rov").xmat, atol=1e-9)


def test_an_accelerometer_bias_drifts_by_half_b_t_squared():
    model, data = scene()
    for seed in range(3):
        ins = Ins(model, "rov", imu=only(accelerometer_bias=0.01), seed=seed, **ALIGNED)
        found, reading = drift(ins, model, data, 100)
        bias = 0.01 * Noise(seed, "ins rov").constant(6)[:3]
        np.testing.assert_allclose(found[:3], -0.5 * bias * 100**2, rtol=1e-6)
        np.testing.assert_allclose(found[3:6], -bias * 100, rtol=1e-6)
        np.testing.assert_allclose(reading.deviation[0], 0.5 * 0.01 * 100**2, rtol=1e-6)


def test_tilt_drifts_by_half_g_psi_t_squared():
    model, data = scene()
    for seed in range(3):
        ins = Ins(model, "rov", imu=only(), seed=seed, **(ALIGNED | {"tilt": 0.05}))
        found, reading = drift(ins, model, data, 60)
        x, y = found[6:8]
        # The estimated axes are turned by -psi: gravity is taken off upright, what holds the vehicle against it is not.
        np.testing.assert_allclose(found[:2], 0.5 * G * 60**2 * np.array([y, -x]), rtol=1e-3)
        np.testing.assert_allclose(reading.deviation[0, :2], 0.5 * G * np.radians(0.05) * 60**2, rtol=1e-5)
        assert abs(found[2]) < 0.01 * np.abs(found[:2]).max()


def test_a_gyro_bias_turns_the_heading_and_the_tilt_it_makes_drifts_by_t_cubed():
    model, data = scene()
    ins = Ins(model, "rov", imu=only(gyro_bias=10), seed=4, **ALIGNED)
    found, reading = drift(ins, model, data, 120)
    x, y, z = np.radians(10) / HOUR * Noise(4, "ins rov").constant(6)[3:]
    np.testing.assert_allclose(found[6:], [-x * 120, -y * 120, -z * 120], rtol=1e-4)
    np.testing.assert_allclose(found[:2], G * 120**3 / 6 * np.array([-y, x]), rtol=1e-3)
    np.testing.assert_allclose(reading.deviation[2], np.radians(10) / HOUR * 120, rtol=1e-4)
    np.testing.assert_allclose(reading.deviation[0, :2], G * np.radians(10) / HOUR * 120**3 / 6, rtol=1e-3)


def test_random_walks_and_biases_with_memory():
    model, data = scene()
    noises = [
        (only(gyro_walk=0.3), 6, np.radians(0.3) * np.sqrt(60 / HOUR)),
        (only(accelerometer_walk=0.5), 3, 0.5 * np.sqrt(60 / HOUR)),
        # Over T an integrated Gauss-Markov error has the variance 2 s^2 T^2 (t/T - 1 + exp(-t/T)).
        (only(accelerometer_instability=0.01, memory=20), 3, 0.01 * 20 * np.sqrt(2 * (3 - 1 + np.exp(-3)))),
    ]
    for imu, first, expected in noises:
        runs = [
            drift(Ins(model, "rov", imu=imu, seed=seed, **ALIGNED), model, data, 60, step=1.0) for seed in range(60)
        ]
        found = np.array([each[first : first + 3] for each, _ in runs])
        assert np.sqrt(np.mean(found**2)) == pytest.approx(expected, rel=0.2)
        np.testing.assert_allclose(runs[0][1].deviation[first // 3], expected, rtol=0.03)


def test_increments_of_a_fall_are_weightless():
    level = np.array([1.0, 0, 0, 0])
    gravity = np.array([0, 0, -G])
    rest = Motion(0.0, np.zeros(3), np.zeros(3), level)
    fall = increments(rest, Motion(0.5, np.zeros(3), 0.5 * gravity, level), gravity)
    np.testing.assert_allclose(fall.velocity, 0, atol=1e-12)
    stand = increments(rest, Motion(0.5, np.zeros(3), np.zeros(3), level), gravity)
    np.testing.assert_allclose(stand.velocity, [0, 0, 0.5 * G])


def test_the_same_seed_reads_the_same_and_a_state_is_restored():
    model, data = scene(depth=30)
    ins = Ins(model, "rov", dvl=Dvl(model, "rov"), pressure=Pressure(model, "rov"), seed=3)
    assert ins.state() is None
    read = []
    for tick in range(60):
        circle(model, data, 0.1 * tick)
        if tick == 30:
            kept = ins.state()
        read.append(ins.read(data))
    np.testing.assert_array_equal(ins.read(data).position, read[-1].position)  # once more at the same time
    ins.restore(kept)
    other = Ins(model, "rov", dvl=Dvl(model, "rov"), pressure=Pressure(model, "rov"), seed=3)
    for tick in range(60):
        circle(model, data, 0.1 * tick)
        if tick >= 30:
            np.testing.assert_array_equal(ins.read(data).position, read[tick].position)
        np.testing.assert_array_equal(other.read(data).covariance, read[tick].covariance)
    # Time that goes back, and `reset`, align anew.
    circle(model, data, 0.0)
    np.testing.assert_array_equal(ins.read(data).position, read[0].position)
    ins.reset()
    assert ins.state() is None
    assert not np.array_equal(Ins(model, "rov", seed=4).read(data).position, read[0].position)


def test_a_body_that_rolls_in_place_is_not_accelerated():
    model, data = scene()
    ins = Ins(model, "rov", imu=only(), **ALIGNED)
    for tick in range(50):
        angle = 0.02 * tick
        place = {"place": (0, 0, -5), "quat": (np.cos(angle / 2), np.sin(angle / 2), 0, 0)}
        reading = ins.read(move(model, data, time=angle, rate=(1, 0, 0), **place))
        np.testing.assert_allclose(reading.acceleration, 0, atol=1e-9)
    np.testing.assert_allclose(reading.rate, [1, 0, 0], atol=1e-9)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda m: Ins(m, "rob"), "no site or body is called `rob`"),
        (lambda m: Ins(m, "rov", seed=-1), "seed is -1; expected a whole number, 0 to 2^63 - 1"),
        (lambda m: Ins(m, "rov", period=-1), "period is -1 s; expected at least 0 s"),
        (lambda m: Ins(m, "rov", heading=np.nan), "heading is nan degrees; expected at least 0 degrees"),
        (lambda m: Ins(m, "rov", imu=Imu(gyro_walk=-1)), "gyro_walk is -1; expected at least 0"),
        (lambda m: Ins(m, "rov", imu="x"), "imu is 'x'; expected an Imu"),
        (lambda m: Ins(m, "rov", dvl="x"), "an aid is 'x'; expected a Dvl"),
        (lambda m: Ins(m, "rov", period="x"), "period is x s; expected at least 0 s"),
        (lambda m: Ins(m, "rov", imu=Imu(memory=0)), "memory is 0; expected at least 0.001"),
        (lambda m: Ins(m, "rov", dvl=Dvl(m, "fin")), "the aid at `fin` moves against `rov`; expected the same body"),
        (lambda m: Ins(m, "rov", dvl=Dvl(scene()[0], "rov")), "the aid at `rov` is of another model"),
        (lambda m: Ins(m, "rov").fix((0, 0, 0), 1), "a fix came before the first reading; expected `read` once a step"),
    ],
)
def test_refusals(make, text):
    model, _ = scene()
    with pytest.raises(DataError, match=re.escape(text)):
        make(model)


def test_refusals_of_fixes_and_data():
    model, data = scene()
    ins = Ins(model, "rov")
    ins.read(data)
    with pytest.raises(DataError, match="deviation is 0 m; expected at least 1e-09 m"):
        ins.fix((0, 0, 0), 0)
    with pytest.raises(DataError, match=re.escape("position is (1, 2); expected 3 numbers")):
        ins.fix((1, 2), 1)
    with pytest.raises(DataError, match=re.escape("position is 5.0; expected 3 numbers")):
        ins.fix(5.0, 1.0)
    with pytest.raises(DataError, match=re.escape("position is [0.0, nan, 0.0] m; expected finite numbers")):
        ins.fix((0, np.nan, 0), 1)
    with pytest.raises(DataError, match="the data are not of the model"):
        ins.read(scene()[1])
