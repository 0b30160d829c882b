"""Notebooks: scripts of jupytext, executed, as pages of Markdown with their outputs."""

import re
from pathlib import Path

from hydro_mujoco.errors import DataError

#: Seconds that a cell may take.
LONGEST = 300
#: Folder of the notebooks below the pages.
FOLDER = Path("docs", "notebooks")
#: A link to a script.
_LINK = re.compile(r"\]\((?P<folder>(?:[^)\s#:]*/)?)(?P<name>\w+)\.py\b")


def make_pages(pages: Path, execute: bool) -> None:
    """Replace the notebooks below `pages` by Markdown, and links to them by links to that.

    execute: run them; else the code alone is shown.

    Raises:
        DataError: a cell fails; the message holds it.
    """
    sources = sorted((pages / FOLDER).glob("*.py"))
    names = {source.stem for source in sources}
    for source in sources:
        _make_page(source, execute)
        source.unlink()
    for page in pages.rglob("*.md"):
        text = relinked(page.read_text(encoding="utf-8"), names, inside=page.parent == pages / FOLDER)
        page.write_text(text, encoding="utf-8")


def relinked(text: str, names: set[str], inside: bool) -> str:
    """A page whose links to notebooks of these names, NAME.py, lead to NAME.md.

    inside: the page is a notebook itself.
    """

    def moved(found: re.Match) -> str:
        known = found["name"] in names and (inside or found["folder"].endswith(f"{FOLDER.name}/"))
        return f"]({found['folder']}{found['name']}.md" if known else found[0]

    return _LINK.sub(moved, text)


def _make_page(source: Path, execute: bool) -> None:
    # In the environment of the documentation alone.
    import jupytext
    from nbclient.exceptions import CellExecutionError
    from nbconvert import MarkdownExporter
    from nbconvert.preprocessors import ExecutePreprocessor

    notebook = jupytext.read(source)
    if execute:
        # Errors alone are logged.
        quiet = ["--IPKernelApp.log_level=40"]
        run = ExecutePreprocessor(timeout=LONGEST, kernel_name="python3", extra_arguments=quiet)
        try:
            run.preprocess(notebook, {"metadata": {"path": str(source.parent)}})
        except CellExecutionError as error:
            raise DataError(f"{FOLDER / source.name}: {error}") from error
    resources = {"unique_key": source.stem, "output_files_dir": f"{source.stem}_files"}
    text, made = MarkdownExporter().from_notebook_node(notebook, resources=resources)
    for name, content in made["outputs"].items():
        place = source.parent / name
        place.parent.mkdir(exist_ok=True)
        place.write_bytes(content)
    source.with_suffix(".md").write_text(text, encoding="utf-8")
