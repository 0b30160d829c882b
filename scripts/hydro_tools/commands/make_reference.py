"""Writes docs/reference-*.md: effects and attributes from the program's lists, environments from their docstrings.

    python scripts/make_reference.py [--check] [--program target/release/hydro]

With --check nothing is written; the exit status is 1 where a page differs.
"""

import argparse
import sys
from pathlib import Path

from hydro_mujoco.errors import DataError
from hydro_mujoco.recording.files import write_beside

from ..reference import attributes, effects, environments
from ..reference.lists import read_list
from ..repository import ROOT


def pages(program: Path) -> dict[Path, str]:
    """Path of each page -> its text."""
    return {
        ROOT / "docs" / "reference-effects.md": effects.page(read_list(program, ("gap", "effects"))),
        ROOT / "docs" / "reference-attributes.md": attributes.page(read_list(program, ("attributes",))),
        ROOT / "docs" / "reference-envs.md": environments.page(),
    }


def built_program() -> Path:
    """The newest `hydro` that cargo has built in this checkout; it may not exist."""
    built = [path for path in ROOT.glob("target/*/hydro") if path.is_file()]  # target/doc/hydro is a folder
    return max(built, key=lambda path: path.stat().st_mtime, default=ROOT / "target" / "release" / "hydro")


def main(arguments: list[str] | None = None) -> int:
    """Write or check the pages; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing; fail where a page differs")
    parser.add_argument("--program", type=Path, help="the program hydro; the newest in target/ by default")
    args = parser.parse_args(arguments)
    try:
        made = pages(args.program or built_program())
    except DataError as error:
        print(f"make_reference.py: {error}", file=sys.stderr)
        return 1
    stale = [path for path, text in made.items() if not path.is_file() or path.read_text(encoding="utf-8") != text]
    for path in stale:
        if args.check:
            print(f"{path.relative_to(ROOT)} is not what the program says: python scripts/make_reference.py")
        else:
            write_beside(path, made[path].encode())
            print(f"wrote {path.relative_to(ROOT)}")
    return int(args.check and bool(stale))
