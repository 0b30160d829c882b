"""Pages of the site: what is linked comes along, what is not there is refused."""

import subprocess

import pytest

from hydro_mujoco.errors import DataError
from hydro_tools.commands import build_docs
from hydro_tools.repository import ROOT
from hydro_tools.site.notebooks import make_pages, relinked
from hydro_tools.site.pages import linked, stage


@pytest.fixture
def project(tmp_path):
    """A repository of a few pages."""
    root = tmp_path / "project"
    files = {
        "README.md": "[docs](docs/a.md#part) ![picture](p.png) [far](https://example.org/none.md) [here](#part)",
        "docs/a.md": '[up](../models/README.md "title") [script](../run.py)',
        "docs/b.py": "# %% [markdown]\n# [a](a.md)\n",
        "models/README.md": "[back](../README.md)",
        "run.py": "'[not a link](none.md)'",
        "p.png": "",
        "unlinked.md": "",
        "ignored.md": "",
        ".gitignore": "ignored.md\n",
    }
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    subprocess.run(["git", "init", "-q", root], check=True)
    return root


def test_what_is_linked_comes_along_and_nothing_else(project, tmp_path):
    expected = ["README.md", "docs/a.md", "docs/b.py", "models/README.md", "p.png", "run.py"]
    assert linked(project) == expected
    assert stage(project, tmp_path / "pages") == 6
    pages = sorted(str(path.relative_to(tmp_path / "pages")) for path in (tmp_path / "pages").rglob("*.*"))
    assert pages == expected


@pytest.mark.parametrize("target", ["lost.md", "../ignored.md", "../models", "/README.md", "../../x.md"])
def test_a_link_to_nothing_is_refused(project, target):
    (project / "docs" / "a.md").write_text(f"[x]({target})")
    with pytest.raises(DataError, match=f"docs/a.md links `{target}`: no file of the repository is called"):
        linked(project)


def test_outside_a_checkout_it_is_said(tmp_path):
    (tmp_path / "README.md").write_text("")
    with pytest.raises(DataError, match="the site is built from a checkout"):
        linked(tmp_path)


def test_the_pages_of_this_repository_link_what_is_there():
    found = linked(ROOT)
    assert {"README.md", "docs/plugin.md", "docs/notebooks/water.py", "models/README.md"} < set(found)


@pytest.mark.parametrize(
    ("link", "inside", "expected"),
    [
        ("[x](notebooks/water.py)", False, "[x](notebooks/water.md)"),
        ("[x](../docs/notebooks/water.py#top)", False, "[x](../docs/notebooks/water.md#top)"),
        ("[x](water.py)", True, "[x](water.md)"),
        ("[x](water.py)", False, "[x](water.py)"),
        ("[x](../run/water.py)", False, "[x](../run/water.py)"),
        ("[x](notebooks/other.py)", False, "[x](notebooks/other.py)"),
        ("[x](https://a.b/notebooks/water.py)", False, "[x](https://a.b/notebooks/water.py)"),
        ("`water.py`", True, "`water.py`"),
    ],
)
def test_links_to_notebooks_follow_them(link, inside, expected):
    assert relinked(link, {"water"}, inside) == expected


def test_a_notebook_becomes_a_page_and_one_that_fails_is_refused(tmp_path):
    pytest.importorskip("nbconvert")
    pytest.importorskip("jupytext")
    folder = tmp_path / "docs" / "notebooks"
    folder.mkdir(parents=True)
    script = folder / "sum.py"
    script.write_text("# %% [markdown]\n# # A sum\n\n# %%\nprint(1 + 1)\n")
    make_pages(tmp_path, execute=True)
    page = (folder / "sum.md").read_text()
    assert "# A sum" in page and "    2\n" in page
    assert not script.exists()
    script.write_text("# %%\nraise RuntimeError('lost')\n")
    with pytest.raises(DataError, match="(?s)docs/notebooks/sum.py: .*lost"):
        make_pages(tmp_path, execute=True)


def test_a_folder_that_holds_something_else_is_left_alone(tmp_path, capsys):
    (tmp_path / "thesis.tex").write_text("x")
    assert build_docs.main(["--out", str(tmp_path)]) == 1
    assert "is there and holds no site; name another folder by --out" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_every_page_of_docs_is_in_the_navigation():
    navigation = (ROOT / "scripts/hydro_tools/site/mkdocs.yml").read_text()
    pages = [path for path in linked(ROOT) if path.startswith("docs/") and path.endswith(".md")]
    assert len(pages) > 20
    assert [page for page in [*pages, "SECURITY.md"] if page not in navigation] == []
