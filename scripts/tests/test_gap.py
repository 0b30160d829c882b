"""`hydro gap` on the fixed hidden-effect cases: named, added, and the patched file replayed in plain MuJoCo.

The vehicle's cases run always; HYDRO_TEST_LONG=1 adds those of the leg, minutes each on a small machine.
"""

import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import barge
from hydro_tools.datasets.trial_replay import compare
from hydro_tools.repository import ROOT, SCRIPTS


def program() -> Path | None:
    """HYDRO_TEST_PROGRAM, else the newest `hydro` in target/."""
    if "HYDRO_TEST_PROGRAM" in os.environ:
        return Path(os.environ["HYDRO_TEST_PROGRAM"])
    built = [path for path in (ROOT / "target").glob("*/hydro") if path.is_file()]  # target/doc/hydro is a folder
    return max(built, key=lambda path: path.stat().st_mtime, default=None)


SYSTEMS = ("vehicle", "leg") if os.environ.get("HYDRO_TEST_LONG") else ("vehicle",)


@unittest.skipUnless(program(), "no `hydro` is built: cargo build")
class Fixed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.place = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.place.name)
        made = [sys.executable, str(SCRIPTS / "gen_hidden.py"), "--fixed", "--out", str(cls.folder)]
        made += [word for system in SYSTEMS for word in ("--system", system)]
        subprocess.run(made, check=True, capture_output=True)
        cls.answers = {}
        for answer in sorted(cls.folder.glob("sealed/*/answer.json")):
            cls.answers[answer.parent.name] = json.loads(answer.read_text())

    @classmethod
    def tearDownClass(cls):
        cls.place.cleanup()

    def verdict(self, case: str) -> tuple[Path, dict]:
        """Verdict of `hydro gap run` on a case whose answer it cannot see."""
        nominal = self.folder / "cases" / case / "nominal.xml"
        out = self.folder / "out" / case
        command = [
            str(program()),
            "gap",
            "run",
            "--model",
            str(nominal),
            "--trials",
            str(nominal.parent / "trials"),
            "--out",
            str(out),
        ]
        ran = subprocess.run(command, capture_output=True, text=True)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        return out, json.loads((out / "verdict.json").read_text())

    def one(self, system: str, effect: str | None) -> str:
        """The fixed case of a system with an effect, or its null."""
        wanted = [effect] if effect else []
        found = [
            case
            for case, answer in self.answers.items()
            if answer["system"] == system and [of["effect"] for of in answer["effects"]] == wanted
        ]
        self.assertEqual(len(found), 1, self.answers)
        return found[0]

    def assert_found(self, system: str, effect: str, part: float) -> None:
        """Named, verified, and smaller in plain MuJoCo on trials that nothing saw: to that part, noise left in."""
        case = self.one(system, effect)
        out, verdict = self.verdict(case)
        self.assertEqual((verdict["verdict"], verdict["named"]), ("named", [effect]), verdict["refused_because"])
        self.assertTrue(verdict["verified"])
        unseen = self.folder / "sealed" / case / "never_shown"
        found = compare(self.folder / "cases" / case / "nominal.xml", out, unseen, 2.0)
        self.assertLess(found["after"], part * found["before"], found)

    def test_quadratic_drag_of_a_vehicle(self):
        self.assert_found("vehicle", "quadratic_drag", 0.3)

    @unittest.skipUnless("leg" in SYSTEMS, "HYDRO_TEST_LONG=1 runs it")
    def test_friction_of_a_leg(self):
        self.assert_found("leg", "joint_friction", 0.9)

    def test_nulls_show_nothing(self):
        for system in SYSTEMS:
            with self.subTest(system):
                _, verdict = self.verdict(self.one(system, None))
                self.assertEqual(verdict["verdict"], "no_gap")
                self.assertIsNone(verdict["patch"])


@unittest.skipUnless(program(), "no `hydro` is built: cargo build")
class Afloat(unittest.TestCase):
    def test_a_boat_that_lacks_its_hydrostatics(self):
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            barge.make(folder, trials=4, duration=5.0, seed=1)
            command = [str(program()), "gap", "run", "--model", str(folder / "nominal.xml")]
            command += ["--trials", str(folder / "trials"), "--out", str(folder / "out")]
            ran = subprocess.run(command, capture_output=True, text=True)
            self.assertEqual(ran.returncode, 0, ran.stderr)
            verdict = json.loads((folder / "out/verdict.json").read_text())
            self.assertEqual((verdict["verdict"], verdict["named"]), ("named", ["hydrostatics"]))
            self.assertTrue(verdict["verified"])
            (volume,) = verdict["effects"][0]["parameters"]
            self.assertTrue(volume["ci95"][0] < 1.0 < volume["ci95"][1], volume)
            self.assertGreater(verdict["gap"]["reduction"], 0.9)
            self.assertIn("hydrostatics", (folder / "out/patched.xml").read_text())


if __name__ == "__main__":
    unittest.main()
