"""Readers of what a user names refuse what is no file, or too large, before they read it."""

import os
import signal
from pathlib import Path

import pytest

from hydro_mujoco import DataError
from hydro_tools import outcomes
from hydro_tools.baselines import BaselineError, motion, patched
from hydro_tools.baselines.case import PreparedCase
from hydro_tools.datasets import replay, rollouts, scene, trial_replay
from hydro_tools.gaits import gait_file
from hydro_tools.hidden_cases import gap
from hydro_tools.hidden_cases.score import read as score
from hydro_tools.hidden_cases.score import record
from hydro_tools.hidden_cases.score.read import ScoreError
from hydro_tools.identification import measurements
from hydro_tools.learning_curves import curve
from hydro_tools.strip_models import results
from hydro_tools.tank import campaign

ODD = {
    "device": "is a device; expected a file",
    "pipe": "is a pipe; expected a file",
    "folder": "is a folder; expected a file",
    "large": r"is \d+ bytes; expected \d+ at most",
}


@pytest.fixture(autouse=True)
def no_waiting():
    """A reader that waits for somebody to write into a pipe fails."""
    before = signal.signal(signal.SIGALRM, lambda *_: pytest.fail("it waits"))
    signal.alarm(60)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def put(path: Path, kind: str) -> None:
    """Put what is no file, or a file of a tebibyte, in a file's place."""
    if kind == "device":
        path.symlink_to("/dev/null")
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    else:
        path.touch()
        os.truncate(path, 1 << 40)


def run_gap(folder: Path) -> None:
    raise DataError(gap.run(Path("hydro"), folder, folder / "out", 1.0, 1) or "nothing")


#: By the reader: the file's name, and a call that reads it in a folder.
ENTRIES = {
    "gait": ("gait.json", lambda folder: gait_file.read(folder / "gait.json", None)),
    "rollouts": ("rollouts.json", rollouts.read),
    "scene": ("a.xml", lambda folder: scene.find(str(folder / "a.xml"))),
    "card": ("card.json", lambda folder: replay.water_of("mjcf/b1_swim.xml", folder)),
    "tows": ("tows.csv", lambda folder: measurements.read(folder / "tows.csv")),
    "run": ("run.npz", lambda folder: campaign.read(folder / "run.npz")),
    "curve": (curve.LOG, curve.read),
    "outcomes": ("outcomes.jsonl", lambda folder: outcomes.read(folder / "outcomes.jsonl", dict)),
    "verdict": ("verdict.json", lambda folder: score._json(folder / "verdict.json")),
    "record": ("record.jsonl", lambda folder: record.load([folder / "record.jsonl"])),
    "strips": ("open.json", results.read),
    "case": ("case.json", run_gap),
    "nominal": ("nominal.xml", lambda folder: PreparedCase(folder, 0.1)),
    "csv": ("t.csv", lambda folder: motion.read(folder / "t.csv", None)),
    "npz": ("t.npz", lambda folder: motion.read(folder / "t.npz", None)),
    "trial": ("t.npz", lambda folder: trial_replay.Trial(folder / "t.npz")),
    "patch": ("verdict.json", lambda folder: patched.models(folder / "nominal.xml", folder / "verdict.json")),
}


@pytest.mark.parametrize("kind", ODD)
@pytest.mark.parametrize("entry", ENTRIES)
def test_each_reader_refuses_it(tmp_path: Path, entry: str, kind: str):
    name, call = ENTRIES[entry]
    put(tmp_path / name, kind)
    with pytest.raises((DataError, ScoreError, BaselineError), match=f"{name}: {ODD[kind]}"):
        call(tmp_path)
