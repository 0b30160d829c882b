"""Check the rules of the house that no compiler checks; part of scripts/check.sh.

    python scripts/check_house.py

No import circle among the files of a crate, folders name only those below them, no source over 600
lines outside tests, unsafe code in src/mujoco alone, printing in src/cli alone, files read
by crates/files alone. Exits with 1 and one line a breach.
Needs Python's standard library alone.
"""

from hydro_tools.house.rules import RULES
from hydro_tools.repository import ROOT


def main() -> int:
    """Check every rule; returns the exit status."""
    breaches = [line for rule in RULES for line in rule(ROOT)]
    print("\n".join(breaches) if breaches else f"{len(RULES)} rules hold")
    return int(bool(breaches))
