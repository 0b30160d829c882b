"""The table of strip water's checkpoints: figures by hand, refusals."""

import io
import json
import math
import subprocess
import sys
import tempfile
import unittest
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from unittest import mock

from hydro_tools.commands import strip_table
from hydro_tools.repository import SCRIPTS
from hydro_tools.strip_models.results import figures


def errors(scale):
    """Six axes of the base, then two joints that must not count among them."""
    axes = [3 * scale] * 3 + [4 * scale] * 3 + [100.0, 100.0]
    nrmse = [0.1 * scale] * 6 + [9.0, 9.0]
    return {
        "mae": axes,
        "rmse": axes,
        "nrmse": nrmse,
        "nrmse_hydrodynamic": nrmse,
        "pooled": scale,
        "pooled_hydrodynamic": 1.0,
    }


def result(place, scale, reached=3.0):
    place.mkdir(parents=True)
    told = {"errors": errors(scale), "yardsticks": [{"name": "buoyancy", **errors(2.0)}]}
    (place / "open.json").write_text(json.dumps(told))
    medians = [{"median": scale * 0.1 * k} for k in (1, 2, 4)]
    ours = dict.fromkeys(("position", "attitude", "joints"), medians)
    peak = {"reached": reached, "truth": 2.0}
    swum = {
        "closed_loop": {"horizons": [1.0, 2.0, 4.0], "rows": [ours, {}]},
        "long": {"subject": dict.fromkeys(("speed", "rate", "force", "torque"), peak)},
    }
    (place / "closed.json").write_text(json.dumps(swum))


class Table(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.addCleanup(self.temporary.cleanup)
        self.jobs = Path(self.temporary.name, "jobs")

    def command(self, *flags):
        said, told = io.StringIO(), io.StringIO()
        with mock.patch.object(sys, "argv", ["strip_table.py", str(self.jobs), *flags]):
            with redirect_stdout(said), redirect_stderr(told):
                status = strip_table.main()
        self.assertLessEqual(told.getvalue().count("\n"), 3)
        return status, said.getvalue(), told.getvalue()

    def test_errors_of_the_base_leave_the_joints_out(self):
        found = figures(errors(1.0))
        self.assertAlmostEqual(found["mae"], 3.5)
        self.assertAlmostEqual(found["rmse"], 12.5**0.5)
        self.assertAlmostEqual(found["nrmse"], 0.1)
        self.assertEqual(found["all"], 1.0)

    def test_seeds_are_means_with_their_deviation_and_ten_minutes_the_worst(self):
        result(self.jobs / "lstm" / "seed-0", 1.0)
        result(self.jobs / "mlp" / "seed-0", 1.0)
        result(self.jobs / "mlp" / "seed-1", 3.0, reached=5.0)
        status, said, _ = self.command()
        self.assertEqual(status, 0)
        lines = said.splitlines()
        self.assertIn("| buoyancy |  | 7 | 7.07 | 0.2 | 0.2 | 2 |", lines)
        self.assertIn("| lstm | 1 | 3.5 | 3.54 | 0.1 | 0.1 | 1 |", lines)
        self.assertIn("| mlp | 2 | 7 ± 4.9 | 7.07 ± 5 | 0.2 ± 0.14 | 0.2 ± 0.14 | 2 ± 1.4 |", lines)
        self.assertIn("| lstm | 0.2 | 0.4 | 0.2 | 0.4 | 0.4 | 1.5, 1.5, 1.5, 1.5 |", lines)
        self.assertTrue(lines[-1].endswith("| 2.5, 2.5, 2.5, 2.5 |"), lines[-1])

    def test_a_ratio_has_an_interval_where_both_have_seeds(self):
        for row, scales in (("ours", (1.0, 1.1, 1.2)), ("lstm", (2.0, 2.2, 2.4)), ("mlp", (4.0,))):
            for seed, scale in enumerate(scales):
                result(self.jobs / row / f"seed-{seed}", scale)
        _, said, _ = self.command("--over", "ours")
        lines = said.splitlines()
        # The logarithms' standard deviation by hand: 0.09127 in both, four degrees of freedom, t = 2.7764.
        low, high = (0.5 * math.exp(sign * 2.7764 * 0.09127 * (2 / 3) ** 0.5) for sign in (-1, 1))
        interval = f"0.500 ({low:.3f} to {high:.3f})"
        self.assertIn(f"| lstm | {interval} | {interval} |", lines)
        self.assertIn("| mlp | 0.274 | 0.274 |", lines)
        self.assertNotIn("ours over", self.command()[1])

    def test_a_ratio_over_a_row_that_is_not_there(self):
        result(self.jobs / "lstm" / "seed-0", 1.0)
        status, _, told = self.command("--over", "ours")
        self.assertEqual(status, 1)
        self.assertIn("--over ours: no such row", told)
        self.assertIn("there are lstm", told)

    def test_a_run_that_blew_up_is_infinite(self):
        result(self.jobs / "cnode" / "seed-0", 1.0, reached=None)
        _, said, _ = self.command()
        self.assertIn("| inf, inf, inf, inf |", said)

    def test_nothing_there(self):
        status, _, told = self.command()
        self.assertEqual(status, 1)
        self.assertIn("no ROW/seed-N/open.json", told)

    def test_a_half_of_a_result(self):
        place = self.jobs / "mlp" / "seed-0"
        result(place, 1.0)
        (place / "closed.json").unlink()
        self.assertIn("closed.json: no such file", self.command()[2])
        (place / "closed.json").write_text("{")
        self.assertIn("closed.json: is no JSON", self.command()[2])
        (place / "closed.json").write_text('{"closed_loop": {"horizons": [], "rows": [{}]}}')
        self.assertIn("expected open.json and closed.json of `hydro evaluate`", self.command()[2])

    def test_an_unknown_row(self):
        run = subprocess.run([str(SCRIPTS / "strip_models.sh"), "tank"], capture_output=True, text=True)
        self.assertEqual(run.returncode, 2)
        self.assertIn("unknown row tank; there are mlp-ode attention-ode cnode lstm", run.stderr)

    def test_an_unknown_water_of_the_comparison(self):
        run = subprocess.run([str(SCRIPTS / "compare.sh"), "task2", "tank"], capture_output=True, text=True)
        self.assertEqual(run.returncode, 2)
        self.assertIn("unknown water tank; there are strip and ellipsoid", run.stderr)


if __name__ == "__main__":
    unittest.main()
