"""Folders of the repository."""

from pathlib import Path

#: Holds Cargo.toml, mjcf/, models/ and scripts/.
ROOT = Path(__file__).resolve().parents[2]
#: Holds the commands and this package.
SCRIPTS = ROOT / "scripts"
