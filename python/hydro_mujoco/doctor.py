"""Whether the plugin acts in this Python, and what to do if not.

It imports MuJoCo, and what needs it, only after it has looked which one there is.
"""

import json
import sys
from importlib import metadata
from pathlib import Path
from urllib.parse import urlparse

from hydro_mujoco_entry import find_program

from . import requirement
from .errors import DataError
from .version import __version__

#: The distribution of this package.
DISTRIBUTION = "hydro-mujoco"
#: A body without weight at 2 m/s, and the drag that it must feel: 10 * 2^2.
SPEED, COEFFICIENT = 2.0, 10.0
PROBE = """<mujoco><option gravity="0 0 0"/>
<worldbody><body name="hull"><freejoint/><geom size="0.1"/></body></worldbody></mujoco>"""


def examine() -> tuple[bool, str]:
    """Whether the plugin acts, and a text that says so with all that was found."""
    package, installed = _package()
    lines = [
        f"hydro_mujoco {__version__}  {package}",
        f"Python       {sys.version.split()[0]}  {sys.executable}",
        f"program      {_program()}",
    ]
    try:
        mujoco = requirement.mujoco_module()
    except ImportError as error:
        return False, "\n".join([*lines, f"MuJoCo       {error}"])
    folder = Path(mujoco.__path__[0])
    lines.append(
        f"MuJoCo       {mujoco.__version__}  {', '.join(map(str, sorted(folder.glob('libmujoco*')))) or folder}"
    )
    acts, more = _plugin(installed)
    return acts, "\n".join([*lines, *more])


def _package() -> tuple[str, bool]:
    """Where this package is and how it came there; whether MuJoCo finds its entry point."""
    here = Path(__file__).parent
    try:
        found = metadata.distribution(DISTRIBUTION)
    except metadata.PackageNotFoundError:
        return f"{here}  a folder, not installed", False
    source = json.loads(found.read_text("direct_url.json") or "{}")
    checkout = Path(urlparse(source.get("url", "")).path)
    if source.get("dir_info", {}).get("editable") and here.is_relative_to(checkout):
        return f"{here}  editable install", False
    if Path(str(found.locate_file(here.name))) != here:
        return f"{here}  a folder before the installed {found.version} in {found.locate_file('')}", False
    tags = [line.removeprefix("Tag: ") for line in (found.read_text("WHEEL") or "").splitlines() if "Tag: " in line]
    return f"{here}  wheel {', '.join(tags)}", True


def _program() -> str:
    try:
        return str(find_program())
    except FileNotFoundError as error:
        return f"none: {error}"


def _plugin(installed: bool) -> tuple[bool, list[str]]:
    """Whether the plugin acts, and lines on it. installed: by a wheel, so that `import mujoco` loads it."""
    import mujoco

    from .packaged import root
    from .plugin import LIBRARY, built_library, is_loaded, load_plugin, loaded_copies

    checkpoints = sorted(card.parent.name for card in root().glob("models/*/card.json"))
    lines = [f"checkpoints  {', '.join(checkpoints) or 'none'}  {root() / 'models'}"]
    advice = [
        f"to do        1. a MuJoCo that this package goes with: {requirement.INSTALL}",
        f"             2. the package anew: pip install --force-reinstall --no-deps {DISTRIBUTION}",
        f"             3. another library: {LIBRARY}=/path/libhydro_plugin.so, after cargo build --release",
    ]
    try:
        requirement.check(mujoco.__version__)
        at_import = is_loaded()
        load_plugin()
        force = _force()
    except (DataError, ImportError, ValueError) as error:
        return False, [*lines, f"plugin       does not act: {' '.join(str(error).split())}", *advice]
    first, *others = loaded_copies() or [built_library()]
    when = "loaded by `import mujoco`" if at_import else "loaded by hydro_mujoco: `import mujoco` alone does not"
    lines.append(f"plugin       {first}  {when}")
    lines += [f"             also in this process, without effect: {copy}" for copy in others]
    expected = -COEFFICIENT * SPEED**2
    acts = abs(force - expected) < 1e-6
    verdict = "it acts" if acts else "WRONG"
    lines.append(f"water        {force:.1f} N of drag on a test body, {expected:.1f} N expected: {verdict}")
    if acts and not at_import and not installed:
        advice = [
            "to do        install the wheel, and `import mujoco` loads the plugin: pip install hydro_mujoco-*.whl"
        ]
    elif acts:
        advice = []
    return acts, lines + advice


def _force() -> float:
    """Force along x on the test body after a step [N]."""
    import mujoco

    from .water import add_water, wrench

    drag = dict.fromkeys(("surge", "sway", "heave", "roll", "pitch", "yaw"), COEFFICIENT)
    spec = add_water(mujoco.MjSpec.from_string(PROBE), body="hull", effects={"quadratic_drag": drag})
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qvel[0] = SPEED
    mujoco.mj_step(model, data)
    return float(wrench(model, data, "hull")[0])


def main() -> int:
    """Print the findings; returns the exit status."""
    acts, text = examine()
    print(text)
    return 0 if acts else 1
