"""Reference pages: those in docs/ are what the program says; what is wrong with the program is said."""

import json
import stat
from pathlib import Path

import pytest

from hydro_mujoco.errors import DataError
from hydro_tools.commands import make_reference
from hydro_tools.reference import attributes, effects, environments
from hydro_tools.reference.lists import read_list
from hydro_tools.reference.markdown import table

PARAMETER = {"name": "gain", "unit": "1", "null": 1.0, "prior_sd": 0.0123456, "lower": None, "upper": 67123.9}
EFFECT = {
    "id": "echo",
    "target": "actuator",
    "phrase": "an echo",
    "summary": "a force | that returns",
    "equation": "f = |u|",
    "source": "nobody",
    "idealised": False,
    "placement": "plugin",
    "is_hypothesis": False,
    "parameters": [
        PARAMETER | {"optional": True, "left_out": None},
        PARAMETER | {"name": "delay", "unit": "s", "optional": False, "left_out": 0.25},
        PARAMETER | {"name": "period", "unit": "s", "optional": False, "left_out": None},
    ],
}


def fake(folder: Path, script: str) -> Path:
    program = folder / "hydro"
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    return program


@pytest.mark.skipif(not make_reference.built_program().is_file(), reason="no program: cargo build")
def test_the_pages_in_docs_are_those_of_the_program(capsys):
    assert make_reference.main(["--check"]) == 0, capsys.readouterr().out


def test_an_effect_is_written_whole():
    page = effects.page({"example": "a stone", "effects": [EFFECT]})
    assert "| [`echo`](#echo) | actuator | a force \\| that returns | `gain` [1], `delay`, `period` [s] |" in page
    assert "## On an actuator\n\n### echo\n\nAn echo: a force | that returns.\n\n```\nf = |u|\n```" in page
    assert "| `gain` |  | 1 | 0.0123 | any to 67,100 | 1 |\n| `delay` | s | 1 | 0.0123 | any to 67,100 | 0.25 |" in page
    assert "| `period` | s | 1 | 0.0123 | any to 67,100 |  |" in page
    assert "`hydro gap` does not try it" in page
    assert "this form is exact" in page


def test_a_new_kind_of_target_is_not_left_out():
    assert "## On a tendon" in effects.page({"example": "", "effects": [EFFECT | {"target": "tendon"}]})


def test_an_attribute_is_written_whole():
    one = {"name": "depth", "unit": None, "meaning": "how deep", "default": "0"}
    page = attributes.page({"plugins": [{"plugin": "hydro.x", "attributes": [one]}]})
    assert page.endswith(
        "## hydro.x\n\n| attribute | unit | meaning | default |\n|---|---|---|---|\n| `depth` |  | how deep | 0 |\n"
    )


def test_environments_are_their_docstrings():
    page = environments.page()
    for heading in ("## B1Swim-v0", "### Action Space", "## RovStation-v0", "### Episode End"):
        assert f"\n\n{heading}\n" in page


def test_units_that_neighbours_share_stand_once():
    shared = [
        PARAMETER | {"name": name, "unit": "kg", "optional": False, "left_out": None} for name in ("surge", "sway")
    ]
    page = effects.page({"example": "", "effects": [EFFECT | {"parameters": shared}]})
    assert "`surge`, `sway` [kg] |" in page


def test_a_table_of_no_rows_is_a_header():
    assert table(("a", "b"), []) == ["| a | b |", "|---|---|"]


def test_a_page_that_differs_is_found_and_written(tmp_path, monkeypatch, capsys):
    lists = {"gap": {"schema": "hydro-gap-effects/1", "example": "", "effects": [EFFECT]}}
    lists["attributes"] = {"schema": "hydro-attributes/1", "plugins": []}
    for name, value in lists.items():
        (tmp_path / name).write_text(json.dumps(value))
    program = fake(tmp_path, f'cat "{tmp_path}/$1"')
    (tmp_path / "docs").mkdir()
    monkeypatch.setattr(make_reference, "ROOT", tmp_path)
    flags = ["--program", str(program)]
    assert make_reference.main([*flags, "--check"]) == 1
    assert "docs/reference-effects.md is not what the program says" in capsys.readouterr().out
    assert not list((tmp_path / "docs").iterdir())
    assert make_reference.main(flags) == 0
    assert make_reference.main([*flags, "--check"]) == 0
    assert sorted(path.name for path in (tmp_path / "docs").iterdir()) == [
        "reference-attributes.md",
        "reference-effects.md",
        "reference-envs.md",
    ]


@pytest.mark.parametrize(
    ("script", "message"),
    [
        ("echo no such command >&2; exit 2", "`.*hydro attributes --json` failed: no such command"),
        ("exit 3", "failed: status 3"),
        ("echo hello", "printed no JSON"),
        ("echo '[]'", "its schema is None, expected 'hydro-attributes/1'"),
        ("""echo '{"schema": "hydro-attributes/2"}'""", "its schema is 'hydro-attributes/2', expected"),
    ],
)
def test_a_program_that_says_something_else_is_refused(tmp_path, script, message):
    with pytest.raises(DataError, match=message):
        read_list(fake(tmp_path, script), ("attributes",))


def test_without_the_program_the_command_says_how_to_get_it(tmp_path, capsys):
    assert make_reference.main(["--program", str(tmp_path / "none")]) == 1
    assert "No such file or directory; build it with `cargo build --release`" in capsys.readouterr().err
