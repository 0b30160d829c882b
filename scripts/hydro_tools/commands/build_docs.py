"""Builds the documentation site, its notebooks executed, every link inside it checked.

    .venv-docs/bin/python scripts/build_docs.py [--out out/site] [--no-notebooks] [--external]

`scripts/setup_venv.sh docs` makes the environment. What MkDocs warns of is an error: a link, a picture or an anchor
that is not there, a notebook that fails. Links to other sites are fetched with --external: a page that is gone (404,
410) is an error, one that does not answer is listed, and without a network that is said. To look:
`python -m http.server -d out/site`.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from hydro_mujoco.errors import DataError

from ..repository import ROOT
from ..site import external
from ..site.notebooks import make_pages
from ..site.pages import linked, stage

SITE = Path(__file__).parents[1] / "site"
#: What every site has, by which one that is there is known.
MARK = Path("search", "search_index.json")


def build(out: Path, notebooks: bool) -> int:
    """Build beside a folder and put the site in its place; returns the exit status of MkDocs.

    Raises:
        DataError: the folder holds something else than a site, a page links what is not there, a notebook fails.
    """
    if out.exists() and not (out / MARK).is_file() and (not out.is_dir() or any(out.iterdir())):
        raise DataError(f"{out} is there and holds no site; name another folder by --out")
    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="hydro-site-", dir=out.parent) as folder:
        pages, site = Path(folder, "pages"), Path(folder, "site")
        stage(ROOT, pages)
        make_pages(pages, notebooks)
        shutil.copy(SITE / "site.css", pages)
        environment = {**os.environ, "HYDRO_SITE_PAGES": str(pages), "NO_MKDOCS_2_WARNING": "1"}
        # Not --quiet: warnings that are not printed do not count.
        command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--config-file", str(SITE / "mkdocs.yml")]
        done = subprocess.run(
            [*command, "--site-dir", str(site)], env=environment, capture_output=True, text=True, check=False
        )
        if done.returncode:
            print(done.stderr.replace(f"{pages}/", ""), file=sys.stderr)
            return done.returncode
        if out.exists():
            shutil.rmtree(out)
        site.rename(out)
    return 0


def main(arguments: list[str] | None = None) -> int:
    """Build the site; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "site", help="folder of the site; it is replaced")
    parser.add_argument("--no-notebooks", action="store_true", help="do not run the notebooks")
    parser.add_argument("--external", action="store_true", help="fetch the links to other sites too")
    args = parser.parse_args(arguments)
    try:
        status = build(args.out.resolve(), not args.no_notebooks)
    except DataError as error:
        print(f"build_docs.py: {error}", file=sys.stderr)
        return 1
    if status == 0:
        print(f"{args.out / 'index.html'}: {sum(1 for _ in args.out.rglob('*.html'))} pages")
    if status == 0 and args.external:
        found = external.check(external.external(ROOT, linked(ROOT)))
        print(found)
        status = int(bool(found.gone))
    return status
