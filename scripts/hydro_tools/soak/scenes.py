"""The models of the soak."""

import json
from pathlib import Path

import mujoco

import hydro_mujoco as hydro

from . import SoakError
from .catalogue import Effect

#: Integrators of MuJoCo.
INTEGRATORS = ("Euler", "RK4", "implicit", "implicitfast")
#: Step under RK4 [s]: there drag is explicit (docs/plugin.md), and explodes at 2 ms where it is stiff.
EXPLICIT_STEP = 0.0005
#: The example vehicle of `hydro gap effects`, 20 kg, over a floor, beside a wall; a driven link, a thruster; and
#: a stone that comes to rest on the floor and sleeps.
VEHICLE = """<mujoco model="soak">
  <option timestep="0.002"><flag energy="enable" sleep="enable"/></option>
  <default><geom solref="0.02 1"/></default>
  <worldbody>
    <geom name="floor" type="plane" size="20 20 1" pos="0 0 -1.5"/>
    <geom name="wall" type="box" size="0.1 20 5" pos="3 0 0"/>
    <body name="hull"><freejoint/>
      <geom name="hull" type="ellipsoid" size="0.4 0.2 0.15" mass="18"/>
      <site name="stern" pos="-0.4 0 0"/>
      <body name="fin" pos="-0.45 0 0"><joint name="hinge" axis="0 0 1" range="-90 90" limited="true"/>
        <geom name="fin" type="box" size="0.15 0.01 0.08" pos="-0.15 0 0" mass="2"/></body>
    </body>
    <body name="stone" pos="-1 1 -1.3"><freejoint/><geom type="box" size="0.1 0.1 0.1" mass="3"/></body>
  </worldbody>
  <actuator>
    <motor name="tail" joint="hinge" gear="5" ctrlrange="-1 1" ctrllimited="true"/>
    <general name="thruster" site="stern" gear="20 0 0 0 0 0" ctrlrange="-1 1" ctrllimited="true"/>
  </actuator>
  <sensor><gyro site="stern"/><accelerometer site="stern"/></sensor>
</mujoco>
"""


def allows(checkpoint: str, effect: Effect) -> bool:
    """False where the card has an added mass of the trunk and the effect would be a second one."""
    card = json.loads((Path(hydro.checkpoint(checkpoint)) / "card.json").read_text())
    return effect.effect != "added_mass" or not card.get("added_mass")


def vehicle(effects: list[Effect], integrator: str, calm: bool) -> mujoco.MjModel:
    """The vehicle with effects, or dry; in a calm scene there is no gravity, contact, waterline or sleep."""
    spec = mujoco.MjSpec.from_string(VEHICLE)
    _integrate(spec, integrator)
    if calm:
        spec.option.gravity = [0, 0, 0]
        spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        spec.option.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    if effects:
        entries = [effect.entry() for effect in effects]
        hydro.add_water(spec, body="hull", effects=entries, waterline=None if calm else 0.1)
    return _compiled(spec, ", ".join(effect.effect for effect in effects) or "dry")


def robot(checkpoint: str, effects: list[Effect], integrator: str) -> mujoco.MjModel:
    """The swimming B1 under a released checkpoint, above a floor, with effects on its trunk beside it."""
    spec = mujoco.MjSpec.from_file(hydro.scene("b1_swim"))
    _integrate(spec, integrator)
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[20, 20, 1], pos=[0, 0, -1.5])
    config = dict(spec.plugins[0].config) | {"checkpoint": hydro.checkpoint(checkpoint)}
    if effects:
        entries = [effect.entry() | {"target": "trunk"} for effect in effects]
        config["effects"] = json.dumps({"schema": "hydro-effects/1", "effects": entries})
        config["waterline"] = "1"
    spec.plugins[0].config = config
    return _compiled(spec, checkpoint)


def _integrate(spec: mujoco.MjSpec, integrator: str) -> None:
    spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    if integrator == "RK4":
        spec.option.timestep = EXPLICIT_STEP


def _compiled(spec: mujoco.MjSpec, what: str) -> mujoco.MjModel:
    try:
        return spec.compile()
    except ValueError as error:
        raise SoakError(f"{what}: {error}") from error
