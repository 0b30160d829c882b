"""A free body in any water or in none."""

import json
from dataclasses import dataclass, field
from xml.sax.saxutils import quoteattr

import mujoco

from .meshes import sphere

GEOMS = {
    "sphere": '<geom name="hull" type="sphere" size="0.5" mass="250"/>',
    "ellipsoid": '<geom name="hull" type="ellipsoid" size="1 0.5 0.25" mass="250"/>',
    "box": '<geom name="hull" type="box" size="1 0.5 0.25" mass="400"/>',
    "cylinder": '<geom name="hull" type="cylinder" size="0.3 1" mass="250"/>',
    "capsule": '<geom name="hull" type="capsule" size="0.3 1" mass="300"/>',
    "mesh of 320 triangles": '<geom name="hull" type="mesh" mesh="small" mass="250"/>',
    "mesh of 1,280 triangles": '<geom name="hull" type="mesh" mesh="large" mass="250"/>',
    "two spheres apart": '<geom name="hull" type="sphere" size="0.3" pos="0.35 0 0" mass="60"/>'
    '<geom name="float" type="sphere" size="0.3" pos="-0.35 0 0" mass="60"/>',
    "two spheres that overlap": '<geom name="hull" type="sphere" size="0.3" pos="0.2 0 0" mass="50"/>'
    '<geom name="float" type="sphere" size="0.3" pos="-0.2 0 0" mass="50"/>',
}
ASSET = f"<asset>{sphere('small', 2)}{sphere('large', 3)}</asset>"
#: What effects on joints and actuators and a propeller need, named as in `soak.catalogue`; a wall that nothing touches.
MACHINE = {
    "inside": '<site name="stern"/><body name="fin" pos="-1 0 0"><joint name="hinge" axis="1 0 0"/>'
    '<geom type="sphere" size="0.1" mass="5" contype="0" conaffinity="0"/></body>',
    "outside": '<geom type="plane" size="9 9 1" pos="0 0 -2" contype="0" conaffinity="0"/>',
    "actuators": '<actuator><general name="tail" site="stern" gear="1 0 0 0 0 0" ctrlrange="-1 1"/>'
    '<motor name="motor" joint="hinge"/></actuator>',
    "gravity": "0 0 0",
}


def effect(name: str, parameters: dict | None = None, target: str = "hull", **more) -> dict:
    """One effect."""
    return {"effect": name, "target": target, "parameters": parameters or {}, **more}


#: An instance of the plugin that does hardly anything.
IDLE = [effect("constant_force", {"x": 1e-9, "y": 0.0, "z": 0.0})]


@dataclass(frozen=True)
class Water:
    """An instance of `hydro.wrench`: its effects and other attributes."""

    effects: list[dict] = field(default_factory=lambda: IDLE)
    attributes: dict[str, str] = field(default_factory=dict)

    def elements(self) -> tuple[str, str]:
        """The declaration, and the element of the body that carries it."""
        given = {"effects": json.dumps({"schema": "hydro-effects/1", "effects": self.effects}), **self.attributes}
        config = "".join(f'<config key="{key}" value={quoteattr(value)}/>' for key, value in given.items())
        instance = f'<plugin plugin="hydro.wrench"><instance name="w">{config}</instance></plugin>'
        return f"<extension>{instance}</extension>", '<plugin plugin="hydro.wrench" instance="w"/>'


def model(geoms: str, water: Water | None, *, inside="", outside="", actuators="", gravity="0 0 -9.81"):
    """The compiled scene; without water: without the plugin."""
    extension, plugin = water.elements() if water else ("", "")
    return mujoco.MjModel.from_xml_string(f"""
<mujoco><option timestep="0.005" integrator="implicitfast" gravity="{gravity}"/>{extension}{ASSET}
  <worldbody>{outside}
    <body name="hull" pos="0 0 0.02"><freejoint/>{plugin}{geoms}{inside}<body name="room"/></body>
  </worldbody>{actuators}
</mujoco>""")
