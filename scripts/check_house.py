#!/usr/bin/env python3
"""Check the rules of the house that no compiler checks; part of scripts/check.sh.

    python scripts/check_house.py

No import circle among the files of a crate or the Python tools, no source over 600 lines outside tests, unsafe code in
src/mujoco alone, printing in src/cli alone. Exits with 1 and one line a breach. Needs Python's standard library alone.
"""

import sys
from pathlib import Path

from hydro_tools.house.rules import RULES

ROOT = Path(__file__).resolve().parent.parent

if __name__ == "__main__":
    breaches = [line for rule in RULES for line in rule(ROOT)]
    print("\n".join(breaches) if breaches else f"{len(RULES)} rules hold")
    sys.exit(bool(breaches))
