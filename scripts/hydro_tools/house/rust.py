"""Modules of a Rust crate and which names which, read from its sources.

A name is followed through `use` and `pub use` to the file that defines it, so a file that takes a name from its
parent's re-exports depends on the defining file and not on the parent.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path

#: A `use` statement: visibility, tree.
USE = re.compile(r"^\s*(pub(?:\([^)]*\))?\s+)?use\s+([^;]+);", re.M)
#: A path in code, at least two segments.
PATH = re.compile(r"(?<![\w:])((?:crate|super|self|[a-z_]\w*)(?:::\w+)+)")
#: An item that a file defines.
ITEM = re.compile(
    r"^\s*(?:pub(?:\([^)]*\))?\s+)?(?:unsafe\s+|const\s+|async\s+|extern\s+\"C\"\s+)*"
    r"(?:fn|struct|enum|trait|type|const|static|union|macro_rules!)\s+(\w+)",
    re.M,
)
MODULE = re.compile(r"^\s*(?:pub(?:\([^)]*\))?\s+)?mod\s+(\w+)\s*;", re.M)


@dataclass
class Module:
    """A file of a crate."""

    path: Path
    name: tuple[str, ...]
    children: dict[str, tuple[str, ...]] = field(default_factory=dict)
    #: Names that a `use` brings in: name -> path as written.
    imported: dict[str, list[str]] = field(default_factory=dict)
    #: Imports that are not re-exports.
    private: list[list[str]] = field(default_factory=list)
    globs: list[list[str]] = field(default_factory=list)
    defined: set[str] = field(default_factory=set)
    code: str = ""


def without_comments(text: str) -> str:
    """Source without comments, character literals and the contents of strings."""
    text = re.sub(r"//[^\n]*", "", text)
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.S)
    return re.sub(r'"(?:[^"\\]|\\.)*"', '""', text, flags=re.S)


def without_tests(code: str) -> str:
    """Source without modules and items under `#[cfg(test)]`."""
    out, at = [], 0
    for mark in re.finditer(r"#\[cfg\((?:test|all\(test\b[^\]]*)\)\]", code):
        if mark.start() < at:
            continue
        out.append(code[at : mark.start()])
        brace, end = code.find("{", mark.end()), code.find(";", mark.end())
        if brace < 0 or 0 <= end < brace:
            at = end + 1
            continue
        depth, at = 1, brace + 1
        while depth and at < len(code):
            depth += {"{": 1, "}": -1}.get(code[at], 0)
            at += 1
    out.append(code[at:])
    return "".join(out)


def leaves(tree: str) -> list[tuple[list[str], str | None]]:
    """Paths of a `use` tree, each with its alias."""
    tree = tree.strip()
    brace = tree.find("{")
    if brace < 0:
        path, _, alias = tree.partition(" as ")
        return [([part.strip() for part in path.strip().lstrip(":").split("::")], alias.strip() or None)]
    head = [part.strip() for part in tree[:brace].strip().rstrip(":").split("::") if part.strip()]
    parts, depth, start = [], 0, brace + 1
    for at in range(brace + 1, tree.rindex("}") + 1):
        if (tree[at] == "," and depth == 0) or at == tree.rindex("}"):
            parts.append(tree[start:at])
            start = at + 1
        depth += {"{": 1, "}": -1}.get(tree[at], 0)
    return [(head + path, alias) for part in parts if part.strip() for path, alias in leaves(part)]


def crate(root: Path, name: str) -> dict[tuple[str, ...], Module]:
    """Modules of the crate whose first file is `root`, by their path in it."""
    found: dict[tuple[str, ...], Module] = {}

    def read(path: Path, module: tuple[str, ...]) -> None:
        text = path.read_text()
        code = without_tests(without_comments(text))
        here = Module(path, module, code=code)
        found[module] = here
        folder = path.parent if path.stem in ("lib", "main", "mod") else path.parent / path.stem
        for child in MODULE.findall(code):
            for place in (folder / f"{child}.rs", folder / child / "mod.rs"):
                if place.exists():
                    here.children[child] = (*module, child)
                    read(place, (*module, child))
        for public, tree in USE.findall(code):
            for parts, alias in leaves(tree):
                if parts[-1] == "self":
                    parts = parts[:-1]
                if parts[-1] == "*":
                    here.globs.append(parts[:-1])
                else:
                    here.imported[alias or parts[-1]] = parts
                if not public.strip():
                    here.private.append(parts)
        here.code = re.sub(r"pub\([^)]*\)", "pub", USE.sub("", code))
        here.defined = set(ITEM.findall(here.code))

    read(root, ())
    for module in found.values():
        for parts in [*module.imported.values(), *module.private, *module.globs]:
            if parts and parts[0] == name:
                parts[0] = "crate"
    return found


def resolve(modules: dict, at: tuple[str, ...], parts: list[str], depth: int = 0) -> tuple[str, ...] | None:
    """The module whose file defines what a path names; none for another crate's."""
    if depth > 20 or not parts:
        return None
    place, rest = at, list(parts)
    if rest[0] == "crate":
        place, rest = (), rest[1:]
    elif rest[0] in ("super", "self"):
        while rest and rest[0] in ("super", "self"):
            place = place[:-1] if rest[0] == "super" else place
            rest = rest[1:]
    elif rest[0] not in modules[at].children and rest[0] not in modules[at].imported:
        return None
    for position, part in enumerate(rest):
        module = modules[place]
        if part in module.children:
            place = module.children[part]
            continue
        if part in module.defined:
            return place
        if part in module.imported and not (position == 0 and module.imported[part] == parts):
            target = resolve(modules, place, module.imported[part], depth + 1)
            remaining = rest[position + 1 :]
            if target is None or not remaining or module.imported[part][-1] not in target[-1:]:
                return target
            return resolve(modules, target, ["self", *remaining], depth + 1)
        for glob in module.globs:
            target = resolve(modules, place, glob, depth + 1)
            if target is not None and (part in modules[target].defined or part in modules[target].imported):
                return resolve(modules, target, ["self", *rest[position:]], depth + 1)
        return place
    return place


def arrows(modules: dict) -> dict[tuple[str, ...], set[tuple[str, ...]]]:
    """Which module's code names which other of the crate."""
    out: dict[tuple[str, ...], set[tuple[str, ...]]] = {}
    for name, module in modules.items():
        named = [parts for parts in module.private if parts[-1] != "*"]
        named += [path.split("::") for path in PATH.findall(module.code)]
        targets = {resolve(modules, name, parts) for parts in named}
        out[name] = {target for target in targets if target is not None and target != name}
    return out
