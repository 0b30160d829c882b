"""MJCF files out of wheels: a folder of `*.whl` files (`pip download --no-deps NAME`), or of what is in them."""

import tempfile
import zipfile
from pathlib import Path

from ..hidden_cases import HiddenCaseError

#: What a wheel unpacks to, by the name of its project.
PACKAGES = {
    "dm-control": "dm_control",
    "gymnasium-robotics": "gymnasium_robotics",
    "robosuite": "robosuite",
}


class Wheels:
    """Folders of the three packages. Wheels are unpacked into a temporary folder that lives as long as this does."""

    def __init__(self, folder: Path):
        self._kept = None
        self.folders: dict[str, Path] = {}
        archives = sorted(folder.glob("*.whl"))
        for package in PACKAGES.values():
            if (folder / package).is_dir():
                self.folders[package] = folder / package
                continue
            whole = [archive for archive in archives if archive.name.startswith(f"{package}-")]
            if whole:
                if self._kept is None:
                    self._kept = tempfile.TemporaryDirectory()
                with zipfile.ZipFile(whole[-1]) as archive:
                    archive.extractall(self._kept.name, _assets(archive.namelist()))
                self.folders[package] = Path(self._kept.name) / package
        if not self.folders:
            raise HiddenCaseError(
                f"{folder}: none of {', '.join(sorted(PACKAGES.values()))} and no wheel of them; "
                f"`pip download --no-deps --dest {folder} {' '.join(PACKAGES)}` gets them"
            )

    def path(self, name: str) -> Path:
        """A file by its path in a package, such as `dm_control/suite/fish.xml`."""
        package, _, rest = name.partition("/")
        path = self.folders.get(package, Path(package)) / rest
        if not path.is_file():
            raise HiddenCaseError(f"{name}: not in the wheels, which have {', '.join(sorted(self.folders))}")
        return path


def _assets(names: list[str]) -> list[str]:
    """What an MJCF may need."""
    wanted = (".xml", ".stl", ".obj", ".png", ".msh", ".skn")
    return [name for name in names if name.lower().endswith(wanted)]
