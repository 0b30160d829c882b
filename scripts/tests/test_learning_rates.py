"""The search for a learning rate, on errors that are known, and what it makes of failed trainings."""

import math
import tempfile
import textwrap
import unittest
from pathlib import Path

from hydro_tools.learning_rates import TrainingError
from hydro_tools.learning_rates.search import search
from hydro_tools.learning_rates.table import table
from hydro_tools.learning_rates.trainings import Trainings


def told(errors):
    """Errors by rate, of seed 1 where they differ, and what was asked."""
    asked = []

    def error(rate, seed):
        asked.append((rate, seed))
        at = errors[rate]
        return at[seed] if isinstance(at, tuple) else at

    return error, asked


class Search(unittest.TestCase):
    def test_it_finds_the_dip_from_either_side(self):
        dip = {0.001 * 2.0**k: 0.1 * (1 + abs(k - 3)) for k in range(-12, 12)}
        for first in (0.001, 0.064):
            error, asked = told(dip)
            self.assertEqual(search(error, first), 0.008)
            self.assertEqual(len(asked), len(set(asked)))
            tried = {rate for rate, _ in asked}
            self.assertTrue({0.004, 0.016} <= tried, "a neighbour on either side")

    def test_what_diverges_ends_the_way_up_and_never_wins(self):
        error, _ = told({0.002: 0.3, 0.004: 0.2, 0.008: math.inf, 0.001: 0.4})
        self.assertEqual(search(error, 0.002), 0.004)

    def test_from_where_everything_diverges_it_goes_down(self):
        error, _ = told({0.004: math.inf, 0.002: math.inf, 0.001: math.inf, 0.0005: 0.3, 0.00025: 0.5})
        self.assertEqual(search(error, 0.002), 0.0005)
        error, _ = told({0.002 * 2.0**k: math.inf for k in range(-30, 3)})
        with self.assertRaises(TrainingError):
            search(error, 0.002)

    def test_a_lucky_seed_is_seen_through(self):
        error, asked = told({0.004: 0.08, 0.008: 0.07, 0.016: (0.053, 0.055), 0.032: (0.051, 0.13), 0.064: 0.2})
        self.assertEqual(search(error, 0.008), 0.016)
        self.assertEqual(sorted(rate for rate, seed in asked if seed == 1), [0.016, 0.032])

    def test_a_plain_is_not_walked(self):
        error, asked = told({0.001 * 2.0**k: 0.2600 - 0.0001 * k for k in range(-3, 4)})
        search(error, 0.001)
        self.assertLessEqual({rate for rate, _ in asked}, {0.0005, 0.001, 0.002})


class Programs(unittest.TestCase):
    """A program in place of `hydro`."""

    def trainings(self, does):
        folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        program = folder / "hydro"
        program.write_text("#!/usr/bin/env python3\nimport json, pathlib, sys\n" + textwrap.dedent(does))
        program.chmod(0o755)
        return Trainings(program, "task2", folder, folder / "out")

    def test_a_result_is_read_and_a_training_asked_for_once(self):
        trainings = self.trainings("""
            at = dict(zip(sys.argv[1:], sys.argv[2:]))
            job = pathlib.Path(at["--out"]) / "jobs" / at["--only"]
            job.mkdir(parents=True)
            (job / "result.json").write_text(json.dumps({"training": {"validation": float(at["--learning-rate"]) * 100}}))
        """)
        for _ in range(2):
            self.assertAlmostEqual(trainings.error("2", "lstm", 0.004, 1), 0.4)

    def test_divergence_is_a_finding_and_anything_else_a_failure(self):
        trainings = self.trainings('print("hydro: NaN at epoch 1", file=sys.stderr); sys.exit(3)')
        self.assertEqual(trainings.error("2", "lstm", 0.004, 0), math.inf)
        # A failure is no divergence, whatever its words.
        for words in ("no data set", "the loss is written to a full disk"):
            trainings = self.trainings(f'sys.exit("hydro: {words}")')
            with self.subTest(words), self.assertRaisesRegex(TrainingError, f"2/lstm/seed-0 at 0.004: hydro: {words}"):
                trainings.error("2", "lstm", 0.004, 0)

    def test_the_table_has_both_seeds_and_the_choice(self):
        found = {
            ("2", "lstm", 0.002, 0): 0.3,
            ("2", "lstm", 0.004, 0): 0.2,
            ("2", "lstm", 0.004, 1): 0.25,
            ("2", "lstm", 0.008, 0): math.inf,
        }
        lines = table("2", {"lstm": 0.004}, found).splitlines()
        self.assertIn("| | 0.002 | 0.004 | 0.008 |", lines)
        self.assertIn("| lstm | 0.300 | **0.200, 0.250** | diverged |", lines)


if __name__ == "__main__":
    unittest.main()
