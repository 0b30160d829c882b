"""A scene compiled and stepped with the plugin, in a process of its own: `python -m hydro_tools.hostile.plugin_case`.

Arguments: the library, the MJCF. Exits with 0, or with 1 and `REFUSED: ` and MuJoCo's message. A warning that comes at
every step is an error too: a fault is said once a simulation. (MuJoCo resets one that diverges, which is a new one.)
"""

import sys
from collections import Counter

#: Steps of a scene.
STEPS = 30


def main() -> int:
    """Load, step, say how it went."""
    import mujoco

    warnings: Counter = Counter()
    mujoco.set_mju_user_warning(lambda text: warnings.update([text]))
    mujoco.mj_loadPluginLibrary(sys.argv[1])
    try:
        model = mujoco.MjModel.from_xml_path(sys.argv[2])
        data = mujoco.MjData(model)
        for _ in range(STEPS):
            mujoco.mj_step(model, data)
        mujoco.mj_resetData(model, data)
        mujoco.mj_forward(model, data)
        sys.stdout.write(f"{data.qfrc_passive.tolist()[:12]}\n")
    except (ValueError, RuntimeError, mujoco.FatalError) as error:
        sys.stderr.write(f"REFUSED: {error}\n")
        return 1
    often = [
        text
        for text, count in warnings.items()
        if "panic" in text or ("hydro" in text and count >= STEPS and "until the simulation is reset" not in text)
    ]
    if often:
        sys.stderr.write(f"panicked at each step, or a warning at each: {often[0]}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
