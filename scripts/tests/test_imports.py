"""Imports among the modules of hydro_tools and hydro_mujoco: no circle, no changes of sys.path, thin scripts."""

import ast
import graphlib
import unittest

from hydro_tools.repository import ROOT, SCRIPTS

#: Lines of a script in scripts/ at most.
THIN = 40


#: Folders of the packages.
PACKAGES = {"hydro_tools": SCRIPTS, "hydro_mujoco": ROOT / "python"}


def modules(*packages: str) -> dict[str, ast.Module]:
    """Every module of the packages, of both by default, by its dotted name, parsed."""
    found = {}
    for package in packages or PACKAGES:
        for path in sorted((PACKAGES[package] / package).rglob("*.py")):
            parts = path.relative_to(PACKAGES[package]).with_suffix("").parts
            name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
            found[name] = ast.parse(path.read_text(encoding="utf-8"))
    return found


def imported(name: str, tree: ast.Module, known: set[str]) -> set[str]:
    """Modules of the package that a module imports, within functions too."""
    folder = PACKAGES[name.split(".")[0]] / name.replace(".", "/")
    package = name if folder.is_dir() else name.rpartition(".")[0]
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            source = ".".join([*above, *([node.module] if node.module else [])])
            # A name is a module of the package, or something that the package itself defines.
            found |= {whole if (whole := f"{source}.{alias.name}") in known else source for alias in node.names}
    return (found & known) - {name}


def without_typing(tree: ast.Module) -> ast.Module:
    """The module without what stands under `if TYPE_CHECKING`."""
    tree.body = [
        node for node in tree.body if not (isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test))
    ]
    return tree


class Imports(unittest.TestCase):
    def test_no_circle(self):
        parsed = modules()
        graph = {name: imported(name, without_typing(tree), set(parsed)) for name, tree in parsed.items()}
        self.assertIn("hydro_tools.datasets.scene", graph["hydro_tools.datasets.replay"])
        list(graphlib.TopologicalSorter(graph).static_order())

    def test_the_package_names_no_script(self):
        parsed = modules()
        for name, tree in parsed.items():
            if name.startswith("hydro_mujoco"):
                self.assertFalse([other for other in imported(name, tree, set(parsed)) if "hydro_tools" in other], name)

    def test_no_circle_among_packages(self):
        for package in PACKAGES:
            with self.subTest(package):
                self.no_circle_among_packages(modules(package))

    def no_circle_among_packages(self, parsed):
        graph = {}
        for name, tree in parsed.items():
            if name.count(".") >= 1:
                own = name.split(".")[1]
                others = {
                    m.split(".")[1] for m in imported(name, without_typing(tree), set(parsed)) if m.count(".") >= 1
                }
                graph[own] = graph.get(own, set()) | others - {own}
        list(graphlib.TopologicalSorter(graph).static_order())

    def test_commands_import_no_command(self):
        parsed = modules()
        for name, tree in parsed.items():
            with self.subTest(name):
                found = imported(name, tree, set(parsed))
                self.assertFalse([other for other in found if other.startswith("hydro_tools.commands.")])


class Scripts(unittest.TestCase):
    def test_every_command_has_a_script(self):
        scripts = {path.stem for path in SCRIPTS.glob("*.py")}
        commands = {path.stem for path in (SCRIPTS / "hydro_tools" / "commands").glob("*.py")} - {"__init__"}
        self.assertEqual(scripts, commands)

    def test_scripts_are_thin(self):
        for path in SCRIPTS.glob("*.py"):
            with self.subTest(path.name):
                self.assertLess(len(path.read_text(encoding="utf-8").splitlines()), THIN)

    def test_nothing_changes_the_search_path(self):
        for path in SCRIPTS.rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Attribute) and node.attr == "path" and isinstance(node.value, ast.Name):
                    self.assertNotEqual(node.value.id, "sys", path)


if __name__ == "__main__":
    unittest.main()
