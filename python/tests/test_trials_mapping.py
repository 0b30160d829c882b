"""Mapping files: what is refused and how, units, frames."""

import copy
import math
import tomllib

import mujoco
import numpy as np
import pandas
import pymap3d
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hydro_mujoco import trials
from hydro_mujoco.errors import DataError
from hydro_mujoco.trials import frames, geodetic, units
from hydro_mujoco.trials.mapping import parse
from hydro_mujoco.trials.model import load

MJCF = """<mujoco><worldbody>
  <body name="hull"><freejoint/><geom size="0.1" mass="1"/><site name="imu"/>
    <body name="arm"><joint name="elbow"/><geom size="0.1" mass="1" pos="0.3 0 0"/></body></body>
</worldbody>
<actuator><motor name="left" site="imu" ctrlrange="-1 1"/><motor name="right" site="imu"/></actuator>
<sensor><gyro name="imu_gyro" site="imu"/><framequat name="attitude" objtype="body" objname="hull"/>
  <framepos name="position" objtype="body" objname="hull"/><jointpos name="elbow_angle" joint="elbow"/></sensor></mujoco>"""
WHOLE = tomllib.loads("""
schema = "hydro-mapping/1"
[sensors.imu_gyro]
topic = "/imu"
fields = ["x", "y", "z"]
unit = "deg/s"
frame = "FRD"
[sensors.attitude]
topic = "/att"
fields = ["x", "y", "z", "w"]
order = "xyzw"
[sensors.position]
topic = "/depth"
fields = ["", "", "p"]
unit = "mbar"
[sensors.elbow_angle]
topic = "/arm"
field = "a"
unit = "deg"
[actuators.left]
topic = "/pwm"
fields = ["c[0]"]
unit = "us"
[actuators.right]
constant = 0
""")


@pytest.fixture(scope="module")
def model():
    return load(mujoco.MjSpec.from_string(MJCF))


def changed(path, value):
    """The mapping with the value at a path changed; None takes it out."""
    content = copy.deepcopy(WHOLE)
    at = content
    for key in path[:-1]:
        at = at.setdefault(key, {})
    if value is None:
        at.pop(path[-1])
    else:
        at[path[-1]] = value
    return content


def test_a_mapping_is_read(model, tmp_path):
    found = parse(WHOLE, model)
    assert found.sensors["imu_gyro"].units == ("deg/s",) * 3 and found.sensors["imu_gyro"].frame == "FRD"
    assert found.actuators["left"].pulse == (1100, 1500, 1900) and found.actuators["right"].constant == 0
    assert found.time.clock == "log" and found.trials.gap == 1.0 and found.frames == ("ENU", "FLU")
    assert found.sensors["elbow_angle"].quantity == units.ANGLE
    everything = copy.deepcopy(WHOLE) | {
        "time": {"clock": "header.stamp", "align": True, "period": 0.02, "control_period": 0.01},
        "trials": {
            "gap": 2,
            "windows": [[1, 2], [3, 4]],
            "shortest": 1,
            "length": 9,
            "mode": {"topic": "m", "field": "f", "values": [1, "A"]},
        },
        "water": {"density": 1025, "surface_pressure": 1e5, "surface": 0.1, "gravity": 9.8},
        "model": {"world": "NWU", "body": "FRD"},
        "joints": {"elbow": {"topic": "/arm", "field": "a"}},
    }
    found = parse(everything, model)
    assert found.trials.windows == ((1, 2), (3, 4)) and found.trials.mode == ("m", "f", (1, "A"))
    assert found.water.density == 1025 and found.time.align and found.joints["elbow"].quantity == units.ANGLE


REFUSED = {
    "schema": (["schema"], "hydro-mapping/2", r"schema is 'hydro-mapping/2'; expected `schema = \"hydro-mapping/1\"`"),
    "part": (["sensor"], {}, "key `sensor` is not known.*is `sensors` meant"),
    "sensor": (
        ["sensors", "imu_gyr"],
        {"topic": "a", "fields": ["x"]},
        "no sensor `imu_gyr` .is `imu_gyro` meant.*`attitude`",
    ),
    "actuator": (["actuators", "top"], {"constant": 0}, "no actuator `top`; it has `left`, `right`"),
    "joint": (["joints", "knee"], {"topic": "a", "field": "x"}, "no joint `knee`; it has `elbow`"),
    "no table": (["sensors", "imu_gyro"], 3, "3 found; expected a table with the keys `topic`"),
    "missing actuator": (["actuators", "right"], None, "`right` are not mapped; one that stands still: `constant = 0`"),
    "no sensors": (["sensors"], {}, "no sensor is mapped; the model's are `imu_gyro` .gyro."),
    "key": (["sensors", "imu_gyro", "unti"], "x", r"\[sensors.imu_gyro\]: key `unti` is not known .is `unit` meant"),
    "unit": (["sensors", "imu_gyro", "unit"], "dps", "unit `dps` is not known.*there are: rad, mrad"),
    "quantity": (
        ["sensors", "imu_gyro", "unit"],
        "deg",
        "unit `deg` is of angle, but this is angular velocity; expected one of rad/s, mrad/s, deg/s, rpm",
    ),
    "units": (["sensors", "imu_gyro", "unit"], ["rad/s"], "expected a text, or a list of 3"),
    "quaternion's unit": (["sensors", "attitude", "unit"], "deg", "a quaternion has none"),
    "frame": (
        ["sensors", "imu_gyro", "frame"],
        "NED",
        "frame `NED`, but this reads in the frame of a body; expected FLU or FRD",
    ),
    "world frame": (
        ["sensors", "position", "frame"],
        "FRD",
        "frame `FRD`, but this reads in the world; expected ENU or NED or NWU",
    ),
    "attitude's frame": (["sensors", "attitude", "frame"], "FRD", "frame `FRD`, but this is an attitude; expected NED"),
    "scalar's frame": (["sensors", "elbow_angle", "frame"], "FRD", "a single number has none"),
    "pressure's frame": (["sensors", "position", "frame"], "NED", "a pressure becomes a height, which is up"),
    "count": (["sensors", "imu_gyro", "fields"], ["x", "y"], "2 fields given; expected 3"),
    "attitude's count": (
        ["sensors", "attitude", "fields"],
        ["x", "y"],
        "2 fields given; expected 4 of a quaternion, or roll, pitch and yaw",
    ),
    "attitude's part": (
        ["sensors", "attitude", "fields"],
        ["x", "y", "z", ""],
        r"fields are \['x', 'y', 'z', ''\], number 4 empty; an attitude needs all 4",
    ),
    "empty": (["sensors", "imu_gyro", "fields"], ["", "", ""], r"fields are \['', '', ''\]; expected one at least"),
    "fields": (["sensors", "imu_gyro", "fields"], 3, "fields are 3; expected a list of 3 paths"),
    "field and fields": (["sensors", "imu_gyro", "field"], "x", "field and fields both given"),
    "order": (["sensors", "attitude", "order"], "zyxw", "order `zyxw`; expected wxyz or xyzw"),
    "order of none": (["sensors", "imu_gyro", "order"], "xyzw", "order given, and this is no quaternion"),
    "direction": (
        ["sensors", "attitude", "direction"],
        "up",
        "direction `up`; expected world_from_body or body_from_world",
    ),
    "scale": (["sensors", "imu_gyro", "scale"], [1, 2], "scale has 2 numbers; expected one, or 3"),
    "scale's type": (["sensors", "imu_gyro", "scale"], "big", "scale is 'big'; expected a number or a list"),
    "offset": (["sensors", "imu_gyro", "offset"], [math.nan], "expected a number"),
    "table": (["actuators", "left"], {"topic": "a", "field": "b", "table": [[2, 0], [1, 1]]}, "raw values rising"),
    "table and unit": (
        ["actuators", "left", "table"],
        [[1, 0], [2, 1]],
        "table and pulse both given|table and unit both given",
    ),
    "pulse": (["actuators", "left", "pulse"], [1500, 1100, 1900], "expected the widths at -1, 0 and 1"),
    "constant sensor": (["sensors", "imu_gyro"], {"constant": 1}, "constant is for actuators alone"),
    "constant": (["actuators", "right", "constant"], "off", "constant is 'off'; expected a number"),
    "topic": (["sensors", "imu_gyro", "topic"], 5, "topic is 5; expected a text"),
    "delay": (["sensors", "imu_gyro", "delay"], "x", "delay is 'x'; expected a number"),
    "filter": (["sensors", "imu_gyro", "filter"], 1, "filter is 1; expected true or false"),
    "time unit": (["time", "unit"], "min", "unit `min` is no unit of time; expected one of s, ms, us, ns"),
    "period": (["time", "period"], 0, "period is 0; expected a number above 0"),
    "time key": (["time", "rate"], 50, "key `rate` is not known"),
    "time table": (["time"], 5, "time is 5; expected a table"),
    "window": (["trials", "windows"], [[4, 3]], r"window \[4.0, 3.0\]; expected pairs of seconds"),
    "windows": (["trials", "windows"], 4, "window"),
    "mode": (["trials", "mode"], "AUTO", "expected {topic, field, values}"),
    "mode's values": (["trials", "mode"], {"topic": "a", "field": "b", "values": []}, "expected a list of the modes"),
    "water": (["water", "density"], -1, "density is -1; expected a number above 0"),
    "model": (["model", "world"], "NEU", "frame `NEU`; expected ENU or NED or NWU"),
    "state": (["state", "hul"], {}, "no free body, hinge or slide is called `hul` .is `hull` meant"),
    "state's parts": (
        ["state", "hull"],
        {"position": {"topic": "a", "fields": ["x", "y", "z"]}},
        "`attitude`, `linear_velocity`, `angular_velocity` missing",
    ),
    "state's table": (["state", "hull"], 5, "5 found; expected the tables `position`"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_wrong_is_said_once(model, case):
    path, value, expected = REFUSED[case]
    with pytest.raises(DataError, match=expected) as refusal:
        parse(changed(path, value), model)
    assert str(refusal.value).count("\n") < 3 and str(refusal.value).startswith("mapping")


def test_a_state_is_whole(model):
    parts = {"position": {"topic": "o", "field": "a"}, "velocity": {"topic": "o", "field": "b"}}
    with pytest.raises(DataError, match="`hull` missing; the start needs every free body and joint"):
        parse(changed(["state"], {"elbow": parts}), model)


def test_files_that_are_no_mapping(model, tmp_path):
    with pytest.raises(DataError, match="no such file; --dry-run proposes one"):
        parse(tmp_path / "a.toml", model)
    (tmp_path / "b.toml").write_text("a = [")
    with pytest.raises(DataError, match="no TOML"):
        parse(tmp_path / "b.toml", model)
    (tmp_path / "c.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(DataError, match=r"mapping .*c.toml: is not UTF-8 text \(byte 0\)"):
        parse(tmp_path / "c.toml", model)
    (tmp_path / "d.toml").write_text("a = " + "[" * 100_000)
    with pytest.raises(DataError, match="no TOML"):
        parse(tmp_path / "d.toml", model)


@given(
    st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=6),
        lambda s: (
            st.lists(s, max_size=3)
            | st.dictionaries(
                st.sampled_from(["topic", "fields", "unit", "frame", "imu_gyro", "left", "position"]), s, max_size=3
            )
        ),
        max_leaves=8,
    ),
    st.sampled_from(["time", "trials", "water", "model", "sensors", "actuators", "joints", "state"]),
)
@settings(max_examples=150, deadline=None)
def test_any_content_is_read_or_refused(part, key):
    nominal = _MODEL[0] if _MODEL else _MODEL.append(load(mujoco.MjSpec.from_string(MJCF))) or _MODEL[0]
    try:
        parse({**WHOLE, key: part}, nominal)
    except DataError as refusal:
        assert str(refusal).count("\n") < 3


_MODEL = []

KNOWN = {
    "deg": math.pi / 180, "cdeg": math.pi / 18000, "rpm": math.tau / 60, "kn": 0.514444, "km/h": 1 / 3.6, "ft": 0.3048,
    "g": 9.80665, "psi": 6894.76, "dbar": 1e4, "mbar": 100, "lbf": 4.44822, "mG": 1e-7, "permille": 1e-3, "turn": math.tau,
}  # fmt: skip


def test_units_by_known_values():
    for unit, value in KNOWN.items():
        assert units.UNITS[unit][1] == pytest.approx(value, rel=2e-6), unit


ROTATIONS = st.lists(st.floats(-3.1, 3.1), min_size=3, max_size=3)


def test_frames_by_what_their_axes_are():
    north, east, down = np.eye(3)
    np.testing.assert_array_equal(frames.rotation("NED", "ENU") @ north, [0, 1, 0])
    np.testing.assert_array_equal(frames.rotation("NED", "ENU") @ east, [1, 0, 0])
    np.testing.assert_array_equal(frames.rotation("NED", "ENU") @ down, [0, 0, -1])
    np.testing.assert_array_equal(frames.rotation("NED", "NWU") @ east, [0, -1, 0])
    np.testing.assert_array_equal(frames.rotation("NWU", "ENU") @ [0, 1, 0], [-1, 0, 0])
    np.testing.assert_array_equal(frames.rotation("FRD", "FLU") @ [1, 2, 3], [1, -2, -3])


@given(
    ROTATIONS,
    st.sampled_from(["NED/FRD", "NED/FLU", "ENU/FLU", "ENU/FRD", "NWU/FLU", "NED"]),
    st.sampled_from([("ENU", "FLU"), ("NWU", "FRD")]),
)
@settings(max_examples=80, deadline=None)
def test_an_attitude_turns_vectors_as_before(angles, frame, into):
    quaternion = frames.from_euler(np.array([angles]))
    turned = frames.matrices(frames.attitude(quaternion, frame, into))[0]
    world, body = frames.pair(frame)
    vector = np.array([0.3, -1.0, 2.0])
    by_hand = frames.rotation(world, into[0]) @ (frames.matrices(quaternion)[0] @ vector)
    np.testing.assert_allclose(turned @ (frames.rotation(body, into[1]) @ vector), by_hand, atol=1e-12)


@given(ROTATIONS)
@settings(max_examples=40, deadline=None)
def test_roll_pitch_and_yaw_are_the_fields(angles):
    """Rz(yaw) Ry(pitch) Rx(roll), by MuJoCo."""
    roll, pitch, yaw = angles
    found = np.array([1.0, 0, 0, 0])
    for axis, angle in (([0, 0, 1.0], yaw), ([0, 1.0, 0], pitch), ([1.0, 0, 0], roll)):
        turn, product = np.zeros(4), np.zeros(4)
        mujoco.mju_axisAngle2Quat(turn, np.array(axis), angle)
        mujoco.mju_mulQuat(product, found, turn)
        found = product
    np.testing.assert_allclose(frames.from_euler(np.array([angles]))[0], found, atol=1e-12)


def test_a_compass_course_is_an_attitude():
    """Heading east in NED is the x axis of ENU."""
    found = frames.attitude(frames.from_euler(np.array([[0, 0, math.pi / 2]])), "NED", ("ENU", "FLU"))
    np.testing.assert_allclose(found[0], [1, 0, 0, 0], atol=1e-12)


def test_quaternions_go_on_without_a_jump():
    turned = frames.from_euler(np.column_stack([np.zeros(400), np.zeros(400), np.linspace(0, 20, 400)]))
    flipped = turned * np.where(np.arange(400) % 7 < 3, -1, 1)[:, None]
    flipped[5] = np.nan
    found = frames.continuous(flipped)
    assert (np.abs(np.diff(found[6:], axis=0)) < 0.1).all() and found[0, 0] >= 0 and np.isnan(found[5]).all()


TWO = """<mujoco><worldbody>
  <body name="hull" pos="0 0 -1" euler="0 0 40"><freejoint/><geom size="0.1" mass="1"/>
    <site name="dvl" euler="0 20 30"/><site name="imu" euler="70 0 10"/>
    <body name="arm"><joint name="elbow"/><geom size="0.1" mass="1" pos="0.3 0 0"/><site name="hand"/></body></body>
</worldbody>
<sensor><velocimeter name="dvl" site="dvl"/><framequat name="attitude" objtype="site" objname="imu"/>
  <framelinvel name="velocity" objtype="xbody" objname="hull"/><framepos name="position" objtype="xbody" objname="hull"/>
  <framequat name="of_hand" objtype="site" objname="hand"/></sensor></mujoco>"""
ATTITUDE = {"fields": ["qw", "qx", "qy", "qz"], "frame": "NED/FRD"}


def spun(seconds=6.0):
    """A body that tumbles: a table of its attitude (of the site `imu`) and of its velocity in the world and in the body."""
    spec = mujoco.MjSpec.from_string(TWO)
    spec.option.gravity = [0, 0, 0]
    compiled = spec.compile()
    data = mujoco.MjData(compiled)
    data.qvel[:6] = 0.4, -0.3, 0.2, 0.5, -0.4, 0.7
    rows = []
    for _ in range(round(seconds / compiled.opt.timestep)):
        time = data.time
        mujoco.mj_step(compiled, data)
        rows.append([time, *data.sensordata])
    rows = np.array(rows)[::5]
    hull = np.zeros((len(rows), 3))
    world_from_hull = frames.matrices(rows[:, 4:8]) @ load(spec).sensors["attitude"].axes.T
    hull = np.einsum("nji,nj->ni", world_from_hull, rows[:, 8:11])
    logged = frames.attitude(rows[:, 4:8], "ENU/FLU", ("NED", "FRD"))
    east, north, up = rows[:, 8:11].T
    columns = {
        "time": rows[:, 0],
        "vn": north,
        "ve": east,
        "vd": -up,
        "u": hull[:, 0],
        "v": -hull[:, 1],
        "w": -hull[:, 2],
    }
    columns |= {name: logged[:, k] for k, name in enumerate(ATTITUDE["fields"])}
    return spec, rows, pandas.DataFrame(columns)


def spun_mapping(**sensors):
    return {"schema": "hydro-mapping/1", "time": {"period": 0.01}, "sensors": {"attitude": ATTITUDE} | sensors}


@pytest.mark.parametrize("attitude", [None, "attitude", "of the hull"])
def test_a_velocity_in_the_world_is_turned_into_the_site_and_one_in_the_body_into_the_world(attitude):
    """Both against MuJoCo's own velocimeter and framelinvel."""
    spec, rows, table = spun()
    given = {} if attitude is None else {"attitude": attitude}
    if attitude == "of the hull":
        turned = frames.matrices(rows[:, 4:8]) @ load(spec).sensors["attitude"].axes.T
        for k, q in enumerate(np.array([frames.from_matrix(m) for m in turned]).T):
            table[f"h{k}"] = q
        given = {"attitude": {"fields": ["h0", "h1", "h2", "h3"], "frame": "ENU/FLU"}}
    found = trials.from_dataframe(
        table,
        model=spec,
        mapping=spun_mapping(
            dvl={"fields": ["vn", "ve", "vd"], "frame": "NED"} | given,
            velocity={"fields": ["u", "v", "w"], "frame": "FRD"} | given,
        ),
    )
    (trial,) = found
    np.testing.assert_allclose(trial.sensor("dvl"), rows[: len(trial.readings), 1:4], atol=1e-9)
    np.testing.assert_allclose(trial.sensor("velocity"), rows[: len(trial.readings), 8:11], atol=1e-9)
    assert any("`dvl`: the velocity in NED is turned into the body by `table`" in note for note in found.report.notes)


@pytest.mark.parametrize(
    ("sensors", "expected"),
    [
        ({"dvl": {"fields": ["vn", "ve", ""], "frame": "NED"}}, "has to be turned by an attitude, which needs all fields"),
        (
            {"dvl": {"fields": ["vn", "ve", "vd"], "frame": "NED", "attitude": "atitude"}},
            "attitude `atitude` is no mapped framequat .is `attitude` meant",
        ),
        (
            {"dvl": {"fields": ["vn", "ve", "vd"], "frame": "NED", "attitude": "of_hand"}, "of_hand": ATTITUDE},
            "attitude `of_hand` is of another body than `dvl`",
        ),
        ({"dvl": {"fields": ["u", "v", "w"], "frame": "FRD", "attitude": "attitude"}}, "attitude given, which turns a velocity"),
        ({"position": {"fields": ["u", "v", "w"], "attitude": "attitude"}}, "attitude given, which turns velocities alone"),
        ({"dvl": {"fields": ["u", "v", "w"], "frame": "WGS84"}}, "frame `WGS84`, but this reads in the frame of a body"),
        ({"position": {"fields": ["u", "", "w"], "frame": "WGS84"}}, "needs latitude and longitude"),
        ({"position": {"fields": ["u", "v", "w"], "frame": "WGS84", "unit": "deg"}}, "latitude, longitude and height have three"),
    ],
)  # fmt: skip
def test_turns_that_are_refused(sensors, expected):
    spec, _, table = spun(0.5)
    with pytest.raises(DataError, match=expected):
        trials.from_dataframe(table, model=spec, mapping=spun_mapping(**sensors))


def test_without_an_attitude_a_velocity_of_the_other_kind_is_refused():
    spec, _, table = spun(0.5)
    mapping = spun_mapping(dvl={"fields": ["vn", "ve", "vd"], "frame": "NED"})
    del mapping["sensors"]["attitude"]
    with pytest.raises(
        DataError, match=r'`dvl` \(velocimeter\) reads in the body; name the attitude .*"SENSOR"`, one of none'
    ):
        trials.from_dataframe(table, model=spec, mapping=mapping)
    mapping["model"] = {"origin": [91, 0, 0]}
    mapping["sensors"] = {"attitude": ATTITUDE}
    with pytest.raises(DataError, match=r"origin is \[91.0, 0.0, 0.0\]; expected latitude, longitude"):
        trials.from_dataframe(table, model=spec, mapping=mapping)


@pytest.mark.parametrize("world", ["ENU", "NWU", "NED"])
def test_latitudes_become_metres_and_back(world):
    """Against the sensor `Gps`, which goes the other way, and the meridian's own radius of curvature."""
    times = np.arange(0, 6, 0.1)
    east, north, up = 400 * np.sin(times), 300 * np.cos(times), -3 + np.sin(2 * times)
    origin = 54.3, 10.15, 12.0
    latitude, longitude, height = pymap3d.enu2geodetic(east, north, up, *origin)
    table = pandas.DataFrame(
        {"time": times, "lat": np.round(latitude * 1e7), "lon": np.round(longitude * 1e7), "alt": height * 1e3}
    )
    table.loc[7:9, ["lat", "lon"]] = 0
    source = {"fields": ["lat", "lon", "alt"], "frame": "WGS84", "unit": ["degE7", "degE7", "mm"]}
    mapping = {
        "schema": "hydro-mapping/1",
        "time": {"period": 0.1},
        "sensors": {"position": source},
        "model": {"origin": list(origin), "world": world},
    }
    spec = mujoco.MjSpec.from_string(TWO)
    found = trials.from_dataframe(table, model=spec, mapping=mapping)
    (trial,) = found
    known = np.isfinite(trial.sensor("position")).all(1)
    wanted = np.column_stack([east, north, up]) @ frames.rotation("ENU", world).T
    rows = np.round(trial.start / 0.1 + np.arange(len(trial.readings))).astype(int)
    # A unit of 1e-7 degrees is 11 mm.
    assert known.sum() >= len(times) - 5 and not known[(rows >= 7) & (rows <= 9)].any()
    np.testing.assert_allclose(trial.sensor("position")[known], wanted[rows][known], atol=0.012)
    assert any("3 samples without a fix" in note for note in found.report.notes)
    del mapping["model"]["origin"]
    again = trials.from_dataframe(table, model=spec, mapping=mapping)
    assert any("degrees, height 9.01 m: the first fix" in note for note in again.report.notes)
    np.testing.assert_allclose(again.trials[0].sensor("position")[0], 0, atol=0.02)
    mapping["sensors"]["position"] = {"fields": ["lat", "lon", ""], "frame": "WGS84", "unit": ["degE7", "degE7", "m"]}
    mapping["model"] = {"origin": [54.3, 10.15, 0]}
    level = trials.from_dataframe(table, model=spec, mapping=mapping).trials[0].sensor("position")
    assert np.isnan(level[:, 2]).all() and np.nanmax(np.abs(level[known, :2] - np.c_[east, north][rows][known])) < 0.05
    with pytest.raises(DataError, match="none of the 60 samples in `table` has a fix"):
        del mapping["model"]
        trials.from_dataframe(table.assign(lat=0, lon=0), model=spec, mapping=mapping)


def test_a_small_step_north_is_the_meridian_s_radius_times_the_angle():
    """M = a (1 - e^2) / (1 - e^2 sin^2 phi)^1.5 (Torge, Geodesy, 4th ed., eq. 4.12)."""
    a, e2, phi = 6378137.0, 6.69437999014e-3, math.radians(54.3)
    step = math.radians(1e-4)
    found = geodetic.local(np.array([[phi + step, math.radians(10), 0.0]]), (54.3, 10.0, 0.0))
    assert found[0, 1] == pytest.approx(step * a * (1 - e2) / (1 - e2 * math.sin(phi) ** 2) ** 1.5, rel=1e-5)
    assert abs(found[0, 0]) < 1e-6 and found[0, 2] == pytest.approx(-(found[0, 1] ** 2) / 2 / a, rel=0.01)
