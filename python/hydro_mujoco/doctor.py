"""Whether the plugin acts in this Python, and what to do if not."""

import sys
from pathlib import Path

import mujoco

from .errors import DataError
from .packaged import root
from .plugin import LIBRARY, WRENCH, built_library, is_loaded, load_plugin, loaded_copies
from .version import __version__
from .water import add_water, wrench

#: A body without weight at 2 m/s, and the drag that it must feel: 10 * 2^2.
SPEED, COEFFICIENT = 2.0, 10.0
PROBE = """<mujoco><option gravity="0 0 0"/>
<worldbody><body name="hull"><freejoint/><geom size="0.1"/></body></worldbody></mujoco>"""


def examine() -> tuple[bool, str]:
    """Whether the plugin acts, and a text that says so with all that was found."""
    package = Path(mujoco.__file__).parent
    at_import = is_loaded()
    checkpoints = sorted(card.parent.name for card in root().glob("models/*/card.json"))
    lines = [
        f"hydro_mujoco {__version__}  {Path(__file__).parent}",
        f"Python       {sys.version.split()[0]}  {sys.executable}",
        f"MuJoCo       {mujoco.__version__}  {', '.join(map(str, sorted(package.glob('libmujoco*')))) or package}",
        f"checkpoints  {', '.join(checkpoints) or 'none'}  {root() / 'models'}",
    ]
    try:
        load_plugin()
        force = _force()
    except (DataError, ValueError) as error:
        lines.append(f"plugin       does not act: {' '.join(str(error).split())}")
        lines += _advice()
        return False, "\n".join(lines)
    copies = loaded_copies()
    when = "loaded by `import mujoco`" if at_import else "loaded by hydro_mujoco: `import mujoco` alone does not"
    lines.append(f"plugin       {copies[0] if copies else built_library()}  {when}")
    lines += [f"             also in this process, without effect: {copy}" for copy in copies[1:]]
    expected = -COEFFICIENT * SPEED**2
    acts = abs(force - expected) < 1e-6
    verdict = "it acts" if acts else "WRONG"
    lines.append(f"water        {force:.1f} N of drag on a test body, {expected:.1f} N expected: {verdict}")
    return acts, "\n".join(lines if acts else lines + _advice())


def _force() -> float:
    """Force along x on the test body after a step [N]."""
    drag = dict.fromkeys(("surge", "sway", "heave", "roll", "pitch", "yaw"), COEFFICIENT)
    spec = add_water(mujoco.MjSpec.from_string(PROBE), body="hull", effects={"quadratic_drag": drag})
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qvel[0] = SPEED
    mujoco.mj_step(model, data)
    return float(wrench(model, data, "hull")[0])


def _advice() -> list[str]:
    return [
        "to do        1. the MuJoCo that this package goes with: pip install 'mujoco==4.0.0'",
        "             2. the package anew: pip install --force-reinstall --no-deps hydro-mujoco",
        f"             3. another library: {LIBRARY}=/path/libhydro_plugin.so, after cargo build --release",
        f"             MuJoCo's warning (above, or in MUJOCO_LOG.TXT) says why {WRENCH} is not there",
    ]


def main() -> int:
    """Print the findings; returns the exit status."""
    acts, text = examine()
    print(text)
    return 0 if acts else 1
