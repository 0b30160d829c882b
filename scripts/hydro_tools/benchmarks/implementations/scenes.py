"""B1 in every water: bare, in MuJoCo's own ellipsoid fluid, in the plugin's; one robot or several in one scene."""

import mujoco

from ...repository import ROOT
from .. import LIBRARY, BenchmarkError

INTEGRATORS = {
    "euler": mujoco.mjtIntegrator.mjINT_EULER,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    "rk4": mujoco.mjtIntegrator.mjINT_RK4,
}
BARE, FLUID, SWIM = (ROOT / "mjcf" / name for name in ("b1.xml", "b1_truth.xml", "b1_swim.xml"))
#: As `mjcf/b1_swim.xml` names it.
RELEASED = '<config key="checkpoint" value="models/b1-task2"/>'


def _spec(water: str, checkpoint: str | None, engine: str) -> mujoco.MjSpec:
    if water == "bare":
        return mujoco.MjSpec.from_file(str(BARE))
    if water == "ellipsoid":
        return mujoco.MjSpec.from_file(str(FLUID))
    text = SWIM.read_text()
    if RELEASED not in text:
        raise BenchmarkError(f"{SWIM} has no {RELEASED}")
    config = f'<config key="checkpoint" value="{checkpoint}"/><config key="engine" value="{engine}"/>'
    return mujoco.MjSpec.from_string(text.replace(RELEASED, config))


def _several(water: str, checkpoint: str | None, engine: str, robots: int) -> mujoco.MjSpec:
    """Robots in a row, 3 m apart, each with a plugin instance of its own."""
    scene = _spec(water, checkpoint, engine)
    for index in range(1, robots):
        other, prefix = _spec(water, checkpoint, engine), f"r{index}_"
        for plugin in other.plugins:
            joints = [joint.name for joint in other.joints if joint.name.endswith("_joint")]
            plugin.config = plugin.config | {"joints": " ".join(prefix + name for name in joints)}
        scene.worldbody.add_frame(pos=[0, 3 * index, 0]).attach_body(other.body("trunk"), prefix, "")
    return scene


def load(
    *, water: str, integrator: str = "euler", checkpoint: str | None = None, engine: str = "fused", robots: int = 1
) -> mujoco.MjModel:
    """Physics every 2 ms. Without gravity: bare B1 would fall; nothing touches in any scene."""
    if water == "plugin":
        mujoco.mj_loadPluginLibrary(str(LIBRARY))
    make = _spec(water, checkpoint, engine) if robots == 1 else _several(water, checkpoint, engine, robots)
    model = make.compile()
    model.opt.timestep, model.opt.integrator = 0.002, INTEGRATORS[integrator]
    model.opt.gravity[:] = 0
    return model
