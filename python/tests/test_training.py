"""`train` and `evaluate` by the program itself."""

import json

import pytest

import hydro_mujoco
import hydro_mujoco_entry
import models
from hydro_mujoco import DataError

try:
    hydro_mujoco_entry.find_program()
except FileNotFoundError as error:
    pytest.skip(f"{error}", allow_module_level=True)

TINY = {"model": "mlp", "preset": "demo", "epochs": 2, "hidden": [16], "progress": False}


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    folder = tmp_path_factory.mktemp("data")
    (folder / "fish.xml").write_text(models.fish())
    hydro_mujoco.record(folder / "fish.xml", folder / "fish", trials=12, samples=40)
    return folder / "fish"


def test_a_checkpoint_and_its_scores(data, tmp_path):
    trained = hydro_mujoco.train(data, tmp_path / "model", **TINY, learning_rate=1e-3)
    card = json.loads((trained.checkpoint / "card.json").read_text())
    assert (card["kind"], trained.test) == ("mlp", card["metrics"])
    assert "--learning-rate 0.001" in card["command"]
    found = hydro_mujoco.evaluate(trained.checkpoint, data)
    assert found["errors"]["pooled"] == pytest.approx(trained.nrmse, rel=1e-5)
    assert hydro_mujoco.train(data, tmp_path / "model", **TINY, learning_rate=1e-3, resume=True) == trained
    with pytest.raises(DataError, match="is there already: --resume goes on with it, --overwrite starts anew"):
        hydro_mujoco.train(data, tmp_path / "model", **TINY)


def test_refusals(data, tmp_path):
    for options, expected in [
        ({"model": "mlpp"}, r"invalid value 'mlpp' for '--model <MODEL>' \[possible values: attention-ode"),
        ({"epochs": 0}, "epochs is 0, expected at least 1"),
        ({"lerning_rate": 2}, "unexpected argument '--lerning-rate' found"),
    ]:
        with pytest.raises(DataError, match=expected):
            hydro_mujoco.train(data, tmp_path / "model", **(TINY | options))
    with pytest.raises(DataError, match="data is .*none: no such file or folder"):
        hydro_mujoco.train(tmp_path / "none", tmp_path / "model")
    with pytest.raises(DataError, match="checkpoint is .*none: no such file or folder"):
        hydro_mujoco.evaluate(tmp_path / "none", data)
    assert not (tmp_path / "model").exists()
