"""The campaign of kills: what may differ, how a command is struck and judged, what the table counts."""

import json
import random
import re
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from hydro_tools.commands.make_reference import built_program
from hydro_tools.hostile import bases
from hydro_tools.kills import KillsError, campaign, jobs, trouble
from hydro_tools.kills.content import content, differences, plain

#: Writes a byte into `part`, renames it to the next number, ten times; goes on where numbers stand.
COUNTS = """
import os, sys, time
done = len([n for n in os.listdir() if n.isdigit()])
if done: print("going on after", done)
for number in range(done, 10):
    with open("part", "w") as file: file.write("x" * 100)
    time.sleep(0.02)
    os.rename("part", str(number))
"""
#: The same, but it leaves what a killed one had not finished under another name, and starts there anew.
CARELESS = COUNTS.replace('"part"', 'f"part-{os.getpid()}.tmp"')


def job(code: str) -> jobs.Job:
    return jobs.Job(
        (sys.executable, "-c", code), (), re.compile("going on after"), lambda place: (place / "0").exists()
    )


def outcomes(code: str, kind: str, folder: Path, count: int) -> list[tuple[bool, bool, str]]:
    expected = campaign.undisturbed(job(code), folder / "undisturbed")
    return [
        campaign.one(job(code), kind, expected, folder / f"{kind}-{n}", random.Random(f"{n}")) for n in range(count)
    ]


def test_a_careful_command_passes_and_a_careless_one_does_not(tmp_path: Path):
    careful = outcomes(COUNTS, "kill", tmp_path / "careful", 6)
    assert not any(broken for _, _, broken in careful), careful
    assert any(struck for struck, _, _ in careful)
    assert any("left over: part-" in broken for _, _, broken in outcomes(CARELESS, "kill", tmp_path / "careless", 6))


def test_one_that_says_nothing_is_told(tmp_path: Path):
    found = outcomes(COUNTS.replace("if done:", "if False:"), "kill", tmp_path, 6)
    assert any(broken == "does not say that it goes on" for _, _, broken in found)


def test_a_full_disk_is_one(tmp_path: Path):
    found = outcomes(COUNTS, "full", tmp_path, 4)
    # A traceback is no message.
    assert any(struck and broken.startswith("aborts: ") for struck, _, broken in found)


def test_one_of_two_is_refused_by_the_others_name(tmp_path: Path):
    lock = "import os, sys\ntry: os.mkdir('lock')\nexcept OSError: sys.exit({!r})\n"
    for says, broken in (("process 12 (a) is at work there", ""), ("no", "refused without the other's name: no")):
        found = outcomes(lock.format(says) + COUNTS, "two", tmp_path / says, 2)
        assert [case[2] for case in found] == [broken] * 2


@pytest.mark.parametrize("group", ["", ", process_group=0"])
def test_workers_that_stay_are_killed_and_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, group: str):
    monkeypatch.setattr(trouble, "WORKERS", 0.3)
    leaves = (
        "import pathlib, subprocess, sys\n"
        f"worker = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(60)']{group})\n"
        "pathlib.Path('worker').write_text(str(worker.pid))"
    )
    assert "workers live" in trouble.alone((sys.executable, "-c", leaves), tmp_path).broken
    state = Path("/proc", (tmp_path / "worker").read_text(), "stat")
    for _ in range(100):
        if not state.exists() or ") Z " in state.read_text():
            return
        time.sleep(0.01)
    pytest.fail("the worker lives")


def test_a_job_begins_with_what_it_is_given(tmp_path: Path):
    (tmp_path / "given/out").mkdir(parents=True)
    (tmp_path / "given/out/cost").write_text("1")
    reads = replace(job("print(open('out/cost').read())"), given=tmp_path / "given")
    assert set(campaign.undisturbed(reads, tmp_path / "undisturbed").content) == {"out", "out/cost"}


def test_a_command_that_differs_from_itself_is_no_yardstick(tmp_path: Path):
    random_bytes = "import os; open('x', 'wb').write(os.urandom(8))"
    with pytest.raises(KillsError, match="two undisturbed runs differ: other bytes: x"):
        campaign.undisturbed(job(random_bytes), tmp_path)
    with pytest.raises(KillsError, match="no such sea"):
        campaign.undisturbed(job("raise SystemExit('no such sea')"), tmp_path)


def test_times_and_commands_may_differ_and_nothing_else(tmp_path: Path):
    page = b'<p>water</p><p class="note">Time: find 0.02 s, name 3 s</p>'
    assert plain("report.html", page) == plain("report.html", page.replace(b"0.02", b"0.05"))
    assert plain("report.html", page) != plain("report.html", page.replace(b"water", b"wine"))
    card = {"command": "hydro train", "card_sha256": "ab", "sizes": [1], "written": {"report.html": ["a"], "x": ["b"]}}
    same = card | {"command": "hydro train --resume", "card_sha256": "cd"}
    assert plain("card.json", json.dumps(card).encode()) == plain("card.json", json.dumps(same).encode())
    for other in ({"sizes": [2]}, {"written": {"report.html": ["a"], "x": ["c"]}}):
        assert plain("card.json", json.dumps(card).encode()) != plain("card.json", json.dumps(card | other).encode())
    row = b"| LSTM | 792 | 2.0 (1 to 3) | 5 | 57 |"
    assert plain("README.md", row) == plain("README.md", row.replace(b"| 5 | 57 |", b"| 14 | 9 |"))
    assert plain("README.md", row) != plain("README.md", row.replace(b"792", b"793"))
    result = {
        "training": {"epochs": 3, "seconds": 1.5, "threads": 1, "peak_memory_mib": 9.0},
        "rows": [{"train_seconds": 1}],
    }
    other = {
        "training": {"epochs": 3, "seconds": 2.5, "threads": 2, "peak_memory_mib": 8.0},
        "rows": [{"train_seconds": 2}],
    }
    for name, alike in (("result.json", True), ("find.json", False)):
        assert (plain(name, json.dumps(result).encode()) == plain(name, json.dumps(other).encode())) == alike
    other["training"]["epochs"] = 4
    assert plain("result.json", json.dumps(result).encode()) != plain("result.json", json.dumps(other).encode())
    for name, text in (("a", "1"), ("b", "2")):
        (tmp_path / name).write_text(text)
    before = content(tmp_path)
    (tmp_path / "a").unlink()
    (tmp_path / "b").write_text("3")
    (tmp_path / "c").symlink_to("b")
    assert differences(before, content(tmp_path)) == "missing: a; left over: c; other bytes: b"
    assert not differences(before, before)


@pytest.mark.skipif(not built_program().is_file(), reason="no `hydro` is built: cargo build")
def test_gap_says_that_it_goes_on_and_removes_what_was_not_finished(tmp_path: Path):
    bases.write_gap(tmp_path / "gap")
    flags = map(str, bases.gap_flags(tmp_path / "gap", "trials", tmp_path / "out"))
    command = [str(built_program()), "gap", "run", *flags]
    said = []
    for _ in range(2):
        done = subprocess.run(command, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        said.append(done.stderr)
        (tmp_path / "out/verify.json").unlink()
        (tmp_path / "out/.hydro-aB3xYz.part").write_text("half")
    assert "going on" not in said[0]
    assert "going on after `add` of an earlier run" in said[1]
    subprocess.run(command, check=True, capture_output=True)
    assert not list((tmp_path / "out").glob(".hydro-*"))


def test_outcomes_are_gone_on_with_and_counted(tmp_path: Path):
    path = tmp_path / "outcomes.jsonl"
    known = [campaign.Record("gen", "kill", n, 0, True, n > 0, "left over: x" if n == 2 else "") for n in range(3)]
    path.write_text("".join(json.dumps(vars(record)) + "\n" for record in known) + '{"job": "g')
    assert campaign.records(path) == known
    assert campaign.table(known).splitlines()[-1] == "| `gen` | kill | 3 | 3 | 2 | 2 | 1 |"
