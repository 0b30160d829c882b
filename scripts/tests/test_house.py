"""The rules of scripts/check_house.py find what they forbid, and only that."""

from pathlib import Path

import pytest

from hydro_tools.house import rules


@pytest.fixture
def house(tmp_path: Path) -> Path:
    """Return a small workspace without a breach."""
    for name in ("gap", "training"):
        (tmp_path / f"crates/{name}/src").mkdir(parents=True)
    (tmp_path / "src/mujoco").mkdir(parents=True)
    files = {
        "src/lib.rs": "pub mod mujoco;\n",
        "src/main.rs": "fn main() {}\n",
        "src/mujoco/mod.rs": "fn free() { unsafe { f() } }\n",
        "crates/training/src/lib.rs": "",
        "crates/gap/src/lib.rs": "mod fit;\nmod select;\nmod one;\nmod two;\n",
        "crates/gap/src/fit.rs": "pub(crate) fn fit() {}\n",
        "crates/gap/src/select.rs": "use crate::fit::fit;\nfn select() { fit() }\n",
        "crates/gap/src/one.rs": "use crate::two::Two;\nstruct One(Two);\n",
        "crates/gap/src/two.rs": "pub(crate) struct Two;\n",
    }
    for path, text in files.items():
        (tmp_path / path).write_text(text)
    return tmp_path


def breaches(house: Path) -> list[str]:
    """Return the breaches of all rules."""
    return [breach for rule in rules.RULES for breach in rule(house)]


def test_a_sound_house_breaks_no_rule(house: Path):
    assert breaches(house) == []


@pytest.mark.parametrize(
    ("path", "text", "expected"),
    [
        (
            "crates/gap/src/two.rs",
            "use crate::one::One;\npub(crate) struct Two(Box<One>);\n",
            "2 files import each other",
        ),
        ("crates/gap/src/fit.rs", "pub(crate) fn fit() { crate::select::select() }\n", "must not name `select`"),
        ("crates/gap/src/two.rs", "pub(crate) struct Two;\n" + "// more\n" * 600, "601 lines, 600 at most"),
        ("crates/gap/src/two.rs", "pub(crate) struct Two;\nfn f() { unsafe { g() } }\n", "unsafe code stands only in"),
        ("crates/gap/src/two.rs", 'pub(crate) struct Two;\nfn f() { println!("x") }\n', "printing, exiting"),
        (
            "crates/gap/src/two.rs",
            'pub(crate) struct Two;\nfn f() { fs::read("x"); }\n',
            "reading a file stands only in",
        ),
        ("crates/gap/src/two.rs", 'pub(crate) struct Two;\nfn f() { File::open("x"); }\n', "`File::open(`; reading"),
    ],
)
def test_a_breach_is_found_and_named(house: Path, path: str, text: str, expected: str):
    (house / path).write_text(text)
    found = breaches(house)
    assert any(path in breach and expected in breach for breach in found), found


def test_comments_and_tests_are_free(house: Path):
    text = 'pub(crate) struct Two;\n// unsafe { } and println!\n#[cfg(test)]\nmod tests { fn f() { println!("x") } }\n'
    (house / "crates/gap/src/two.rs").write_text(text)
    assert breaches(house) == []
