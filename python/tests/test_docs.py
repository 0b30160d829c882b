"""Code of README.md and docs/, as written.

`scripts/test_wheel.sh` runs the blocks with the wheel in an environment of its own: HYDRO_DOCS_BIN is its folder of programs.
A block that is not run says why in a comment above it, `<!-- not run: 3 min -->`; without one it must run.
"""

import json
import os
import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import code_blocks
import models
from code_blocks import Block

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
BLOCKS = {page: code_blocks.blocks(page, page.read_text()) for page in PAGES}
BIN = os.environ.get("HYDRO_DOCS_BIN")
RUN = ("python", "sh", "xml")
#: Languages that are read, not run; a block without one is an output.
READ = {"json": json.loads, "toml": tomllib.loads}
#: Folders of a clone that a page may name.
CLONE = ("docs", "examples", "mjcf", "models", "scripts")
#: Seconds for a block.
PATIENCE = 120

#: A body that fragments of XML are about, with its names in the pages.
HULL = """<mujoco><option timestep="0.005"/>
<extension><plugin plugin="hydro.wrench">{instance}</plugin></extension>
<worldbody><body name="hull"><freejoint/><geom type="ellipsoid" size="0.33 0.18 0.1" mass="12"/>
<plugin plugin="hydro.wrench" instance="water"/><body name="hull_water"/></body></worldbody></mujoco>"""
DRAG = """<config key="effects" value='{"schema": "hydro-effects/1", "effects": [{"effect": "quadratic_drag", "target": "hull",
"parameters": {"surge": 18, "sway": 30, "heave": 40, "roll": 0.5, "pitch": 0.7, "yaw": 0.8}}]}'/>"""

#: An effect of one's own for the cart of the logs.
BRAKE = """summary = "a brake that grows with the speed's cube"
phrase = "a brake"
target = "slide"
force = "-c * qdot^3"
[parameters.c]
unit = "N s^3/m^3"
lower = 0.0
upper = 10.0
prior_sd = 1.0
"""


def scene(text: str) -> str:
    """A fragment of a page as a whole model."""
    if text.startswith("<mujoco"):
        return text
    if text.startswith("<extension>"):
        # A robot's, with its own sensors; site `cell` for a load cell.
        extension, sensors = (
            re.search(r"<extension>.*</extension>", text, re.S),
            re.search(r"<sensor>.*</sensor>", text, re.S),
        )
        whole = (ROOT / "mjcf" / "b1_swim.xml").read_text()
        whole = re.sub(r"<extension>.*?</extension>", lambda _: extension[0], whole, flags=re.S)
        if sensors:
            whole = re.sub(r"<sensor>.*?</sensor>", lambda _: sensors[0], whole, flags=re.S)
            whole = re.sub(r'(<body name="trunk"[^>]*>)', r'\1<site name="cell"/>', whole)
        return whole
    if text.startswith("<instance"):
        return HULL.format(instance=text)
    if text.startswith("<config"):
        configs = text if '"effects"' in text else text + DRAG
        return HULL.format(instance=f'<instance name="water">{configs}</instance>')
    raise ValueError(f"no model is known that {text[:40]!r} is a part of")


def test_every_block_is_run_or_says_why_not(capsys):
    left, wrong = [], []
    for found in BLOCKS.values():
        for block in found:
            if block.not_run:
                left.append(f"{block}: {block.not_run}")
            elif block.language and block.language not in RUN and block.language not in READ:
                wrong.append(f"{block}: nobody runs `{block.language}`")
    with capsys.disabled():
        print("", *(f"not run: {line}" for line in left), sep="\n")
    assert not wrong


@pytest.mark.parametrize("block", [b for found in BLOCKS.values() for b in found if b.language in READ], ids=str)
def test_what_is_data_can_be_read(block: Block):
    READ[block.language](block.text)


@pytest.fixture(scope="session")
def prepared(tmp_path_factory):
    """A folder with what the pages take to be there: a model, a data set, a checkpoint, a nominal and its logs."""
    import hydro_mujoco

    try:
        import test_gap
    except pytest.skip.Exception as skipped:
        pytest.fail(f"the blocks are to be run, and there is {skipped}")
    from hydro_mujoco.gap import trials

    folder = tmp_path_factory.mktemp("prepared")
    folder.joinpath("my.xml").write_text(models.fish())
    hydro_mujoco.record(folder / "my.xml", folder / "data" / "mine", trials=12, samples=60)
    hydro_mujoco.train(
        folder / "data" / "mine", folder / "out" / "mine", model="mlp", preset="demo", epochs=1, hidden=[8]
    )
    folder.joinpath("nominal.xml").write_text(test_gap.CART.format(damping=0))
    trials.write([test_gap.trial(seed) for seed in range(3)], folder / "logs", overwrite=False)
    folder.joinpath("effects.d").mkdir()
    folder.joinpath("effects.d", "brake.toml").write_text(BRAKE)
    return folder


@pytest.mark.skipif(BIN is None, reason="scripts/test_wheel.sh runs the blocks")
@pytest.mark.parametrize(
    "page", [page for page in PAGES if any(b.language in RUN for b in BLOCKS[page])], ids=lambda p: p.name
)
def test_the_blocks_of_a_page_run_in_order(page, prepared, tmp_path):
    shutil.copytree(prepared, tmp_path, dirs_exist_ok=True)
    for name in CLONE:
        tmp_path.joinpath(name).symlink_to(ROOT / name)
    environment = {"PATH": f"{BIN}:/usr/bin:/bin", "HOME": str(tmp_path), "PYTHONWARNINGS": "error::RuntimeWarning"}
    for block in BLOCKS[page]:
        if block.language not in RUN or block.not_run:
            continue
        if block.language == "xml":
            whole = scene(block.text)
            # The name that a page has for the model that it shows.
            tmp_path.joinpath("hull.xml" if block.text.startswith("<mujoco") else "part.xml").write_text(whole)
            words = [
                "python",
                "-c",
                "import mujoco, sys; mujoco.MjData(mujoco.MjModel.from_xml_string(sys.stdin.read()))",
            ]
            given_in = whole
        elif block.language == "python":
            words, given_in = ["python", "-"], block.text
        else:
            words, given_in = ["bash", "-euo", "pipefail"], block.text
        run = subprocess.run(
            words, input=given_in, capture_output=True, text=True, cwd=tmp_path, env=environment, timeout=PATIENCE
        )
        assert run.returncode == 0, f"{block}\n{block.text}\n{run.stdout}\n{run.stderr}"


LINES = st.lists(
    st.sampled_from(["", "text", "```", "```python", "    ```", "<!-- not run: 3 min -->", "x = 1"]), max_size=12
)


@given(LINES)
def test_blocks_hold_every_line_between_fences_and_none_outside(lines):
    text = "\n".join(lines)
    try:
        found = code_blocks.blocks(Path("a.md"), text)
    except ValueError as error:
        assert "is not closed" in str(error)
        return
    inside = set()
    for block in found:
        size = block.text.count("\n")
        assert block.text == "".join(f"{line}\n" for line in lines[block.line : block.line + size])
        assert "```" not in block.text.replace("    ```", "").replace("```python", "")
        marked = block.line > 1 and lines[block.line - 2] == "<!-- not run: 3 min -->"
        assert block.not_run == ("3 min" if marked else None)
        inside |= set(range(block.line, block.line + size))
    outside = [line for number, line in enumerate(lines) if number not in inside]
    assert sum(line.startswith("```") for line in outside) == 2 * len(found)


def test_a_mark_stands_right_above_its_block():
    text = "<!-- not run: 3 min -->\n```sh\nhydro\n```\n<!-- not run: x -->\n\n```python\n```\n"
    marks = [(block.language, block.not_run) for block in code_blocks.blocks(Path("a.md"), text)]
    assert marks == [("sh", "3 min"), ("python", None)]
