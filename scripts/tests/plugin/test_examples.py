"""The examples in examples/water: each runs from another folder, and says what it should."""

import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from scene import LIBRARY

EXAMPLES = Path(__file__).resolve().parents[3] / "examples" / "water"


class Examples(unittest.TestCase):
    def run_example(self, name, picture):
        """Numbers that an example prints; it leaves its picture in the folder that it is given."""
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run(
                [sys.executable, str(EXAMPLES / f"{name}.py"), folder],
                capture_output=True,
                text=True,
                cwd=folder,
                env={**os.environ, "HYDRO_LIBRARY": LIBRARY},
            )
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertTrue(Path(folder, picture).stat().st_size > 2000)
        return [float(number) for number in re.findall(r"[-+]?[0-9]+[.]?[0-9]*", done.stdout)]

    def test_a_boat_follows_the_swell_and_is_driven_ashore(self):
        draught, roll, *sea = self.run_example("boat", "boat.png")
        follow, _, drift, current, heave, height, along, aground = sea
        # By hydrostatics alone 0.2487 m and, at small angles, 0.870 s: test_stability.py.
        self.assertAlmostEqual(draught, 0.2487, delta=0.0006)
        self.assertAlmostEqual(roll, 0.870, delta=0.015)
        self.assertAlmostEqual(follow, 1.0, delta=0.05)
        self.assertAlmostEqual(drift, current, delta=0.03)
        self.assertAlmostEqual(heave, height, delta=0.05)
        self.assertLess(along, 0.5)
        self.assertTrue(40 < aground < 70)

    def test_an_rov_keeps_its_station_and_floats(self):
        station, *_, above, archimedes = self.run_example("rov", "rov.png")
        self.assertLess(station, 0.12)
        self.assertAlmostEqual(above, archimedes, delta=0.002)

    def test_an_rov_comes_up_and_a_boat_rolls_freely(self):
        start, afloat, heel, other, last, seconds = self.run_example("afloat", "afloat.webp")
        # By Archimedes 0.134 m: 0.137 m under the top of its box, of which 1 % is out.
        self.assertAlmostEqual(afloat, -0.134, delta=0.01)
        self.assertTrue(start <= -1 and heel == 18 and -18.5 < other < -15)
        self.assertTrue(4 < last < 10 and seconds == 7)

    def test_the_boat_follows_the_drawn_sea(self):
        vertices, components, *_, lowest, highest = self.run_example("sea", "sea.webp")
        self.assertEqual((vertices, components), (257 * 257, 200))
        self.assertTrue(0 < lowest < highest < 0.2)

    def test_a_survey_by_dvl_usbl_and_pressure(self):
        run, reckoned, fixes, positioned, bias, scatter = self.run_example("survey", "survey.png")
        self.assertTrue(30 < run < 40)
        self.assertLess(reckoned, 0.01 * run)
        self.assertTrue(25 <= fixes <= 31)
        self.assertLess(positioned, 0.3)
        self.assertLess(abs(bias), 40)
        self.assertLess(scatter, 10)

    def test_a_fish_swims_and_keeps_its_depth(self):
        speed, _, depth = self.run_example("fish", "fish.png")
        self.assertGreater(speed, 0.15)
        self.assertLess(abs(depth), 0.01)


if __name__ == "__main__":
    unittest.main()
