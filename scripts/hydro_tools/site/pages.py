"""Pages of the site: README.md, docs/, and all that they link, in the folders of the repository.

Links between files then hold on the site as they do in the repository; MkDocs checks them.
"""

import os
import re
import shutil
import subprocess
from pathlib import Path

from hydro_mujoco.errors import DataError

#: Where reading starts.
INDEX = "README.md"
DOCS = "docs/"
#: Targets of links and pictures, up to the anchor.
_LINK = re.compile(r"\]\(([^)\s#]+)[^)]*\)")


def linked(root: Path) -> list[str]:
    """Paths, relative to `root`, of all pages and what they link, sorted.

    Raises:
        DataError: a page links what is not in the repository.
    """
    tracked = _tracked(root)
    waiting = [INDEX, *(path for path in tracked if path.startswith(DOCS))]
    found: set[str] = set()
    while waiting:
        path = waiting.pop()
        if path in found:
            continue
        found.add(path)
        if not path.endswith((".md", ".py")) or (path.endswith(".py") and not path.startswith(DOCS)):
            continue
        for target in _LINK.findall((root / path).read_text(encoding="utf-8")):
            if re.match(r"[a-z]+:", target):
                continue
            file = os.path.normpath(os.path.join(os.path.dirname(path), target))
            if file not in tracked:
                raise DataError(f"{path} links `{target}`: no file of the repository is called {file}")
            waiting.append(file)
    return sorted(found)


def stage(root: Path, to: Path) -> int:
    """Copy `linked` files to an empty folder; returns how many."""
    files = linked(root)
    for path in files:
        place = to / path
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(root / path, place)
    return len(files)


def _tracked(root: Path) -> set[str]:
    """Files that git knows or does not ignore, and that are there."""
    command = ["git", "-C", str(root), "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise DataError(f"{root}: {done.stderr.strip()}; the site is built from a checkout")
    return {path for path in done.stdout.split("\0") if path and (root / path).is_file()}
