"""The waters that Task 2 can be made in."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from hydro_mujoco.recording import simulation
from hydro_mujoco.recording.plan import Plan
from hydro_mujoco.recording.simulation import Recording

from ..strip_water import forces, strips, wake
from ..strip_water.simulation import simulate as simulate_strips
from . import plan, scene
from .scene import Scene


@dataclass(frozen=True)
class Water:
    """A water by name: its truth scene, and how conditions switch in it by default.

    waterline: world z of the surface [m], None where the robot is deep.
    """

    name: str
    model: str
    switch: str
    run: Callable[["Water", Scene, Sequence[Plan]], Recording]
    waterline: float | None = None

    def simulate(self, loaded: Scene, plans: Sequence[Plan]) -> Recording:
        """What the plans lead to in this water."""
        return self.run(self, loaded, plans)

    def recorded(self) -> dict:
        """Its fields in a manifest; none for the ellipsoids, whose manifests stay as they were."""
        if self.name == ELLIPSOID.name:
            return {}
        wakes = {"wake_share": wake.SHARE, "wake_length": wake.LENGTH}
        return {"water": {"name": self.name, "waterline": self.waterline} | wakes}


def _ellipsoids(_: Water, loaded: Scene, plans: Sequence[Plan]) -> Recording:
    return simulation.simulate(loaded.system, plans)


def _strips(water: Water, loaded: Scene, plans: Sequence[Plan]) -> Recording:
    base = loaded.model.body(scene.BASE).id
    made = forces.water(loaded.model, strips.b1(), water.waterline)
    return simulate_strips(loaded.model, made, plans, base=base, layout=loaded.layout, substeps=loaded.system.substeps)


#: MuJoCo's own fluid, as identified: without added mass in the inertia, without memory.
ELLIPSOID = Water("ellipsoid", scene.TRUTH, plan.MIXED, _ellipsoids)
#: Strip theory with added mass and wakes (`hydro_tools.strip_water`), on the same robot.
STRIP = Water("strip", scene.TRUTH, plan.ALL, _strips)

WATERS = {water.name: water for water in (ELLIPSOID, STRIP)}
