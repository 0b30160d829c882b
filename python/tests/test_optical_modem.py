"""`hydro_mujoco.sensors.OpticalModem` against closed forms: power by distance and angle, noise, bit errors, turns."""

import re
from math import erfc

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hydro_mujoco import DataError, plugin
from hydro_mujoco.sensors import AcousticChannel, AcousticModem, OpticalChannel, OpticalModem, WaterLight
from seabed import ON_THE_WORLD, move, scene, two_waters

pytestmark = [
    pytest.mark.skipif(not plugin.built_library().is_file(), reason="no plugin library: cargo build --release"),
    pytest.mark.filterwarnings("ignore"),
]
#: A water of one attenuation for all colours, 0.2 1/m; daylight fades by 0.1 1/m.
EVEN = WaterLight((0.2, 0.2, 0.2), (0.1, 0.1, 0.1))
#: A kilobit a second, one byte of header: a packet of n bytes lasts (n + 1) / 125 s.
SLOW = {"bit_rate": 1000, "header": 1}
THIRD = '<body name="third" mocap="true" pos="100 0 -20"><geom size="0.1" mass="1"/></body>'


def link(model, *, near=None, far=None, seed=0, **channel):
    """A channel and its modems on the vehicle and on the beacon."""
    water = OpticalChannel(model, seed=seed, **({"light": EVEN} | channel))
    return water, OpticalModem(water, "rov", **(near or {})), OpticalModem(water, "beacon", **(far or {}))


def face(model, data, distance, *, off=0.0, tilt=0.0, depth=60.0, time=0.0, name="beacon"):
    """Put a modem above the vehicle, `off` its z and looking `tilt` past it [degrees]; the vehicle is at a depth."""
    angle, turn = np.radians(off), np.pi + np.radians(off + tilt)
    number = model.body(name).mocapid[0]
    data.mocap_pos[number] = np.array([0, 0, -depth]) + distance * np.array([np.sin(angle), 0, np.cos(angle)])
    data.mocap_quat[number] = (np.cos(turn / 2), 0, np.sin(turn / 2), 0)
    return move(model, data, place=(0, 0, -depth), time=time)


def run(data, listeners, seconds, *, start=0.0, step=0.01):
    """Messages of each listener while all stand still."""
    heard = [[] for _ in listeners]
    for tick in range(round(seconds / step) + 1):
        data.time = start + tick * step
        for messages, listener in zip(heard, listeners):
            messages += listener.poll(data)
    return heard


@given(st.floats(0.5, 35), st.floats(0, 29), st.floats(0, 59), st.floats(0, 0.5))
@settings(max_examples=25, deadline=None)
def test_power_by_distance_angle_and_water(distance, off, tilt, attenuation):
    model, data = scene(depth=100)
    water = WaterLight((attenuation,) * 3)
    _, rov, beacon = link(model, light=water, near={"power": 2.0, "beam": 30}, far={"area": 2e-3, "view": 60})
    face(model, data, distance, off=off, tilt=tilt)
    cap = 2 * np.pi * distance**2 * (1 - np.sqrt(0.75))
    expected = 2.0 * np.exp(-attenuation * distance) * 2e-3 * np.cos(np.radians(tilt)) / cap
    assert beacon.power(data, "rov") == pytest.approx(expected, rel=1e-7)
    # The way back: the receiver is the vehicle, the sender's beam is that of the beacon.
    back = 1.0 * np.exp(-attenuation * distance) * 1e-3 * np.cos(np.radians(off)) / cap if tilt <= 30 else 0
    assert rov.power(data, "beacon") == pytest.approx(back, rel=1e-7)


def test_the_receiver_has_all_of_the_light_at_most():
    model, data = scene(depth=100)
    _, _, beacon = link(model, near={"power": 2.0})
    assert beacon.power(face(model, data, 1e-4), "rov") == pytest.approx(2.0, rel=1e-4)
    # All round: 4 pi d^2.
    _, _, beacon = link(model, near={"beam": 180})
    expected = 1e-3 * np.exp(-1) / (4 * np.pi * 25)
    assert beacon.power(face(model, data, 5, off=120, tilt=10), "rov") == pytest.approx(
        expected * np.cos(np.radians(10)), rel=1e-7
    )


def test_borders_of_beam_and_view():
    model, data = scene(depth=100)
    _, _, beacon = link(model, near={"beam": 12}, far={"view": 70})

    def sees(off, tilt):
        return beacon.power(face(model, data, 10, off=off, tilt=tilt), "rov") > 0

    assert sees(11.99, 0) and not sees(12.01, 0) and sees(-11.99, 0) and not sees(-12.01, 0)
    assert sees(5, 69.99) and not sees(5, 70.01) and sees(5, -69.99) and not sees(5, -70.01)
    assert not sees(180, 0)


def test_power_in_air_and_none_through_the_surface():
    model, data = scene(depth=100)
    haze = {"light": WaterLight((5.0,) * 3), "air": 4e-3}
    _, rov, beacon = link(model, near={"power": 2.0, "beam": 30}, far={"area": 2e-3}, **haze)
    cap = 2 * np.pi * 50**2 * (1 - np.sqrt(0.75))
    face(model, data, 50, depth=-0.1)
    assert beacon.power(data, "rov") == pytest.approx(2.0 * np.exp(-0.2) * 2e-3 / cap, rel=1e-7)
    # As bright as day: without daylight the same packet is heard more clearly.
    rov.send(data, b"x")
    ((by_day,),) = run(data, [beacon], 0.02)
    _, rov, beacon = link(model, near={"power": 2.0, "beam": 30}, far={"area": 2e-3, "daylight_noise": 0}, **haze)
    rov.send(face(model, data, 50, depth=-0.1), b"x")
    ((by_night,),) = run(data, [beacon], 0.02)
    assert by_night.snr - by_day.snr == pytest.approx(10 * np.log10(1 + (3e-11 / 1e-13) ** 2), rel=1e-6)
    for distance, depth in ((5, 2), (0.2, 0.1)):
        face(model, data, distance, depth=depth)
        assert beacon.power(data, "rov") == 0 and rov.power(data, "beacon") == 0


def test_nothing_leaves_the_water_or_passes_what_stands_between():
    wall = '<geom name="wall" type="box" size="3 50 0.5" pos="0 0 -55"/>'
    model, data = scene(depth=100, more=wall)

    def arrives(distance, depth=60.0, off=0.0, **channel):
        _, rov, beacon = link(model, **({"light": WaterLight((0,) * 3, (0,) * 3)} | channel))
        face(model, data, distance, depth=depth, off=off)
        rov.send(data, b"x")
        heard = bool(run(data, [beacon], 0.02)[0])
        assert heard == (beacon.power(data, "rov") > 0)
        data.time = 0
        return heard

    assert arrives(4) and not arrives(10) and arrives(10, off=-28, depth=63)
    assert arrives(9, depth=10) and not arrives(11, depth=10) and arrives(5, depth=-0.1)
    assert arrives(30, depth=40, reach=31) and not arrives(30, depth=40, reach=29)


def test_bits_take_their_time_and_light_takes_none():
    model, data = scene(depth=100, more=THIRD)
    water, rov, beacon = link(model, near=SLOW, far=SLOW)
    third = OpticalModem(water, "third")
    face(model, data, 8, off=5)
    face(model, data, 5, off=-5, name="third")
    assert rov.duration(9) == pytest.approx(0.08) and third.duration(1234) == pytest.approx(1250 * 8e-7)
    ends = [rov.send(data, bytes([number] * 9), to=to) for number, to in enumerate((None, "beacon", "third"))]
    np.testing.assert_allclose(ends, [0.08, 0.16, 0.24])
    mine, by_beacon, by_third = run(data, [rov, beacon, third], 0.3)
    assert [each.payload[0] for each in by_beacon] == [0, 1] and [each.payload[0] for each in by_third] == [0, 2]
    np.testing.assert_allclose([each.time for each in by_beacon], [0.08, 0.16])
    np.testing.assert_allclose([each.sent for each in by_third], [0, 0.16])
    assert not mine and np.isnan(by_third[0].range) and by_third[0].sender == "rov"
    # Many packets within a step.
    fast, far = OpticalChannel(model, light=EVEN), []
    sender, receiver = OpticalModem(fast, "rov"), OpticalModem(fast, "beacon")
    for number in range(50):
        sender.send(data, bytes([number]) * 109)
    (far,) = run(data, [receiver], 0.01, start=0.3)
    assert [each.payload[0] for each in far] == list(range(50))
    np.testing.assert_allclose([each.time for each in far], 0.3 + 1e-4 * np.arange(1, 51))


def test_snr_by_distance_daylight_depth_and_bit_rate():
    model, data = scene(depth=100)

    def ratio(distance, depth, rate=1e6, far=None, **channel):
        _, rov, beacon = link(model, near={"bit_rate": rate}, far=far, **channel)
        face(model, data, distance, depth=depth)
        rov.send(data, b"x")
        ((message,),) = run(data, [beacon], 0.02)
        data.time = 0
        return message.snr

    def expected(distance, depth, rate=1e6, attenuation=0.2, daylight=0.1):
        power = 1e-3 * np.exp(-attenuation * distance) / (2 * np.pi * distance**2 * (1 - np.sqrt(0.75)))
        variance = (1e-13**2 + 3e-11**2 * np.exp(-daylight * (depth - distance))) * rate / 2
        return 20 * np.log10(power / np.sqrt(variance))

    for distance, depth, rate in ((2, 3, 1e6), (8, 20, 1e6), (8, 95, 1e6), (15, 95, 1e4)):
        assert ratio(distance, depth, rate) == pytest.approx(expected(distance, depth, rate), abs=1e-6)
    # Each colour by itself; in the dark, without a daylight, at any depth.
    light = WaterLight((0.5, 0.15, 0.1), (0.3, 0.1, 0.05))
    for column, colour in enumerate(("red", "green", "blue")):
        shown = expected(5, 12, attenuation=light.attenuation[column], daylight=light.daylight[column])
        assert ratio(5, 12, light=light, colour=colour) == pytest.approx(shown, abs=1e-6)
    assert ratio(5, 12, far={"daylight_noise": 0}) == pytest.approx(expected(5, 1e9), abs=1e-6)


def test_the_share_that_arrives_is_that_without_an_error_of_a_bit():
    model, data = scene(depth=100)
    number = 600
    # Q of 3.2, 3 and 2.7 in 18 and 68 bytes: noise by hand, 5 m above 60 m of depth.
    power = 1e-3 * np.exp(-1) / (2 * np.pi * 25 * (1 - np.sqrt(0.75)))
    for quality, size in ((3.2, 2), (3.0, 2), (2.7, 2), (3.2, 52)):
        noise = power / quality / np.sqrt(1e6 / 2)
        given = {"bit_rate": 1e6, "noise": noise, "daylight_noise": 0}
        _, rov, beacon = link(model, near=given, far=given, seed=2)
        face(model, data, 5)
        for _ in range(number):
            rov.send(data, bytes(size))
        (heard,) = run(data, [beacon], 0.4, step=0.05)
        right = (1 - 0.5 * erfc(quality / np.sqrt(2))) ** (8 * (16 + size))
        assert 0.3 < right < 0.95
        assert len(heard) / number == pytest.approx(right, abs=3.3 * np.sqrt(right * (1 - right) / number))
        data.time = 0


def test_half_duplex_and_packets_that_overlap():
    model, data = scene(depth=100, more=THIRD)

    def heard(wait, distance=5, payload=9):
        """Messages of vehicle and beacon when the third sends to the vehicle `wait` after the beacon."""
        water, rov, beacon = link(model, near=SLOW, far=SLOW)
        third = OpticalModem(water, "third", **SLOW)
        face(model, data, 5, off=5)
        face(model, data, distance, off=-5, name="third")
        beacon.send(data, b"b" * payload)
        early = run(data, [rov], wait)[0]
        third.send(data, b"3" * payload)
        late = run(data, [rov], 0.3, start=wait)[0]
        data.time = 0
        return [each.payload[:1] for each in early + late]

    # A packet lasts 0.08 s.
    assert heard(0.0) == [] and heard(0.07) == [] and heard(0.09) == [b"b", b"3"]
    # Twice as near, the light is 6.6 times that of the other.
    assert heard(0.02, distance=2.5) == [b"3"]
    _, rov, beacon = link(model, near=SLOW, far=SLOW)
    face(model, data, 5)
    face(model, data, 90, off=-80, name="third")
    for one, two in ((0.0, 0), (0.09, 1)):
        rov.send(data, bytes(9))
        early = run(data, [rov, beacon], one)
        beacon.send(data, bytes(9))
        late = run(data, [rov, beacon], 0.3, start=one)
        assert [len(a) + len(b) for a, b in zip(early, late)] == [two, two]
        data.time = 0


def test_the_same_motion_is_heard_the_same_and_reset_forgets():
    model, data = scene(depth=100)
    power = 1e-3 * np.exp(-1) / (2 * np.pi * 25 * (1 - np.sqrt(0.75)))
    weak = {"bit_rate": 1e4, "noise": power / 2.9 / np.sqrt(5e3), "daylight_noise": 0}
    water, rov, beacon = link(model, near=weak, far=weak, seed=5)
    heard = []
    for _ in range(2):
        face(model, data, 5)
        messages = []
        for tick in range(100):
            rov.send(data, bytes([tick]))
            messages += run(data, [beacon], 0.02, start=0.05 * tick)[0]
        heard.append([(each.time, each.payload) for each in messages])
    assert 20 < len(heard[0]) < 95 and heard[0] == heard[1]
    rov.send(data, b"x")
    water.reset()
    assert not run(data, [beacon], 1, start=data.time)[0]


def test_light_and_sound_do_not_meet():
    model, data = scene(depth=100)
    _, rov, beacon = link(model, near=SLOW, far=SLOW)
    sea = AcousticChannel(model)
    loud, far = AcousticModem(sea, "rov"), AcousticModem(sea, "beacon")
    face(model, data, 5)
    loud.send(data, b"sound")
    rov.send(data, b"light")
    light, sound = run(data, [beacon, far], 0.3)
    assert [each.payload for each in light] == [b"light"] and [each.payload for each in sound] == [b"sound"]


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda c: OpticalChannel(c.model, colour="violet"), "colour is 'violet'; expected one of red, green, blue"),
        (lambda c: OpticalChannel(c.model, reach=0), "reach is 0 m; expected at least 0.001 m"),
        (lambda c: OpticalChannel(c.model, air=-1), "air is -1 1/m; expected at least 0 1/m"),
        (lambda c: OpticalChannel(c.model, seed=-1), "seed is -1; expected a whole number, 0 to 2^63 - 1"),
        (lambda c: OpticalModem(c, "beakon"), "no site or body is called `beakon`"),
        (lambda c: OpticalModem(c, "rov"), "a modem at `rov` is on the channel already"),
        (lambda c: OpticalModem(c, "nose", bit_rate=0), "bit_rate is 0 bit/s; expected at least 0.001 bit/s"),
        (lambda c: OpticalModem(c, "nose", header=0), "header is 0; expected a whole number, at least 1"),
        (lambda c: OpticalModem(c, "nose", longest=0), "longest is 0; expected a whole number, at least 1"),
        (lambda c: OpticalModem(c, "nose", power=-1), "power is -1 W; expected at least 0 W"),
        (lambda c: OpticalModem(c, "nose", beam=0), "beam is 0 degrees; expected above 0 and at most 180"),
        (lambda c: OpticalModem(c, "nose", beam="x"), "beam is x degrees; expected above 0 and at most 180"),
        (lambda c: OpticalModem(c, "nose", power=None), "power is None W; expected at least 0 W"),
        (lambda c: OpticalChannel(c.model, light="blue"), "light is 'blue'; expected a WaterLight"),
        (
            lambda c: OpticalModem(AcousticChannel(c.model), "nose"),
            "the modem at `nose` does not fit the channel, which is acoustic",
        ),
        (lambda c: OpticalModem(c, "nose", view=91), "view is 91 degrees; expected above 0 and at most 90"),
        (lambda c: OpticalModem(c, "nose", area=0), "area is 0 m^2; expected at least 1e-09 m^2"),
        (lambda c: OpticalModem(c, "nose", noise=0), "noise is 0 W/sqrt(Hz); expected at least 1e-18 W/sqrt(Hz)"),
        (lambda c: OpticalModem(c, "nose", daylight_noise=np.nan), "daylight_noise is nan W/sqrt(Hz); expected at"),
    ],
)
def test_refusals(make, text):
    model, _ = scene()
    water, _, _ = link(model)
    with pytest.raises(DataError, match=re.escape(text)):
        make(water)


def test_refusals_of_messages_names_and_data():
    model, data = scene()
    _, rov, beacon = link(model, near={"longest": 4})
    with pytest.raises(DataError, match="payload is 5 bytes; expected bytes, 4 at most"):
        rov.send(data, b"hello")
    with pytest.raises(DataError, match="no other modem at `nose` is on the channel; there are: `beacon`"):
        rov.send(data, b"x", to="nose")
    with pytest.raises(DataError, match="no other modem at `beacon` is on the channel; there are: `rov`"):
        beacon.power(data, "beacon")
    other = mujoco.MjData(scene()[0])
    for call in (rov.poll, lambda d: beacon.power(d, "rov"), lambda d: rov.send(d, b"x")):
        with pytest.raises(DataError, match="the data are not of the model"):
            call(other)


@pytest.mark.parametrize("place", ["floor", "wall"])
def test_a_modem_on_the_floor_or_on_a_wall_is_seen_and_sees(place):
    model, data = scene(more=ON_THE_WORLD)
    water = OpticalChannel(model, light=EVEN)
    wide = {"beam": 180, "view": 90}
    rov, there = OpticalModem(water, "nose", **wide), OpticalModem(water, place, **wide)
    way = data.site(place).xpos - (0, 0, -2)
    # The vehicle's z looks along the way.
    quat = np.array([np.linalg.norm(way) + way[2], -way[1], way[0], 0])
    move(model, data, place=(0, 0, -2), quat=quat)
    assert there.power(data, "nose") > 0 and rov.power(data, place) > 0


@pytest.mark.parametrize(("height", "sees"), [(4.0, True), (6.0, False)])
def test_a_modem_is_in_its_own_water(height, sees):
    model, data = two_waters(height, ' euler="180 0 0"')
    water = OpticalChannel(model, light=EVEN)
    low, high = OpticalModem(water, "low"), OpticalModem(water, "high")
    assert (low.power(data, "high") > 0) == sees and (high.power(data, "low") > 0) == sees
