"""The waters that Task 2 can be made in."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from hydro_mujoco.recording import simulation
from hydro_mujoco.recording.plan import Plan
from hydro_mujoco.recording.simulation import Recording

from ..strip_water import added_mass, forces, strips, wake
from ..strip_water.simulation import simulate as simulate_strips
from . import plan, scene
from .scene import Scene

#: Where the added mass is: its force in the label, or M_a in the inertia of whatever model a checkpoint drives.
IN_LABEL, IN_INERTIA = "label", "inertia"
ADDED_MASS = (IN_LABEL, IN_INERTIA)


@dataclass(frozen=True)
class Water:
    """A water by name: its truth scene, and how conditions switch in it by default.

    waterline: world z of the surface [m], None where the robot is deep; added_mass: one of ADDED_MASS, strips only.
    """

    name: str
    model: str
    switch: str
    run: Callable[["Water", Scene, Sequence[Plan], bool], Recording]
    waterline: float | None = None
    added_mass: str = IN_LABEL

    def simulate(self, loaded: Scene, plans: Sequence[Plan], *, every_step: bool = False) -> Recording:
        """What the plans lead to in this water; every_step as in `strip_water.simulation.simulate`."""
        return self.run(self, loaded, plans, every_step)

    def recorded(self) -> dict:
        """Its fields in a manifest; none for the ellipsoids, whose manifests stay as they were.

        `added_mass` lists the bodies' matrices over the density, where the label has the added mass not.
        """
        if self.name == ELLIPSOID.name:
            return {}
        wakes = {"wake_share": wake.SHARE, "wake_length": wake.LENGTH}
        out = {"water": {"name": self.name, "waterline": self.waterline} | wakes}
        if self.added_mass == IN_INERTIA:
            out["water"]["added_mass"] = IN_INERTIA
            matrices = added_mass.by_body(strips.b1())
            out["added_mass"] = [{"body": body, "matrix": m.ravel().tolist()} for body, m in matrices.items()]
        return out


def _ellipsoids(_: Water, loaded: Scene, plans: Sequence[Plan], every_step: bool) -> Recording:
    return simulation.simulate(loaded.system, plans)


def _strips(water: Water, loaded: Scene, plans: Sequence[Plan], every_step: bool) -> Recording:
    return simulate_strips(
        loaded.model,
        forces.water(loaded.model, strips.b1(), water.waterline),
        plans,
        base=loaded.model.body(scene.BASE).id,
        layout=loaded.layout,
        substeps=loaded.system.substeps,
        apart=water.added_mass == IN_INERTIA,
        every_step=every_step,
    )


#: MuJoCo's own fluid, as identified: without added mass in the inertia, without memory.
ELLIPSOID = Water("ellipsoid", scene.TRUTH, plan.MIXED, _ellipsoids)
#: Strip theory with added mass and wakes (`hydro_tools.strip_water`), on the same robot.
STRIP = Water("strip", scene.TRUTH, plan.ALL, _strips)

WATERS = {water.name: water for water in (ELLIPSOID, STRIP)}
