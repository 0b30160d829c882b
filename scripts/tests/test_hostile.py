"""The campaign of hostile inputs judges what it sees, repeats itself from its seed, and goes on where it was."""

import json
import os
import random
import subprocess
import sys
from pathlib import Path

import mujoco
import pytest

from hydro_mujoco.plugin import built_library
from hydro_tools.hostile import campaign, odd
from hydro_tools.hostile.bases import EFFECTS, SCENE
from hydro_tools.hostile.learning import config
from hydro_tools.hostile.limits import Limits
from hydro_tools.hostile.running import Case, Outcome, SceneCase, judge, run

LIMITS = Limits(1 << 30, 0.5)


@pytest.mark.parametrize(
    ("status", "text", "stopped", "result"),
    [
        (0, "", None, "accepted"),
        (1, "going on\nhydro: x.json: size is -1, expected 1", None, "refused"),
        (2, "error: invalid value\n\nUsage: a\n\nFor more information", None, "refused"),
        (1, "", None, "broken"),
        (1, "hydro: a\nb\nc\nd", None, "broken"),
        (1, "hydro: " + "y" * 5000, None, "broken"),
        (101, "thread 'main' panicked at src/x.rs:1:\ncapacity overflow", None, "broken"),
        (-6, "memory allocation of 8 bytes failed", None, "broken"),
        (-11, "", None, "broken"),
        (130, "", 0.2, "accepted"),
        (130, "", 1.4, "broken"),
        (-2, "", 0.2, "accepted"),
        (-11, "", 0.2, "broken"),
    ],
)
def test_the_end_of_a_command_is_judged(status: int, text: str, stopped: float | None, result: str):
    assert judge(status, text, stopped, may_run_on=True).result == result


def test_what_has_no_end_is_stopped(tmp_path: Path):
    endless = [sys.executable, "-c", "import time\ntry:\n    time.sleep(60)\nexcept KeyboardInterrupt:\n    pass"]
    assert run(Case(endless, may_run_on=True), LIMITS, tmp_path).result == "accepted"
    busy = ["sh", "-c", "while :; do :; done"]
    assert run(Case(busy), LIMITS, tmp_path).why.startswith("not at an end in time")
    deaf = [sys.executable, "-c", "import signal, time\nsignal.signal(2, signal.SIG_IGN)\ntime.sleep(60)"]
    assert run(Case(deaf, may_run_on=True), LIMITS, tmp_path).why.startswith("SIGINT took")


def test_memory_has_a_limit(tmp_path: Path):
    greedy = [sys.executable, "-c", "bytearray(1 << 31)"]
    assert "Traceback" in run(Case(greedy), LIMITS, tmp_path).why


@pytest.mark.skipif(not built_library().is_file(), reason="no plugin is built: cargo build")
def test_a_scene_has_a_process_of_its_own(tmp_path: Path):
    """Accepted, refused, aborted and endless, one after another."""
    whole = SCENE.format(config=config(effects=json.dumps(EFFECTS), density=1000))
    scene, library = tmp_path / "scene.xml", built_library()

    def outcome(xml: str, library: Path = library) -> Outcome:
        scene.write_text(xml)
        return run(SceneCase(library, scene), Limits(3 << 30, 20.0), tmp_path)

    assert outcome(whole).result == "accepted"
    refused = outcome(whole.replace("1000", "-1"))
    assert refused.result == "refused" and "density" in refused.why
    # That library loads nothing, so the plugin is unknown: what an earlier scene loaded is not there.
    other = Path(mujoco.__file__).parent / f"libmujoco.so.{mujoco.mj_versionString()}"
    assert "hydro.wrench" in outcome(whole, other).why
    assert outcome(whole, tmp_path / "none.so").result == "broken"
    os.mkfifo(tmp_path / "endless.xml")
    endless = run(SceneCase(library, tmp_path / "endless.xml"), Limits(3 << 30, 1.0), tmp_path)
    assert endless.why.startswith("not at an end in time")


def test_changes_repeat_from_their_seed():
    document = {"config": {"latent": 4, "hidden": [8, 8]}, "name": "x", "period": 0.01}
    made = [[odd.json_bytes(random.Random(seed), document) for seed in range(50)] for _ in range(2)]
    assert made[0] == made[1]
    assert len(set(made[0])) > 30
    assert document["config"]["latent"] == 4


def test_outcomes_are_gone_on_with_and_counted(tmp_path: Path):
    path = tmp_path / "outcomes.jsonl"
    known = [campaign.Record("card", n, 0, result, "") for n, result in enumerate(("refused", "refused", "broken"))]
    path.write_text("".join(json.dumps(vars(record)) + "\n" for record in known) + '{"kind": "ca')
    assert campaign.records(path) == known
    assert campaign.table(known).splitlines()[-2:] == ["| card | 3 | 2 | 0 | 1 |", "| all | 3 | 2 | 0 | 1 |"]


def test_the_command_says_what_it_takes():
    script = Path(__file__).resolve().parents[1] / "hostile.py"
    said = subprocess.run([sys.executable, str(script), "--help"], capture_output=True, text=True)
    assert said.returncode == 0, said.stderr
    assert "--count" in said.stdout
