"""`hydro_mujoco.sensors.AcousticModem` against closed forms: travel time, losses, collisions, clocks."""

import re

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hydro_mujoco import DataError, plugin
from hydro_mujoco.sensors import AcousticChannel, AcousticModem, OpticalChannel
from hydro_mujoco.sensors.sonar_equation import transmission_loss
from seabed import ON_THE_WORLD, move, scene, two_waters

pytestmark = [
    pytest.mark.skipif(not plugin.built_library().is_file(), reason="no plugin library: cargo build --release"),
    pytest.mark.filterwarnings("ignore"),
]
#: Ideal clocks; 100 bit/s and no preamble: a byte lasts 0.08 s.
PLAIN = {"clock_drift": 0, "timing_noise": 0, "bit_rate": 100, "preamble": 0}
THIRD = '<body name="third" mocap="true" pos="100 0 -20"><geom size="0.1" mass="1"/></body>'


def link(model, *, seed=0, near=None, far=None, **channel):
    """A channel and its modems on the vehicle and on the beacon."""
    water = AcousticChannel(model, seed=seed, **channel)
    return water, AcousticModem(water, "rov", **(near or PLAIN)), AcousticModem(water, "beacon", **(far or PLAIN))


def still(model, data, listeners, seconds, *, place=(0, 0, -20), beacon=(0, 300, -20), start=0.0, step=0.01):
    """Messages of each listener while all stand still."""
    data.mocap_pos[model.body("beacon").mocapid[0]] = beacon
    heard = [[] for _ in listeners]
    for tick in range(round(seconds / step) + 1):
        move(model, data, place=place, time=start + tick * step)
        for messages, listener in zip(heard, listeners):
            messages += listener.poll(data)
    return heard


@given(st.floats(-600, 600), st.floats(-600, 600), st.floats(-60, -3))
@settings(max_examples=10, deadline=None)
def test_travel_time_at_rest(x, y, z):
    model, data = scene(depth=100, half=2000.0)
    _, rov, beacon = link(model)
    still(model, data, [rov], 0, place=(0, 0, -2), beacon=(x, y, z))
    assert rov.send(data, b"hello", to="beacon") == pytest.approx(0.4)
    mine, heard = still(model, data, [rov, beacon], 1.2, place=(0, 0, -2), beacon=(x, y, z))
    (message,) = heard
    distance = float(np.linalg.norm([x, y, z + 2]))
    assert not mine and message.payload == b"hello" and message.sender == "rov" and message.sent == 0
    assert message.time == pytest.approx(distance / 1500 + 0.4)
    assert message.range == pytest.approx(distance, abs=1e-6)
    noise = 50 + 10 * np.log10(4000)
    assert message.snr == pytest.approx(185 - transmission_loss(distance, 25e3, 2) - noise)


def test_both_move_while_the_sound_is_under_way():
    model, data = scene(depth=100, half=2000.0)
    v, w, start, c = 3.0, -8.0, 700.0, 1500.0
    _, rov, beacon = link(model)
    heard = []
    for tick in range(200):
        time = 0.01 * tick
        data.mocap_pos[0] = (start + w * time, 0, -20)
        move(model, data, place=(v * time, 0, -20), time=time)
        if tick == 50:
            rov.send(data, b"1")
        heard += beacon.poll(data)
    # Sent at 0.5 s from 3 t; met by the beacon head on.
    (message,) = heard
    travel = (start + (w - v) * 0.5) / (c - w)
    assert message.time == pytest.approx(0.5 + travel + 0.08, abs=1e-9)
    assert message.range == pytest.approx(c * travel, abs=1e-6)


def test_packets_wait_for_each_other_and_reach_all_or_one():
    model, data = scene(depth=100, half=2000.0, more=THIRD)
    water, rov, beacon = link(model)
    third = AcousticModem(water, "third", **PLAIN)
    still(model, data, [rov], 0)
    ends = [rov.send(data, bytes([number] * 10), to=to) for number, to in enumerate((None, "beacon", "third"))]
    np.testing.assert_allclose(ends, [0.8, 1.6, 2.4])
    _, by_beacon, by_third = still(model, data, [rov, beacon, third], 3)
    assert [each.payload[0] for each in by_beacon] == [0, 1] and [each.payload[0] for each in by_third] == [0, 2]
    np.testing.assert_allclose([each.time for each in by_beacon], np.array([0.8, 1.6]) + 0.2)
    np.testing.assert_allclose([each.range for each in by_beacon], 300)


def test_half_duplex():
    model, data = scene(depth=100, half=2000.0)

    def both(first, second, wait):
        """Numbers of messages when the vehicle sends at 0 s and the beacon `wait` seconds later."""
        _, rov, beacon = link(model)
        still(model, data, [rov], 0)
        rov.send(data, bytes(first))
        early = still(model, data, [rov, beacon], wait)
        beacon.send(data, bytes(second))
        late = still(model, data, [rov, beacon], 3, start=wait)
        return tuple(len(one) + len(two) for one, two in zip(early, late))

    # 300 m: 0.2 s of travel. The beacon hears from 0.2 s on, the vehicle 0.2 s after the beacon has begun.
    assert both(10, 10, 0.0) == (0, 0)
    assert both(10, 10, 1.1) == (1, 1)
    assert both(10, 1, 0.5) == (0, 0)
    # Short packets pass each other under way.
    assert both(1, 1, 0.0) == (1, 1)
    # The beacon has sent before it hears; the vehicle still sends when that arrives.
    assert both(10, 1, 0.05) == (0, 1)


def test_packets_that_overlap_collide():
    model, data = scene(depth=100, half=2000.0, more=THIRD)

    def heard(distance, wait, **given):
        water, rov, beacon = link(model, far=PLAIN | {"width": 0})
        third = AcousticModem(water, "third", **(PLAIN | given))
        data.mocap_pos[model.body("third").mocapid[0]] = (0, 300 + distance, -20)
        still(model, data, [rov], 0)
        rov.send(data, b"rov", to="beacon")
        early = still(model, data, [beacon], wait)[0]
        third.send(data, b"3rd", to="beacon")
        late = still(model, data, [beacon], 3, start=wait)[0]
        return [(each.payload, round(each.snr, 1)) for each in early + late]

    # Both 300 m away: 0 dB of each other. A packet lasts 0.24 s.
    assert heard(300, 0.0) == [] and heard(300, 0.23) == []
    assert [payload for payload, _ in heard(300, 0.25)] == [b"rov", b"3rd"]
    # Ten times nearer, 21.7 dB stronger, it drowns the other; the other is noise to it.
    ((payload, snr),) = heard(30, 0.18)
    difference = transmission_loss(300, 25e3, 2) - transmission_loss(30, 25e3, 2)
    assert payload == b"3rd" and snr == pytest.approx(difference, abs=0.1)
    # Less loud by so much, none of both.
    assert heard(30, 0.18, source_level=185 - difference + 5) == []


def test_the_share_that_arrives_follows_the_curve():
    model, data = scene(depth=100, half=5000.0)
    noise = 50 + 10 * np.log10(4000)
    for distance in (2600.0, 2900.0, 3100.0, 3400.0):
        _, rov, beacon = link(model, near=PLAIN | {"bit_rate": 1e4}, far=PLAIN | {"width": 2.0}, seed=1)
        count, number = 0, 800
        for tick in range(number + 45):
            if tick < number:
                rov.send(data, b"x")
            count += len(still(model, data, [beacon], 0, beacon=(0, distance, -20), start=0.1 * tick)[0])
        # The sonar equation by hand; Thorp's 6.1207 dB/km at 25 kHz.
        ratio = 185 - 20 * np.log10(distance) - 6.1207e-3 * distance - noise
        share = 1 / (1 + np.exp(-(ratio - 10) / 2))
        assert 0.1 < share < 0.95
        assert count / number == pytest.approx(share, abs=3.3 * np.sqrt(share * (1 - share) / number))
        data.time = 0


def test_nothing_leaves_the_water_or_passes_what_stands_between():
    wall = '<geom name="wall" type="box" size="50 0.5 15" pos="0 100 -20"/>'
    model, data = scene(depth=100, half=2000.0, more=wall)

    def arrives(place, beacon, near=None, far=None, **channel):
        _, rov, other = link(model, near=PLAIN | (near or {}), far=PLAIN | (far or {}), **channel)
        still(model, data, [rov], 0, place=place, beacon=beacon)
        rov.send(data, b"x")
        return bool(still(model, data, [other], 0.6, place=place, beacon=beacon)[0])

    assert arrives((0, 0, -20), (0, -300, -20))
    assert not arrives((0, 0, -20), (0, 300, -20))
    assert arrives((0, 0, -40), (0, 300, -40))  # below the wall
    assert not arrives((0, 0, 0.2), (0, -300, -20)) and not arrives((0, 0, -20), (0, -300, 0.2))
    assert not arrives((0, 0, -20), (0, -300, -20), reach=290)
    # The beacon is in the plane of both modems' x and y: at 90 degrees from their z.
    assert arrives((0, 0, -20), (0, -300, -20), near={"cone": (89, 91)})
    assert not arrives((0, 0, -20), (0, -300, -20), near={"cone": (0, 80)})
    assert not arrives((0, 0, -20), (0, -300, -20), far={"cone": (100, 180)})
    assert not arrives((0, 0, -20), (0, -300, -20), near={"source_level": 90})


def test_ranges_have_the_errors_of_both_clocks():
    model, data = scene(depth=100, half=2000.0)

    def ranges(time, **given):
        found = []
        for seed in range(150):
            clock = PLAIN | {"bit_rate": 1e5} | given
            _, rov, beacon = link(model, seed=seed, near=clock, far=clock)
            still(model, data, [rov], 0, start=time)
            rov.send(data, b"x")
            ((message,),) = still(model, data, [beacon], 0.25, start=time, step=0.25)
            found.append(message.range - 300)
        return np.array(found)

    assert np.std(ranges(0.0, timing_noise=1e-3)) == pytest.approx(1.5, rel=0.18)
    assert np.std(ranges(0.0, clock_offset=1e-3)) == pytest.approx(1.5 * np.sqrt(2), rel=0.18)
    # Two clocks of 1e-6 that were set an hour ago.
    assert np.std(ranges(3600.0, clock_drift=1e-6)) == pytest.approx(1500 * 3600e-6 * np.sqrt(2), rel=0.18)


def test_the_same_motion_is_heard_the_same_and_time_going_back_forgets():
    model, data = scene(depth=100, half=2000.0)
    heard = []
    noisy = {"timing_noise": 1e-3, "width": 3.0, "noise_level": 75.0}
    water, rov, beacon = link(model, seed=5, near=noisy, far=noisy)
    for _ in range(2):
        data.time = 0.0
        messages = []
        for tick in range(60):
            messages += still(model, data, [beacon], 0, beacon=(0, 900, -20), start=0.1 * tick)[0]
            rov.send(data, b"x")
        heard.append(messages)
    assert 5 < len(heard[0]) < 55 and heard[0] == heard[1]
    rov.send(data, b"x")
    water.reset()
    assert not still(model, data, [beacon], 2, start=7)[0]


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda c: AcousticChannel(c.model, frequency=0), "frequency is 0 Hz; expected at least 1 Hz"),
        (lambda c: AcousticChannel(c.model, bandwidth=-1), "bandwidth is -1 Hz; expected at least 1 Hz"),
        (lambda c: AcousticChannel(c.model, spreading=float("nan")), "spreading is nan; expected at least 0"),
        (lambda c: AcousticChannel(c.model, reach=0), "reach is 0 m; expected at least 0.001 m"),
        (lambda c: AcousticChannel(c.model, sound_speed=0), "sound_speed is 0 m/s; expected at least 1 m/s"),
        (lambda c: AcousticChannel(c.model, seed=-1), "seed is -1; expected a whole number, 0 to 2^63 - 1"),
        (lambda c: AcousticModem(c, "beakon"), "no site or body is called `beakon`"),
        (lambda c: AcousticModem(c, "rov"), "a modem at `rov` is on the channel already"),
        (lambda c: AcousticModem(c, "nose", bit_rate=0), "bit_rate is 0 bit/s; expected at least 0.001 bit/s"),
        (lambda c: AcousticModem(c, "nose", preamble=-1), "preamble is -1 s; expected at least 0 s"),
        (lambda c: AcousticModem(c, "nose", longest=0), "longest is 0; expected a whole number, at least 1"),
        (lambda c: AcousticModem(c, "nose", width=-1), "width is -1 dB; expected at least 0 dB"),
        (lambda c: AcousticModem(c, "nose", threshold=np.inf), "threshold is inf dB; expected a finite number"),
        (lambda c: AcousticModem(c, "nose", cone=(90, 10)), "cone is 90 to 10 degrees; expected 0 <= least < most"),
        (lambda c: AcousticModem(c, "nose", cone=(0, 190)), "cone is 0 to 190 degrees; expected 180 at most"),
        (lambda c: AcousticModem(c, "nose", source_level="x"), "source_level is x dB; expected a finite number"),
        (lambda c: AcousticModem(c, "nose", bit_rate="x"), "bit_rate is x bit/s; expected at least 0.001 bit/s"),
        (
            lambda c: AcousticModem(OpticalChannel(c.model), "nose"),
            "the modem at `nose` does not fit the channel, which is optical",
        ),
        (lambda c: AcousticModem(c, "nose", clock_drift=-1), "clock_drift is -1; expected at least 0"),
    ],
)
def test_refusals(make, text):
    model, _ = scene()
    water, _, _ = link(model)
    with pytest.raises(DataError, match=re.escape(text)):
        make(water)


def test_refusals_of_messages_and_data():
    model, data = scene()
    _, rov, _ = link(model)
    for payload, to, text in (
        ("text", None, "payload is 'text'; expected bytes, 1024 at most"),
        (bytes(2000), None, "payload is 2000 bytes; expected bytes, 1024 at most"),
        (b"x", "rov", "no other modem at `rov` is on the channel; there are: `beacon`"),
    ):
        with pytest.raises(DataError, match=re.escape(text)):
            rov.send(data, payload, to=to)
    with pytest.raises(DataError, match="the data are not of the model"):
        rov.poll(mujoco.MjData(scene()[0]))


@pytest.mark.parametrize("place", ["floor", "wall"])
def test_a_modem_on_the_floor_or_on_a_wall_hears_and_is_heard(place):
    model, data = scene(more=ON_THE_WORLD)
    water = AcousticChannel(model)
    rov, there = AcousticModem(water, "rov", **PLAIN), AcousticModem(water, place, **PLAIN)
    still(model, data, [rov], 0, place=(0, 0, -2))
    rov.send(data, b"1", to=place)
    _, heard = still(model, data, [rov, there], 0.2, place=(0, 0, -2))
    there.send(data, b"2", to="rov")
    answered, _ = still(model, data, [rov, there], 0.2, place=(0, 0, -2), start=0.2)
    assert [each.payload for each in heard + answered] == [b"1", b"2"]


@pytest.mark.parametrize(("height", "hears"), [(4.0, True), (6.0, False)])
def test_a_modem_is_in_its_own_water(height, hears):
    model, data = two_waters(height)
    water = AcousticChannel(model)
    low, high, mast = (AcousticModem(water, name, **PLAIN) for name in ("low", "high", "mast"))
    high.send(data, b"1")
    heard = []
    for tick in range(30):
        data.time = 0.01 * tick
        # The mast has no water, and is in that of the first.
        heard += low.poll(data) + mast.poll(data)
    assert [each.payload for each in heard] == ([b"1", b"1"] if hears else [])
