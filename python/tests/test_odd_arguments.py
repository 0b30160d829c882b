"""`train`, `evaluate`, `gap.run` and `record` with odd arguments: a refusal, never another end. Needs hypothesis."""

import os
import tempfile
from pathlib import Path

import pytest

import hydro_mujoco
import models
from hydro_mujoco import gap
from hydro_mujoco.errors import DataError

pytest.importorskip("hypothesis")
from hypothesis import given, settings  # noqa: E402
from hypothesis import strategies as st  # noqa: E402

pytestmark = pytest.mark.skipif(not hydro_mujoco.plugin.built_library().is_file(), reason="nothing is built")

ODD = (
    st.none()
    | st.booleans()
    | st.integers(-3, 2**70)
    | st.floats()
    | st.text(max_size=6)
    | st.binary(max_size=6)
    | st.sampled_from([Path("/dev/zero"), Path("/dev/null"), Path("/proc/self/mem"), Path()])
    | st.lists(st.integers() | st.text(max_size=3), max_size=3)
)
SMALL = {"model": "mlp", "hidden": [4], "epochs": 1}
#: A word that is no text, a number that is none, a name that no file can have.
REFUSED = (DataError, TypeError, ValueError, OverflowError)


@pytest.fixture(scope="module", autouse=True)
def elsewhere():
    """Work in an empty folder: an odd name may be that of one that is made."""
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        yield
        os.chdir(before)


@settings(max_examples=25, deadline=None)
@given(
    data=ODD,
    given_=st.dictionaries(
        st.sampled_from(["model", "preset", "epochs", "seed", "hidden", "outputs", "batch", "what"]), ODD, max_size=3
    ),
)
def test_a_training(data, given_):
    with pytest.raises(REFUSED):
        hydro_mujoco.train(data, "out", progress=False, **given_)
    assert not Path("out").exists()


@pytest.fixture(scope="module")
def trained(elsewhere):
    """A small data set and a checkpoint that was trained on it."""
    Path("fish.xml").write_text(models.fish())
    hydro_mujoco.record("fish.xml", "fish", trials=10, samples=6)
    hydro_mujoco.train("fish", "model", **SMALL, progress=False)
    return "fish", "model"


@settings(max_examples=40, deadline=None)
@given(
    given_=st.dictionaries(
        st.sampled_from(
            ["seed", "outputs", "preset", "batch", "horizon", "learning_rate", "patience", "solver", "what"]
        ),
        ODD,
        min_size=1,
        max_size=2,
    )
)
def test_options_of_a_training(trained, given_):
    try:
        found = hydro_mujoco.train(trained[0], "other", overwrite=True, progress=False, **(SMALL | given_))
    except REFUSED:
        return
    assert found.nrmse is not None


@settings(max_examples=25, deadline=None)
@given(given_=st.dictionaries(st.sampled_from(["split", "start", "solver"]), ODD, min_size=1))
def test_options_of_an_evaluation(trained, given_):
    try:
        found = hydro_mujoco.evaluate(trained[1], trained[0], **given_)
    except REFUSED:
        return
    assert found["errors"]


@settings(max_examples=25, deadline=None)
@given(checkpoint=ODD, data=ODD, split=ODD, start=ODD, solver=ODD)
def test_an_evaluation(checkpoint, data, split, start, solver):
    with pytest.raises(REFUSED):
        hydro_mujoco.evaluate(checkpoint, data, split=split, start=start, solver=solver)


@settings(max_examples=25, deadline=None)
@given(
    nominal=ODD,
    trials=ODD | st.dictionaries(st.text(max_size=3), ODD, max_size=2),
    given_=st.dictionaries(
        st.sampled_from(["uncertainty", "effects", "medium", "holdout", "seed", "threads"]), ODD, max_size=3
    ),
)
def test_a_gap(nominal, trials, given_):
    with pytest.raises(REFUSED):
        gap.run(nominal, trials, out="gap", progress=False, **given_)


@settings(max_examples=60, deadline=None)
@given(
    given_=st.dictionaries(
        st.sampled_from(
            ["seed", "body", "water", "density", "sample_period", "noise", "effort", "frequency", "splits", "plugin"]
        ),
        ODD,
        min_size=1,
        max_size=2,
    )
)
def test_a_recording(given_):
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder, "fish.xml")
        scene.write_text(models.fish())
        few = {"trials": 1, "samples": 3, "splits": (1, 0, 0)}
        try:
            manifest = hydro_mujoco.record(scene, Path(folder, "data"), **(few | given_))
        except REFUSED:
            return
        assert sum(split["trajectories"] for split in manifest["splits"].values()) == 1
