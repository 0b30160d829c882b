"""Machine, versions and commit of a measurement."""

import os
import platform
import subprocess
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

from ..repository import ROOT

PACKAGES = ("torch", "torchdiffeq", "onnxruntime", "onnx", "mujoco", "numpy")


def _output(*command: str) -> str:
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True).stdout.strip()


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "absent"


def caches() -> dict[str, str]:
    """Sizes of the first core's caches: {"L1d": "48K", ..}."""
    found = {}
    for index in sorted(Path("/sys/devices/system/cpu/cpu0/cache").glob("index*")):
        level, kind, size = ((index / name).read_text().strip() for name in ("level", "type", "size"))
        found[f"L{level}" + {"Data": "d", "Instruction": "i"}.get(kind, "")] = size
    return found


def vectors(flags: set[str]) -> str:
    """The widest instruction set that matters here."""
    known = (("avx512f", "AVX-512"), ("avx2", "AVX2"), ("asimd", "NEON"))
    return next((name for flag, name in known if flag in flags), "none known")


def machine() -> dict:
    """CPU, memory, kernel, versions."""
    fields = {}
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        key, _, value = line.partition(":")
        fields.setdefault(key.strip(), value.strip())
    total = next(line for line in Path("/proc/meminfo").read_text().splitlines() if line.startswith("MemTotal"))
    return {
        "cpu": fields.get("model name", platform.machine()),
        "family": f"{fields.get('cpu family', '?')}/{fields.get('model', '?')}",
        "cores": os.cpu_count(),
        "virtual": "hypervisor" in fields.get("flags", "").split(),
        "vectors": vectors(set((fields.get("flags") or fields.get("Features", "")).split())),
        "caches": caches(),
        "memory_gib": round(int(total.split()[1]) / 2**20, 1),
        "kernel": platform.release().split("-")[0],
        "python": platform.python_version(),
        "rustc": _output("rustc", "--version").removeprefix("rustc "),
        "packages": {name: _version(name) for name in PACKAGES},
    }


def commit() -> str:
    """Short name of the commit, with `+` where the tree has changes."""
    # Results and the pages made of them do not count: writing them is what a run does.
    changed = _output(
        "git",
        "status",
        "--porcelain",
        "--untracked-files=no",
        "--",
        ".",
        ":!benches/results",
        ":!benches/RESULTS.md",
        ":!benches/*.svg",
    )
    return _output("git", "rev-parse", "--short", "HEAD") + ("+" if changed else "")


class Others:
    """Share of the machine that other programs take from here on."""

    def __init__(self):
        self.before = self._busy()

    @staticmethod
    def _busy() -> tuple[float, float, float]:
        """Seconds since some start: of the clock, of all cores, of ours and of the children that have ended."""
        user, nice, system, _, _, irq, soft, steal = map(int, Path("/proc/stat").read_text().split()[1:9])
        all_cores = (user + nice + system + irq + soft + steal) / os.sysconf("SC_CLK_TCK")
        own = os.times()
        return own.elapsed, all_cores, own.user + own.system + own.children_user + own.children_system

    def share(self) -> float:
        """Share of all cores, 0 to 1."""
        clock, busy, own = (after - before for after, before in zip(self._busy(), self.before))
        return max(0.0, (busy - own) / (clock * os.cpu_count()))


def stamp() -> dict:
    """When, at which commit, on which machine."""
    return {"date": datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"), "commit": commit(), "machine": machine()}
