"""Curves of trainings: what is read of a log, what is refused, what is written."""

import csv
import io
import json
import sys
import tempfile
import unittest
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from unittest import mock

from hydro_tools.commands import training_curves
from hydro_tools.learning_curves.curve import Curve


def run(folder, name, errors, **changed):
    place = Path(folder, f"{name}.run")
    place.mkdir()
    rows = [
        {"epoch": k, "step": 200 * (k + 1), "loss": 0.5, "learning_rate": 1e-3, "validation": error}
        | {"validation_hydrodynamic": 2 * error, "best": error}
        | changed
        for k, error in enumerate(errors)
    ]
    (place / "log.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
    return place


class Curves(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.addCleanup(self.temporary.cleanup)
        self.folder = self.temporary.name

    def command(self, *runs):
        out = Path(self.folder, "made", "curves")
        words = ["training_curves.py", *map(str, runs), "--out", str(out)]
        said, told = io.StringIO(), io.StringIO()
        with mock.patch.object(sys, "argv", words), redirect_stdout(said), redirect_stderr(told):
            status = training_curves.main()
        return status, said.getvalue(), told.getvalue(), out

    def refused(self, *runs):
        status, _, told, out = self.command(*runs)
        self.assertEqual(status, 1)
        self.assertLessEqual(told.count("\n"), 3, told)
        self.assertFalse(out.parent.exists())
        return told

    def test_table_and_files_hold_every_pass(self):
        runs = [run(self.folder, "ours", [0.4, 0.3, 0.25, 0.2]), run(self.folder, "lstm", [0.5])]
        status, said, _, out = self.command(*runs)
        self.assertEqual(status, 0)
        self.assertIn("| ours | 4 | 0.2000 | 20.0 % |", said)
        self.assertIn("| lstm | 1 | 0.5000 | 0.0 % |", said)
        with open(f"{out}.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual([(row["run"], row["epoch"], row["validation"]) for row in rows[3:]], [
            ("ours", "3", "0.2"), ("lstm", "0", "0.5"),
        ])  # fmt: skip
        figure = Path(f"{out}.svg").read_text()
        for word in ("ours", "lstm", "validation nRMSE"):
            self.assertIn(word, figure)
        first = Path(f"{out}.svg").read_bytes()
        self.command(*runs)
        self.assertEqual(Path(f"{out}.svg").read_bytes(), first)

    def test_trainings_of_compare_are_named_by_row_and_seed(self):
        for seed in (0, 1):
            place = Path(self.folder, "jobs", "2", "lstm", f"seed-{seed}")
            place.mkdir(parents=True)
            run(self.folder, f"of-{seed}", [0.5]).rename(place / "run")
        status, said, _, _ = self.command(*sorted(Path(self.folder).glob("jobs/2/lstm/*/run")))
        self.assertEqual(status, 0)
        self.assertIn("| lstm/seed-1 | 1 |", said)

    def test_what_the_last_quarter_gained(self):
        def gained(*errors):
            return Curve("a", [{"validation": error} for error in errors]).gained

        self.assertAlmostEqual(gained(0.8, 0.4, 0.4, 0.4, 0.4, 0.4, 0.3, 0.35), 0.25)
        self.assertEqual(gained(0.4, 0.3, 0.2, 0.25), 0.0)

    def test_a_folder_without_a_log(self):
        place = Path(self.folder, "empty.run")
        place.mkdir()
        self.assertIn("no log.jsonl; expected the folder NAME.run", self.refused(place))
        (place / "log.jsonl").write_text("")
        self.assertIn("no pass of this training is done yet", self.refused(place))

    def test_a_line_that_is_no_record(self):
        place = run(self.folder, "bad", [0.4, 0.3])
        with open(place / "log.jsonl", "a") as file:
            file.write('{"epoch": 2}\n')
        self.assertIn("line 3: 'step'; expected an object with epoch", self.refused(place))
        self.assertIn(
            "line 1: no validation error: the val split was empty",
            self.refused(run(self.folder, "blind", [0.4], validation=None)),
        )
        self.assertIn("expected finite numbers", self.refused(run(self.folder, "lost", [0.4], loss=float("nan"))))

    def test_one_name_twice(self):
        first, second = Path(self.folder, "a"), Path(self.folder, "b")
        first.mkdir(), second.mkdir()
        told = self.refused(run(first, "same", [0.4]), run(second, "same", [0.3]))
        self.assertIn("same: given twice", told)
