"""Builds plugin and program with cargo and packs them, checkpoints, scenes and examples into the wheel."""

import importlib.util
import json
import os
import platform
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

#: Folders that are data of the package, in the checkout and there.
DATA = (
    "mjcf",
    "examples",
    "models/b1-relaxation",
    "models/b1-strip",
    "models/b1-strip-attention-ode",
    "models/b1-strip-cnode",
    "models/b1-strip-lstm",
    "models/b1-strip-mlp-ode",
    "models/b1-task2",
    "models/robots",
    "models/README.md",
)
PACKAGE = "hydro_mujoco"
#: Environment variable: cargo's profile; `dev` makes a wheel for tests of what is compiled already.
PROFILE = "HYDRO_WHEEL_PROFILE"


class Build(BuildHookInterface):
    """Adds to a wheel what Rust makes; an editable install takes it from `target/` when it runs."""

    def initialize(self, version: str, build_data: dict) -> None:
        """Build and list the files."""
        if self.target_name != "wheel" or version == "editable":
            return
        root = Path(self.root)
        release = compiled(root)
        library, program = release / "libhydro_plugin.so", release / "hydro"
        check(program, self.metadata.version)
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{platform_tag(library, program)}"
        files = {str(library): f"{PACKAGE}/{library.name}", str(program): f"{PACKAGE}/bin/{program.name}"}
        build_data["force_include"].update(files | {str(root / place): f"{PACKAGE}/{place}" for place in DATA})
        self.bill = tempfile.TemporaryDirectory()
        listed = Path(self.bill.name, "crates.cdx.json")
        listed.write_text(json.dumps(bill_of_materials(root, self.metadata.version), indent=1) + "\n")
        build_data["sbom_files"].append(str(listed))

    def finalize(self, version: str, build_data: dict, artifact_path: str) -> None:
        """Remove what was made for the wheel alone."""
        if hasattr(self, "bill"):
            self.bill.cleanup()


def compiled(root: Path) -> Path:
    """Run cargo; the folder of what it made."""
    if shutil.which("cargo") is None:
        raise SystemExit(
            "hydro-mujoco is built from Rust, and there is no `cargo`: install Rust (https://rustup.rs), or a wheel"
        )
    environment = dict(os.environ)
    # build.rs looks into .venv by itself; else the headers are those that pip fetched for the build.
    if "MUJOCO_DIR" not in environment and not any(root.glob(".venv/lib*/python3*/site-packages/mujoco/include")):
        found = importlib.util.find_spec("mujoco")
        if found is None or not found.submodule_search_locations:
            raise SystemExit("hydro-mujoco is built with MuJoCo's headers: pip install mujoco==4.0.0")
        environment["MUJOCO_DIR"] = found.submodule_search_locations[0]
    profile = environment.get(PROFILE, "release")
    command = ["cargo", "build", "--profile", profile, "--locked", "--package", "hydro", "--lib", "--bin", "hydro"]
    if subprocess.run(command, cwd=root, env=environment).returncode:
        raise SystemExit(f"`{' '.join(command)}` failed; its output is above (pip shows it with -v)")
    return Path(root, environment.get("CARGO_TARGET_DIR", "target"), "debug" if profile == "dev" else profile)


def bill_of_materials(root: Path, version: str) -> dict:
    """Crates that plugin and program are compiled from: CycloneDX 1.6, for the wheel's `sboms` (PEP 770)."""
    tree = ["cargo", "tree", "--locked", "--package", "hydro", "--edges", "normal", "--prefix", "none"]
    run = subprocess.run([*tree, "--format", "{p}|{l}"], cwd=root, capture_output=True, text=True)
    if run.returncode:
        raise SystemExit(f"`{' '.join(tree)}` failed: {run.stderr.strip()}")
    # "NAME vVERSION (REMARK)|LICENCE"; those of this checkout have its folder as remark, and are what the list is of.
    lines = sorted({line.removesuffix(" (*)") for line in run.stdout.splitlines()})
    rows = [line.split("|") for line in lines if f"({root.resolve()}" not in line]
    components = []
    for crate, licence in rows:
        name, number = crate.split()[:2]
        purl = f"pkg:cargo/{name}@{number.removeprefix('v')}"
        found = {"type": "library", "bom-ref": purl, "name": name, "version": number.removeprefix("v"), "purl": purl}
        if licence:
            found["licenses"] = [{"expression": " ".join(licence.replace("/", " OR ").split())}]
        components.append(found)
    wheel = {"type": "library", "bom-ref": "hydro-mujoco", "name": "hydro-mujoco", "version": version}
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {"component": wheel},
        "components": components,
        "dependencies": [{"ref": "hydro-mujoco", "dependsOn": [of["bom-ref"] for of in components]}],
    }


def check(program: Path, version: str) -> None:
    """Refuse a program of another version, or one for a MuJoCo that the wheel does not ask for."""
    run = subprocess.run([program, "doctor", "--json"], capture_output=True, text=True)
    found = json.loads(run.stdout)
    if found["hydro"] != version:
        raise SystemExit(f"Cargo.toml says version {found['hydro']}, python/{PACKAGE}/version.py {version}")
    if "Err" in found["plugin"] or "4.0.0" not in found["mujoco_accepted"]:
        raise SystemExit(f"the wheel is for MuJoCo 4.0.0; the build does not work in it: {found}")


def platform_tag(*files: Path) -> str:
    """The oldest glibc that has every symbol of the files, as a wheel's platform tag."""
    needed = {int(minor) for file in files for minor in re.findall(rb"GLIBC_2\.(\d+)", file.read_bytes())}
    return f"manylinux_2_{max(needed)}_{platform.machine()}"
