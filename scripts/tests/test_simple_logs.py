"""Logs of simple marine experiments: `hydro gap` names what their nominals lack, with its values."""

import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from hydro_tools.repository import ROOT

if "HYDRO_TEST_PROGRAM" in os.environ:
    PROGRAM = Path(os.environ["HYDRO_TEST_PROGRAM"])
else:
    PROGRAM = ROOT / "target" / "release" / "hydro"


class SimpleLogs(unittest.TestCase):
    @unittest.skipUnless(os.environ.get("HYDRO_TEST_LONG"), "a quarter of a minute: HYDRO_TEST_LONG=1")
    def test_a_vehicles_heave_by_its_depth_alone(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            made = [sys.executable, ROOT / "scripts" / "gen_logs.py", "--out", folder, "--experiment", "heave"]
            subprocess.run(made, check=True, capture_output=True)
            case, out = Path(folder) / "heave", Path(folder) / "gap"
            words = ["--model", case / "nominal.xml", "--trials", case / "trials", "--out", out, "--medium", "water"]
            run = subprocess.run([PROGRAM, "gap", "run", *words], capture_output=True, text=True)
            self.assertEqual(run.returncode, 0, run.stderr)
            verdict = json.loads((out / "verdict.json").read_text())
            truth = json.loads((case / "truth.json").read_text())
            self.assertEqual({of.split(".")[0] for of in truth}, set(verdict["named"]))
            values = {
                f"{of['effect']}.{parameter['name']}": parameter
                for of in verdict["effects"]
                for parameter in of["parameters"]
            }
            for name, value in truth.items():
                low, high = values[name]["ci95"]
                self.assertLess(low, value, name)
                self.assertLess(value, high, name)
                self.assertLess(abs(values[name]["value"] / value - 1), 0.1, name)


if __name__ == "__main__":
    unittest.main()
