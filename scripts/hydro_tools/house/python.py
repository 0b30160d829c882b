"""Modules of a Python package and which imports which."""

import ast
from pathlib import Path


def python_arrows(folder: Path, package: str) -> dict[str, set[str]]:
    """Which module of `folder/package` imports which other, by dotted name; imports inside functions count too."""
    files = {}
    for file in sorted((folder / package).rglob("*.py")):
        parts = file.relative_to(folder).with_suffix("").parts
        files[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
    out: dict[str, set[str]] = {}
    for name, file in files.items():
        named: set[str] = set()
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.Import):
                named |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                base = node.module or ""
                if node.level:
                    # A package's own module sits one level below its name.
                    here = name.split(".") if file.stem == "__init__" else name.split(".")[:-1]
                    here = here[: len(here) - node.level + 1]
                    base = ".".join([*here, base] if base else here)
                # `from package import module` names the module, not the package.
                named |= {f"{base}.{a.name}" if f"{base}.{a.name}" in files else base for a in node.names}
        out[name] = {target for target in named if target in files and target != name}
    return out
