"""`gap.run` and `gap.effects` by the program itself."""

import json
import subprocess
from functools import cache

import mujoco
import numpy as np
import pytest

import hydro_mujoco_entry
from hydro_mujoco import DataError, gap, plugin
from hydro_mujoco.gap import trials as files
from hydro_mujoco.gap.case import case

try:
    hydro_mujoco_entry.find_program()
except FileNotFoundError as error:
    pytest.skip(f"{error}", allow_module_level=True)

#: A cart on a rail, pushed by a motor; its truth is damped.
CART = """<mujoco><option timestep="0.01"/><worldbody>
  <body name="cart"><joint name="rail" type="slide" axis="1 0 0" damping="{damping}"/><geom size="0.1" mass="2"/></body>
</worldbody>
<actuator><motor name="motor" joint="rail" ctrlrange="-10 10"/></actuator>
<sensor><jointpos name="x" joint="rail" noise="0.001"/><jointvel name="v" joint="rail" noise="0.002"/></sensor></mujoco>"""
DAMPING = 3.0


@cache
def trial(seed, damping=DAMPING, seconds=4.0, added=0.0):
    """A cart's run, rows as `mj_step` gives them; `added`: mass [kg] beyond the cart's own."""
    model = mujoco.MjModel.from_xml_string(CART.format(damping=damping))
    data = mujoco.MjData(model)
    model.body_mass[1] += added
    mujoco.mj_setConst(model, data)
    draw = np.random.default_rng(seed)
    n = int(seconds / model.opt.timestep)
    times = np.arange(n + 1) * model.opt.timestep
    force = sum(a * np.sin(w * times + p) for a, w, p in zip((6, 3, 2), draw.uniform(1, 8, 3), draw.uniform(0, 6, 3)))
    state = np.zeros(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    readings = np.empty((n, model.nsensordata))
    for i in range(n):
        data.ctrl[0] = force[i]
        mujoco.mj_step(model, data)
        readings[i] = data.sensordata + draw.normal(size=2) * model.sensor_noise
    return {
        "control_times": times,
        "control_data": force[:, None],
        "sensordata_times": times[1:],
        "sensordata_data": readings,
        "initial_state": state,
    }


@pytest.fixture
def nominal(tmp_path):
    path = tmp_path / "nominal.xml"
    path.write_text(CART.format(damping=0))
    return path


@pytest.mark.skipif(not plugin.built_library().is_file(), reason="no plugin library: cargo build --release")
def test_what_is_missing_is_named_and_the_patched_model_has_it(nominal, tmp_path):
    options = {"out": tmp_path / "out", "medium": "none", "residual": False, "progress": False}
    found = gap.run(nominal, [trial(seed) for seed in range(4)], **options)
    assert found.verdict == json.loads((tmp_path / "out" / "verdict.json").read_text())
    assert found.verdict["verdict"] == "named", found.verdict
    (effect,) = found.named
    assert (effect.effect, effect.target) == ("joint_damping", "rail") and effect.probability > 0.9
    (value,) = effect.parameters.values()
    low, high = value.ci95
    assert low < DAMPING < high and low < value.value < high and value.unit == "N s/m"
    assert found.gap.before > 2 * found.gap.after and found.gap.reduction > 0.5 and found.gap.n_holdout_trials >= 1
    assert found.report.is_file()
    patched = mujoco.MjModel.from_xml_path(str(found.patched))
    assert abs(patched.dof_damping[0] - DAMPING) < 0.3
    # The same call reads the stages that are there; other trials are refused by the folder.
    assert gap.run(nominal, [trial(seed) for seed in range(4)], **options) == found
    with pytest.raises(DataError, match="out/trials holds other trials; overwrite=True replaces them"):
        gap.run(nominal, [trial(7)], **options)
    with pytest.raises(DataError, match="holds results of other inputs: .*--overwrite starts anew"):
        gap.run(nominal, tmp_path / "out" / "trials", **options, seed=3)


@pytest.mark.skipif(not plugin.built_library().is_file(), reason="no plugin library: cargo build --release")
def test_a_sensor_that_the_log_lacks_is_said_on_the_terminal(nominal, tmp_path):
    for seed in range(2):
        log = trial(seed)
        rows = zip(log["sensordata_times"], log["control_data"][1:, 0], log["sensordata_data"][:, 0])
        text = "\n".join(["time,motor,x", *(f"{time:.6f},{force:.6f},{place:.6f}" for time, force, place in rows)])
        tmp_path.joinpath("logs").mkdir(exist_ok=True)
        tmp_path.joinpath("logs", f"{seed}.csv").write_text(text + "\n")
    words = ["gap", "find", "--model", nominal, "--trials", tmp_path / "logs", "--out", tmp_path / "out"]
    run = subprocess.run([hydro_mujoco_entry.find_program(), *words], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert "not compared, for a log lacks them: `v`\n" in run.stderr


@pytest.mark.skipif(not plugin.built_library().is_file(), reason="no plugin library: cargo build --release")
def test_a_hull_on_a_level_rail_in_water_lacks_what_water_does_along_it(nominal, tmp_path):
    """Added mass, not a weaker motor; of buoyancy, which the rail carries, the log says nothing."""
    logs = [trial(seed, added=1.5) for seed in range(4)]
    found = gap.run(nominal, logs, out=tmp_path / "out", medium="water", residual=False, progress=False)
    assert {of.effect for of in found.named} == {"added_mass", "linear_drag"}, found.verdict
    values = {of.effect: of.parameters["surge"] for of in found.named}
    for effect, truth in (("added_mass", 1.5), ("linear_drag", DAMPING)):
        assert values[effect].value == pytest.approx(truth, rel=0.1)
    considered = json.loads((tmp_path / "out" / "name.json").read_text())["ranking"]
    assert not {"net_buoyancy", "buoyancy_offset"} & {effect for of in considered for effect, _ in of["effects"]}


@pytest.mark.skipif(not plugin.built_library().is_file(), reason="no plugin library: cargo build --release")
@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
def test_an_actuator_that_begins_at_rest_under_a_command_is_no_gap(integrator, tmp_path):
    """A log does not say what activations were before it; a simulation's are zero, whatever its first command."""
    cart = CART.replace('timestep="0.01"', f'timestep="0.01" integrator="{integrator}"')
    text = cart.format(damping=DAMPING).replace(
        '<motor name="motor" joint="rail" ctrlrange="-10 10"/>',
        '<general name="motor" joint="rail" ctrlrange="-10 10" dyntype="filterexact" dynprm="0.4"/>',
    )
    (tmp_path / "nominal.xml").write_text(text)
    logs = []
    for seed in range(4):
        model = mujoco.MjModel.from_xml_string(text)
        data = mujoco.MjData(model)
        draw = np.random.default_rng(seed)
        times = np.arange(401) * model.opt.timestep
        force = 10 * np.cos(draw.uniform(1, 3) * times)  # the first one is at its limit
        readings = np.empty((400, model.nsensordata))
        for i in range(400):
            data.ctrl[0] = force[i]
            mujoco.mj_step(model, data)
            readings[i] = data.sensordata + draw.normal(size=2) * model.sensor_noise
        log = {"control_times": times, "control_data": force[:, None], "sensordata_times": times[1:]}
        logs.append(log | {"sensordata_data": readings})
    found = gap.run(tmp_path / "nominal.xml", logs, out=tmp_path / "out", medium="none", residual=False, progress=False)
    assert found.verdict["verdict"] == "no_gap", found.verdict
    (before,) = [
        of for of in json.loads((tmp_path / "out/name.json").read_text())["nuisances"] if of[0] == "commands.before"
    ]
    assert before[1] == pytest.approx(-1, abs=0.1)


#: Two links on hinges, let go; `{upper}` and `{lower}` hold what the joints damp.
LINKS = """
<mujoco><compiler angle="radian"/><option timestep="0.002" integrator="RK4"/><worldbody>
  <body name="upper"><joint name="shoulder" axis="0 -1 0" {upper}/>
    <geom type="capsule" fromto="0 0 0 0 0 -0.25" size="0.01" mass="0.3"/>
    <body name="lower" pos="0 0 -0.25"><joint name="elbow" axis="0 -1 0" {lower}/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.2" size="0.01" mass="0.2"/></body></body>
</worldbody><sensor><jointpos name="first" joint="shoulder"/><jointpos name="second" joint="elbow"/></sensor></mujoco>
"""


@pytest.mark.skipif(not plugin.built_library().is_file(), reason="no plugin library: cargo build --release")
def test_joints_that_rub_unlike_each_other_are_named_each_with_its_value(tmp_path):
    """A common damping, and a friction for what it leaves, explains as much with one number less."""
    dampings = {"shoulder": 0.004, "elbow": 0.0015}
    model = mujoco.MjModel.from_xml_string(
        LINKS.format(upper=f'damping="{dampings["shoulder"]}"', lower=f'damping="{dampings["elbow"]}"')
    )
    rng = np.random.default_rng(5)
    logs = []
    for start in ([1.0, -0.4], [0.7, 0.9], [-1.2, 0.2]):
        data = mujoco.MjData(model)
        data.qpos[:] = start
        readings = []
        for _ in range(600):
            mujoco.mj_step1(model, data)
            readings.append(data.sensordata + 0.0035 * rng.standard_normal(2))
            for _ in range(5):
                mujoco.mj_step(model, data)
        times = 0.01 * np.arange(600) + model.opt.timestep
        no_commands = {"control_times": times, "control_data": np.empty((600, 0))}
        logs.append(no_commands | {"sensordata_times": times, "sensordata_data": np.array(readings)})
    path = tmp_path / "nominal.xml"
    path.write_text(LINKS.format(upper="", lower=""))
    found = gap.run(path, logs, out=tmp_path / "out", residual=False, progress=False)
    assert sorted((of.effect, of.target) for of in found.named) == [
        ("joint_damping", "elbow"),
        ("joint_damping", "shoulder"),
    ]
    for of in found.named:
        low, high = of.parameters["damping"].ci95
        assert low < dampings[of.target] < high, (of.target, of.parameters["damping"])
    assert found.verdict["verdict"] == "named" and found.verdict["verified"]
    assert found.patched is not None
    patched = mujoco.MjModel.from_xml_path(str(found.patched))
    written = [of.parameters["damping"].value for of in sorted(found.named, key=lambda of: of.target, reverse=True)]
    assert patched.dof_damping == pytest.approx(written)


def test_only_what_was_written_counts_as_named(tmp_path):
    value = {"name": "damping", "value": 1.0, "unit": "N s/m", "ci95": [0.5, 1.5]}
    entry = {"effect": "joint_damping", "target": "a", "probability": 0.99, "parameters": [value]}
    rival = entry | {"target": "b", "probability": 0.3}
    error = {"metric": "nrmse", "before": 1.0, "after": None, "reduction": None, "n_holdout_trials": 0}
    verdict = {"named": ["joint_damping"], "effects": [entry, rival], "gap": error, "doubts": ["far"], "patch": None}
    (tmp_path / "add.json").write_text(json.dumps({"effects": [entry]}))
    found = case(tmp_path, verdict)
    assert [(each.effect, each.target) for each in found.named] == [("joint_damping", "a")]
    assert (found.patched, found.gap.ci95, found.doubts) == (None, None, ["far"])
    (tmp_path / "add.json").write_text("null")
    assert case(tmp_path, verdict | {"named": []}).named == []


def test_effects_are_those_of_the_program(tmp_path):
    found = gap.effects()
    assert len(found) > 20 and found["quadratic_drag"].target == "body"
    assert [each.unit for each in found["added_mass"].parameters[:4]] == ["kg", "kg", "kg", "kg m^2"]
    with pytest.raises(DataError, match="folder is .*: no such file or folder"):
        gap.effects(tmp_path / "none")


class Trajectory:
    """As `mujoco.sysid.SystemTrajectory` saves itself."""

    def save_to_disk(self, path):
        np.savez(path, **trial(0))


def test_every_form_of_trials_becomes_files(tmp_path):
    written = tmp_path / "a.npz"
    np.savez(written, **trial(0))
    files.write([written, trial(1), Trajectory()], tmp_path / "t", overwrite=False)
    assert sorted(path.name for path in (tmp_path / "t").iterdir()) == ["a.npz", "trial_01.npz", "trial_02.npz"]
    with np.load(tmp_path / "t" / "trial_01.npz", allow_pickle=False) as saved:
        for name, array in trial(1).items():
            np.testing.assert_array_equal(saved[name], array)
    files.write({"b": trial(1)}, tmp_path / "t", overwrite=True)
    assert [path.name for path in (tmp_path / "t").iterdir()] == ["b.npz"]
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith("t.")] == []


@pytest.mark.parametrize(
    ("trials", "expected"),
    [
        ([], "trials is empty"),
        ({"control_times": 1}, "trials is one trial's arrays; expected a list"),
        (["none.txt"], "trial `none` is none.txt; expected a file .npz or .csv"),
        (
            ["a/t.npz", "b/t.csv"],
            r"two are called `t`, a/t.npz and b/t.csv; expected names that differ.*\{name: trial\}",
        ),
        (["trial_01.csv", trial(0)], "two are called `trial_01`, trial_01.csv and a dict without a name"),
        ([3], "trial `trial_00` is a int; expected a path, a mujoco.sysid.SystemTrajectory, or a dict"),
        (["none.npz"], "trial `none`, none.npz: no such file"),
        ({"a/b": {}}, "trial `a/b`: a name is that of a file"),
        ([{"control_times": [0]}], "trial `trial_00` has no control_data; expected control_times, control_data"),
        ([trial(0) | {"qpos": [1]}], "unknown array qpos; there are: control_times"),
        ([trial(0) | {"control_data": "x"}], "control_data is no array of numbers"),
        ([trial(0) | {"control_data": [1.0]}], r"control_data has shape \(1,\); expected 2 dimensions"),
        ([trial(0) | {"sensordata_times": [0.0]}], "sensordata_data has 400 rows, sensordata_times 1"),
    ],
)
def test_trials_that_are_refused_leave_nothing(trials, expected, tmp_path):
    with pytest.raises(DataError, match=expected):
        files.write(trials, tmp_path / "out" / "trials", overwrite=False)
    assert list((tmp_path / "out").glob("*")) == []


def test_a_folder_that_cannot_be_made(tmp_path):
    tmp_path.joinpath("out").write_text("mine")
    with pytest.raises(DataError, match="out/trials cannot be written: .*File exists"):
        files.write([trial(0)], tmp_path / "out" / "trials", overwrite=True)
    with pytest.raises(DataError, match="out cannot be written: .*Not a directory"):
        files.write([trial(0)], tmp_path / "out", overwrite=True)
    assert tmp_path.joinpath("out").read_text() == "mine"


def test_refusals(nominal, tmp_path):
    with pytest.raises(DataError, match="nominal is .*none.xml: no such file"):
        gap.run(tmp_path / "none.xml", tmp_path, out=tmp_path / "o")
    with pytest.raises(DataError, match="trials is .*nominal.xml; expected a folder, or a list of files"):
        gap.run(nominal, nominal, out=tmp_path / "o")
    with pytest.raises(DataError, match="invalid value '2' for '--holdout <HOLDOUT>': expected a part above 0"):
        gap.run(nominal, tmp_path, out=tmp_path / "o", holdout=2)
    assert not (tmp_path / "o").exists()
