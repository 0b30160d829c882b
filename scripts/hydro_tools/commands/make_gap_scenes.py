"""Writes mjcf/gap/b1_tow.xml and mjcf/gap/b1_swim.xml from mjcf/b1_tow.xml and mjcf/b1_swim.xml.

    python scripts/make_gap_scenes.py [--check]

What is only for the eye goes; every sensor gets its `noise`; the towing scene keeps MuJoCo's own force and
torque sensors, under the names of the load cell.
"""

import argparse
import sys

from hydro_tools.repository import ROOT
from hydro_tools.robot.gap_scenes import swim, text, tow


def main() -> int:
    """Write, or compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="only say whether the files are up to date")
    args = parser.parse_args()
    stale = 0
    for name, make in (("b1_tow.xml", tow), ("b1_swim.xml", swim)):
        path = ROOT / "mjcf" / "gap" / name
        content = text(make())
        if args.check:
            if not path.is_file() or path.read_text() != content:
                print(f"{path.relative_to(ROOT)} is not what scripts/make_gap_scenes.py writes", file=sys.stderr)
                stale = 1
        else:
            path.write_text(content)
    return stale
