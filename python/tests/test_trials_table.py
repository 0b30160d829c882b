"""A mapping proposed for a table whose columns' names say units, frames and the time."""

import tomllib

import mujoco
import numpy as np
import pandas
import pytest

from hydro_mujoco import trials
from hydro_mujoco.trials.proposal.names import time_of, unit_of
from hydro_mujoco.trials.proposal.shapes import shapes

MJCF = """<mujoco><option timestep="0.01"/><worldbody><body name="hull"><freejoint/><geom size="0.1" mass="1"/>
<site name="s"/><body name="arm"><joint name="turn" axis="0 0 1"/><geom size="0.05" mass="0.1"/></body></body></worldbody>
<actuator><motor name="tail" joint="turn"/></actuator>
<sensor><gyro name="spin" site="s"/><framequat name="heading" objtype="site" objname="s"/>
<framepos name="place" objtype="site" objname="s"/><velocimeter name="flow" site="s"/><jointpos name="angle" joint="turn"/>
</sensor></mujoco>"""


def table(n=600):
    """A hull that yaws, in NED and FRD, degrees and milliseconds."""
    times = 0.01 * np.arange(n)
    found = {"time_ms": 1000 * times + 5000, "roll_deg": 0 * times, "pitch_deg": 0 * times}
    found |= {"yaw [deg]": np.degrees(0.5 * times), "north": np.sin(times), "east": 0.1 * times, "down": 2 + 0 * times}
    found |= {f"gyro_{axis}_dps": np.degrees(rate + 0 * times) for axis, rate in zip("xyz", (0, 0, 0.5))}
    found |= {f"dvl_{axis}": speed + 0 * times for axis, speed in zip("xyz", (0.3, 0.2, 0.1))}
    return pandas.DataFrame(found | {"angle_deg": 30 * np.sin(times), "tail_us": 1500 + 400 * np.sin(times)})


def test_units_times_and_frames_by_the_names_of_columns(tmp_path):
    table().to_csv(tmp_path / "a.csv", index=False)
    spec = mujoco.MjSpec.from_string(MJCF)
    proposal = trials.propose(tmp_path / "a.csv", spec)
    found = tomllib.loads(proposal.toml)
    assert proposal.open == [] and found["time"] == {"clock": "time_ms", "unit": "ms"}
    assert found["sensors"] == {
        "spin": {"fields": ["gyro_x_dps", "gyro_y_dps", "gyro_z_dps"], "unit": "deg/s"},
        "heading": {"fields": ["roll_deg", "pitch_deg", "yaw [deg]"], "unit": "deg"},
        "place": {"fields": ["north", "east", "down"], "frame": "NED"},
        "flow": {"fields": ["dvl_x", "dvl_y", "dvl_z"]},
        "angle": {"fields": ["angle_deg"], "unit": "deg"},
    }
    assert found["actuators"]["tail"] == {"fields": ["tail_us"], "unit": "us"}
    # What no name says is asked; as the comment has it, the numbers are those of the hull.
    assert '# frame = "NED/FRD"  # if it is not ENU/FLU' in proposal.toml
    (tmp_path / "map.toml").write_text(proposal.toml.replace("# frame = ", "frame = "))
    (trial,) = trials.from_csv(tmp_path / "a.csv", model=spec, mapping=tmp_path / "map.toml")
    np.testing.assert_allclose(trial.sensor("spin"), np.tile([0, 0, -0.5], (len(trial.readings), 1)), atol=1e-9)
    np.testing.assert_allclose(trial.sensor("flow"), np.tile([0.3, -0.2, -0.1], (len(trial.readings), 1)), atol=1e-9)
    np.testing.assert_allclose(trial.sensor("place")[:, 2], -2, atol=1e-9)
    # North is y, and a heading north looks along y.
    half = np.sqrt(0.5)
    np.testing.assert_allclose(trial.sensor("heading")[0], [half, 0, 0, half], atol=1e-3)
    np.testing.assert_allclose(trial.controls[:, 0], np.sin(trial.control_times), atol=0.02)


@pytest.mark.parametrize(
    ("columns", "expected"),
    [
        (["a", "time"], ("time", "s")),
        (["t_us", "x"], ("t_us", "us")),
        (["TimeUS"], ("TimeUS", "us")),
        (["timestamp [ns]"], ("timestamp [ns]", "ns")),
        (["time", "time_ms"], ("time", "s")),
        (["uptime", "runtime_ms"], None),
    ],
)
def test_the_column_of_the_time(columns, expected):
    assert time_of(columns) == expected


@pytest.mark.parametrize(
    ("column", "expected"),
    [
        ("roll_deg", ("roll", "deg")),
        ("wx (deg/s)", ("wx", "deg/s")),
        ("depth_m", ("depth", "m")),
        ("ax [m/s^2]", ("ax", "m/s^2")),
        ("rpm", ("rpm", None)),
        ("arm", ("arm", None)),
        ("_g", ("_g", None)),
    ],
)
def test_units_in_names(column, expected):
    assert unit_of(column) == expected


def test_n_after_an_underscore_is_north():
    assert (unit_of("v_n"), unit_of("pos_n_m"), unit_of("push [N]")) == (
        ("v_n", None),
        ("pos_n", "m"),
        ("push", "N"),
    )
    [group] = [group for group in shapes(["pos_n_m", "pos_e_m", "pos_d_m"]) if len(group.fields) > 1]
    assert (group.frame, group.fields) == ("NED", ("pos_n_m", "pos_e_m", "pos_d_m"))


def test_a_column_is_in_one_vector():
    found = [
        group for group in shapes(["x", "y", "z", "roll", "pitch", "yaw", "vn", "ve", "vd"]) if len(group.fields) > 1
    ]
    assert [(group.quantity, group.frame, group.fields) for group in found] == [
        ("attitude", None, ("roll", "pitch", "yaw")),
        ("", None, ("x", "y", "z")),
        ("velocity", "NED", ("vn", "ve", "vd")),
    ]


def test_a_table_without_a_time_asks_for_it(tmp_path):
    table().drop(columns="time_ms").to_csv(tmp_path / "a.csv", index=False)
    assert (
        '# clock = "..."  # which column is the time?'
        in trials.propose(tmp_path / "a.csv", mujoco.MjSpec.from_string(MJCF)).toml
    )
