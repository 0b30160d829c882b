"""The rules, each a function from the repository's folder to the list of its breaches."""

import re
from pathlib import Path

from .circles import circles
from .rust import arrows, crate, without_comments, without_tests

#: Lines of a source file outside tests.
LONGEST = 600


def crates(root: Path) -> dict[str, Path]:
    """First source of every crate of the workspace, by its name in code."""
    found = {"hydro_plugin": root / "src/lib.rs", "hydro": root / "src/main.rs"}
    for folder in sorted((root / "crates").iterdir()):
        found[f"hydro_{folder.name}"] = folder / "src/lib.rs"
    for bench in sorted((root / "benches").glob("*/main.rs")):
        found[f"bench {bench.parent.name}"] = bench
    return found


def sources(root: Path) -> list[Path]:
    """Rust sources outside tests."""
    folders = [root / "src", *sorted((root / "crates").glob("*/src"))]
    files = [file for folder in folders for file in sorted(folder.rglob("*.rs"))]
    return [file for file in files if "tests" not in file.parts and file.stem != "tests"]


def no_circles(root: Path) -> list[str]:
    """No two files of a crate import each other, directly or through others."""
    breaches = []
    for name, first in crates(root).items():
        modules = crate(first, name)
        for group in circles(arrows(modules)):
            files = [str(modules[module].path.relative_to(root)) for module in group]
            breaches.append(f"{name}: {len(files)} files import each other: {', '.join(files)}")
    return breaches


def no_long_files(root: Path) -> list[str]:
    """No Rust source outside tests is longer than 600 lines."""
    lengths = {file: len(file.read_text().splitlines()) for file in sources(root)}
    return [f"{file.relative_to(root)}: {n} lines, {LONGEST} at most" for file, n in lengths.items() if n > LONGEST]


def _only(root: Path, pattern: str, allowed: tuple[str, ...], what: str) -> list[str]:
    breaches = []
    for file in sources(root):
        name = str(file.relative_to(root))
        if name.startswith(allowed):
            continue
        for found in re.findall(pattern, without_tests(without_comments(file.read_text()))):
            breaches.append(f"{name}: `{found}`; {what} stands only in {', '.join(allowed)}")
    return breaches


def unsafe_in_one_place(root: Path) -> list[str]:
    """Unsafe code stands in src/mujoco alone."""
    return _only(root, r"unsafe (?:\{|fn|impl|extern)", ("src/mujoco",), "unsafe code")


def printing_in_one_place(root: Path) -> list[str]:
    """Only the command line prints, exits and parses flags."""
    pattern = r"\be?print(?:ln)?!|process::exit|clap::|anyhow::"
    return _only(root, pattern, ("src/cli", "src/main.rs"), "printing, exiting and parsing flags")


def reading_in_one_place(root: Path) -> list[str]:
    """Files are read by `hydro-files`, which looks at kind and size first; elsewhere /proc alone is read."""
    # A folder is opened to be locked.
    allowed = (
        "crates/files",
        "src/cli/machine.rs",
        "src/mujoco/ffi/api.rs",
        "crates/model/src/checkpoint/replacement.rs",
    )
    return _only(root, r"fs::read(?:_to_string)?\(|\bFile::open\(", allowed, "reading a file")


#: What a folder of a crate must not name, by the crate's name in code: those above it.
BELOW = {
    "hydro_plugin": {"plugin": {"mujoco", "report"}, "report": {"mujoco", "plugin"}, "mujoco": {"report"}},
    "hydro_training": {
        "dataset": {"trainer", "metrics", "residual_model", "comparison", "experiment"},
        "trainer": {"residual_model", "comparison", "experiment"},
        "comparison": {"experiment"},
    },
    "hydro_gap": {
        "trial": {"plant", "patch", "problem", "rollout", "fit", "discrepancy", "select", "stage", "residual"},
        "plant": {"patch", "problem", "rollout", "fit", "discrepancy", "select", "stage", "residual"},
        "patch": {"problem", "rollout", "fit", "discrepancy", "select", "stage", "residual"},
        "problem": {"rollout", "fit", "discrepancy", "select", "stage", "residual"},
        "rollout": {"fit", "discrepancy", "select", "stage", "residual"},
        "fit": {"discrepancy", "select", "stage", "residual"},
        "discrepancy": {"select", "stage", "residual"},
        "select": {"stage", "residual"},
    },
}


def data_flows_one_way(root: Path) -> list[str]:
    """No folder of a crate names one above it (ARCHITECTURE.md)."""
    breaches = []
    firsts = crates(root)
    for name, above in BELOW.items():
        modules = crate(firsts[name], name)
        for module, targets in arrows(modules).items():
            for target in sorted(targets):
                if module and target and target[0] in above.get(module[0], ()):
                    file = modules[module].path.relative_to(root)
                    breaches.append(f"{file}: `{module[0]}` must not name `{'::'.join(target)}`")
    return breaches


RULES = (
    no_circles,
    data_flows_one_way,
    no_long_files,
    unsafe_in_one_place,
    printing_in_one_place,
    reading_in_one_place,
)
