"""The program behind functions: progress, errors, Ctrl-C. A script stands in for it."""

import io
import os
import signal
import stat
import sys
import threading
import time

import pytest
import tqdm.notebook
from hypothesis import given
from hypothesis import strategies as st

import hydro_mujoco_entry
from hydro_mujoco import DataError, program
from hydro_mujoco.recording import progress


@pytest.fixture(autouse=True)
def heeds_interrupts():
    """A shell's background jobs ignore SIGINT, and Python leaves that so."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def stand_in(tmp_path, monkeypatch):
    """Puts Python code in the place of the program."""

    def put(code):
        path = tmp_path / "hydro"
        path.write_text(f"#!{sys.executable}\nimport json, os, signal, sys, time\n{code}\n")
        path.chmod(path.stat().st_mode | stat.S_IXUSR)
        monkeypatch.setenv(hydro_mujoco_entry.PROGRAM, str(path))

    return put


def test_it_returns_what_the_program_prints(stand_in):
    stand_in("print(json.dumps(sys.argv[1:]))")
    assert program.run_json(["gap", "effects"]) == ["gap", "effects", "--json"]


def test_it_opens_the_libmujoco_of_this_python(stand_in, monkeypatch):
    stand_in("print(json.dumps(os.environ['HYDRO_MUJOCO_LIBRARY']))")
    assert os.path.isfile(program.run_json([]))
    monkeypatch.setenv("HYDRO_MUJOCO_LIBRARY", "/mine.so")
    assert program.run_json([]) == "/mine.so"


def test_large_outputs_on_both_channels_do_not_block(stand_in):
    stand_in(
        "sys.stderr.write('note\\n' * 100000); print(json.dumps('x' * 3000000)); sys.stderr.write('note\\n' * 100000)"
    )
    assert len(program.run_json([], progress=False)) == 3000000


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        ("hydro: --model a.xml: no such file", "--model a.xml: no such file"),
        (
            "training: 1/2 in 0 s\\nWARNING: x\\nhydro: the first\\nand the second line",
            "the first\nand the second line",
        ),
        (
            "error: invalid value 'x' for '--model <MODEL>'\\n  [possible values: mlp]\\n\\nFor more information, try '--help'.",
            "invalid value 'x' for '--model <MODEL>' [possible values: mlp]",
        ),
        ("nothing of use", "ended with status 3 and no message"),
    ],
)
def test_an_error_is_the_programs_own(stand_in, said, expected):
    stand_in(f"sys.stderr.write('''{said}\\n'''); sys.exit(3)")
    with pytest.raises(DataError) as caught:
        program.run_json([], progress=False)
    assert str(caught.value).endswith(expected)


def test_output_that_is_no_json(stand_in):
    stand_in("print('hydro 0.0.1')")
    with pytest.raises(DataError, match="no JSON.*another version"):
        program.run_json([])


def test_a_program_that_is_not_there(monkeypatch, tmp_path):
    monkeypatch.setenv(hydro_mujoco_entry.PROGRAM, str(tmp_path / "none"))
    with pytest.raises(DataError, match="HYDRO_PROGRAM is .*none: no such file"):
        program.run_json([])
    monkeypatch.delenv(hydro_mujoco_entry.PROGRAM)
    monkeypatch.setattr(hydro_mujoco_entry, "_PACKAGE", tmp_path / "python" / "hydro_mujoco")
    with pytest.raises(DataError, match="no program in .*bin/hydro or .*target; in a checkout: cargo build"):
        program.run_json([])


class Bar:
    """Keeps what a bar of tqdm is told."""

    made: list["Bar"] = []

    def __init__(self, total, desc, leave):
        self.total, self.desc, self.n, self.words, self.open = total, desc, 0, "", True
        Bar.made.append(self)

    def set_postfix_str(self, words, refresh):
        self.words = words

    def update(self, more):
        self.n += more

    def close(self):
        self.open = False

    written: list[str] = []
    write = staticmethod(lambda line, file: Bar.written.append(line))


@pytest.fixture
def bars(monkeypatch):
    Bar.made, Bar.written = [], []
    monkeypatch.setattr(program, "tqdm", Bar)
    monkeypatch.setattr(program, "has_bars", lambda stream: True)


LINES = """a remark
following: 0/3 in 0 s
following: 3/3 in 1 s, 0 s left
training: 1/40 in 2 s, 9 s left  epoch 1/20, loss 0.3
training: 40/40 in 9 s, 0 s left  epoch 20/20
training: 1/40 in 0 s
"""


def test_progress_is_a_bar_for_each_work_and_a_remark_is_shown(stand_in, bars):
    stand_in(f"sys.stderr.write({LINES!r}); print(os.environ['HYDRO_LOG_SECONDS'])")
    assert program.run_json([]) == 0.2
    assert [(bar.desc, bar.n, bar.total, bar.words, bar.open) for bar in Bar.made] == [
        ("following", 3, 3, "", False),
        ("training", 40, 40, "epoch 20/20", False),
        ("training", 1, 40, "", False),
    ]
    assert Bar.written == ["a remark"]


def test_no_progress_where_none_is_wanted(stand_in, bars):
    stand_in(f"sys.stderr.write({LINES!r}); print(1)")
    program.run_json([], progress=False)
    assert (Bar.made, Bar.written) == ([], [])


def test_an_error_is_raised_and_not_shown_too(stand_in, bars):
    stand_in("sys.stderr.write('a remark\\nhydro: the first\\nthe second\\n'); sys.exit(1)")
    with pytest.raises(DataError, match="the first\nthe second"):
        program.run_json([])
    assert Bar.written == ["a remark"]


def test_lines_in_a_log(stand_in, monkeypatch):
    Bar.written = []
    monkeypatch.setattr(program, "tqdm", Bar)
    stand_in(f"sys.stderr.write({LINES!r}); print(json.dumps('HYDRO_LOG_SECONDS' in os.environ))")
    assert program.run_json([]) is False
    assert Bar.written == LINES.splitlines()


def test_ctrl_c_reaches_the_program_once_and_what_it_writes_stays(stand_in, tmp_path):
    done = tmp_path / "done"
    stand_in(
        f"def stop(*_):\n  open({str(done)!r}, 'a').write('stopped'); sys.exit(130)\n"
        f"signal.signal(signal.SIGINT, stop)\nopen({str(done)!r}, 'w').close()\ntime.sleep(60)"
    )

    def interrupt():
        while not done.exists():
            time.sleep(0.01)
        signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)

    threading.Thread(target=interrupt).start()
    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        program.run_json([])
    assert done.read_text() == "stopped" and time.monotonic() - start < 10


def test_a_program_that_does_not_stop_is_killed(stand_in, tmp_path, monkeypatch):
    monkeypatch.setattr(program, "PATIENCE", 0.2)
    there = tmp_path / "there"
    stand_in(
        f"signal.signal(signal.SIGINT, signal.SIG_IGN)\nopen({str(there)!r}, 'w').write(str(os.getpid()))\ntime.sleep(60)"
    )

    def interrupt():
        while not (there.exists() and there.read_text()):
            time.sleep(0.01)
        signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)

    threading.Thread(target=interrupt).start()
    with pytest.raises(KeyboardInterrupt):
        program.run_json([])
    with pytest.raises(ProcessLookupError):
        os.kill(int(there.read_text()), 0)


def test_bars_are_for_terminals_and_notebooks(monkeypatch):
    class Notebook(tqdm.notebook.tqdm):
        pass

    assert not progress.has_bars(io.StringIO())
    monkeypatch.setattr(progress, "tqdm", Notebook)
    assert progress.has_bars(io.StringIO())


def test_flags():
    options = {"epochs": 3, "learning_rate": 2e-3, "resume": True, "overwrite": False, "seed": None, "hidden": [8, 8]}
    assert program.flags(options) == ["--epochs", "3", "--learning-rate", "0.002", "--resume", "--hidden", "8,8"]


@given(st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\n"), max_size=60))
def test_any_line_is_progress_or_is_kept(line):
    said = program._follow([line + "\n"], progress=False)
    assert said == ([] if program.PROGRESS.fullmatch(line) else [line])


def test_paths(tmp_path):
    with pytest.raises(DataError, match="nominal is .*none.xml: no such file or folder"):
        program.existing("nominal", tmp_path / "none.xml")
    with pytest.raises(DataError, match="out is a int; expected a path"):
        program.folder("out", 3)
    assert program.folder("out", "--seed").is_absolute()
