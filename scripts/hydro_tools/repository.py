"""The folder that holds Cargo.toml, mjcf/, models/ and scripts/."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
