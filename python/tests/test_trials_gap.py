"""From the logs of a swimming vehicle to a named effect and a patched model, by the commands that docs/logs.md shows."""

import json
import subprocess
import sys
import tomllib
from pathlib import Path

import mujoco
import numpy as np
import pytest

import dive
import hydro_mujoco_entry
import writers
from hydro_mujoco import plugin

try:
    hydro_mujoco_entry.find_program()
except FileNotFoundError as error:
    pytest.skip(f"{error}", allow_module_level=True)
pytestmark = pytest.mark.skipif(not plugin.built_library().is_file(), reason="no plugin library: cargo build --release")
#: Length of the dive and of its trials [s]; seconds for `hydro gap`.
SECONDS, LENGTH, PATIENCE = 30.0, 5.0, 240
TRUTH = dive.LACKING["quadratic_drag"]


@pytest.fixture(scope="module")
def made():
    """A vehicle that has quadratic drag, and readings of it as instruments give them."""
    swum = dive.swim(SECONDS, 1)
    return swum, dive.noisy(swum, 2)


def run(folder, *words, patience=60):
    """What a command says, run in a folder."""
    found = subprocess.run(words, capture_output=True, text=True, cwd=folder, timeout=patience)
    assert found.returncode == 0, found.stderr
    return found.stdout


def converted(folder, made, kind):
    """Make trials of a dive's log by the proposed mapping with shorter trials."""
    swum, readings = made
    nominal = dive.vehicle(dive.KNOWN)
    nominal.compile()
    (folder / "nominal.xml").write_text(nominal.to_xml())
    if kind == "DataFlash":
        writers.dataflash(folder / "dive.bin", swum.times, swum.commands, readings)
    else:
        writers.rosbag(folder / "dive_ros2", swum.times, swum.commands, readings, dive.EPOCH)
    log = "dive.bin" if kind == "DataFlash" else "dive_ros2"
    convert = [sys.executable, "-m", "hydro_mujoco.trials", "convert", log, "--model", "nominal.xml"]
    proposed = run(folder, *convert, "--dry-run")
    assert tomllib.loads(proposed)["trials"]["length"] == 10
    (folder / "map.toml").write_text(proposed.replace("length = 10.0", f"length = {LENGTH}"))
    report = run(folder, *convert, "--mapping", "map.toml", "--out", "trials")
    assert "6 trials written to trials" in report and "SUSPECT" not in report, report


def test_two_kinds_of_log_become_the_same_trials(made, tmp_path):
    each = []
    for kind in ("ROS 2 bag", "DataFlash"):
        folder = tmp_path / kind
        folder.mkdir()
        converted(folder, made, kind)
        each.append([np.load(path) for path in sorted((folder / "trials").glob("*.npz"))])
    for bag, flash in zip(*each, strict=True):
        assert flash["sensordata_times"] == pytest.approx(bag["sensordata_times"], abs=1e-9)
        assert np.median(np.abs(flash["control_data"] - bag["control_data"])) < 0.01
        places = [json.loads(str(one["sensordata_signal_mapping"])) for one in (bag, flash)]
        for sensor in ("imu_gyro", "attitude", "position"):
            one, other = (of["sensordata_data"][:, at[sensor][1]] for of, at in zip((bag, flash), places))
            assert np.nanmedian(np.abs(one - other)) < 3 * dive.NOISE[sensor], sensor


def test_a_log_becomes_a_named_effect_and_a_patched_model(made, tmp_path):
    converted(tmp_path, made, "ROS 2 bag")
    program = hydro_mujoco_entry.find_program()
    words = ["--model", "nominal.xml", "--trials", "trials", "--out", "gap", "--medium", "water", "--no-residual"]
    said = run(tmp_path, program, "gap", "run", *words, patience=PATIENCE)

    verdict = json.loads((tmp_path / "gap" / "verdict.json").read_text())
    assert (verdict["verdict"], verdict["named"], verdict["verified"]) == ("named", ["quadratic_drag"], True), said
    assert verdict["gap"]["reduction"] > 0.8
    (effect,) = [each for each in verdict["effects"] if each["effect"] == "quadratic_drag"]
    assert effect["target"] == "rov" and effect["probability"] > 0.9
    found = {each["name"]: each for each in effect["parameters"]}
    for name, value in TRUTH.items():
        low, high = found[name]["ci95"]
        assert low < value < high, f"{name}: {low:.3g} to {high:.3g}, truth {value:g}"
    for name in ("surge", "sway"):
        assert found[name]["value"] == pytest.approx(TRUTH[name], rel=0.1)
    # The patched model swims as the truth does: it starts with more drag, here pushed along x.
    forces = []
    for path in ("nominal.xml", str(Path("gap", "patched.xml"))):
        model = mujoco.MjModel.from_xml_path(str(tmp_path / path))
        data = mujoco.MjData(model)
        data.qvel[0] = 1.0
        mujoco.mj_forward(model, data)
        forces.append(float(data.qfrc_passive[0]))
    assert forces[1] - forces[0] == pytest.approx(-TRUTH["surge"], rel=0.1)
