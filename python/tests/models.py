"""Small models that the tests record."""

#: A fish of three links in MuJoCo's ellipsoid fluid: a servo, a motor, a hinge that nothing drives.
FISH = """
<mujoco model="fish">
  <option timestep="0.004" density="{density}" viscosity="{viscosity}" integrator="implicitfast" wind="{wind}"/>
  <default><geom fluidshape="ellipsoid"/></default>
  <worldbody>
    <body name="hull" gravcomp="{gravcomp}">{joint}
      <geom type="ellipsoid" size="0.15 0.05 0.06" mass="2"/>
      <body name="tail" pos="-0.15 0 0">
        <joint name="tail" axis="0 0 1" range="-60 60" limited="true" damping="0.01"/>
        <geom type="ellipsoid" size="0.06 0.02 0.05" pos="-0.06 0 0" mass="0.2"/>
        <body name="fin" pos="-0.12 0 0">
          <joint name="{fin}" axis="0 0 1" damping="0.02" stiffness="0.05"/>
          <geom type="ellipsoid" size="0.04 0.005 0.05" pos="-0.04 0 0" mass="0.03"/>
        </body>
      </body>
      <body name="nose" pos="0.15 0 0">
        <joint name="nose" axis="0 1 0" range="-40 40" limited="true" damping="0.01"/>
        <geom type="ellipsoid" size="0.03 0.02 0.02" pos="0.03 0 0" mass="0.05"/>
      </body>
    </body>
    {more}
  </worldbody>
  <actuator>{actuators}</actuator>
</mujoco>
"""
ACTUATORS = """
<position name="tail" joint="tail" kp="2" ctrlrange="-0.8 0.8" ctrllimited="true"/>
<motor name="nose" joint="nose" gear="0.1" ctrlrange="-1 1" ctrllimited="true"/>
"""

#: A vehicle of thrusters in water by effects, some of them on a fin.
VEHICLE = """
<mujoco model="vehicle">
  <option timestep="0.005" {option}/>
  <extension><plugin plugin="hydro.wrench"><instance name="water">
    {attributes}<config key="effects" value='{{"schema": "hydro-effects/1", "effects": [{effects}]}}'/>
  </instance></plugin></extension>
  <worldbody>
    <body name="hull"><freejoint/>
      <geom type="ellipsoid" size="0.33 0.18 0.1" mass="25"/>
      <site name="left" pos="-0.2 0.1 0"/><site name="right" pos="-0.2 -0.1 0"/>
      <plugin plugin="hydro.wrench" instance="water"/>
      <body name="fin" pos="-0.35 0 0" euler="0 10 20"><joint name="fin" axis="0 0 1" damping="1"/>
        <geom type="ellipsoid" size="0.1 0.02 0.1" pos="-0.1 0 0" mass="1"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <general name="left" site="left" gear="1 0 0 0 0 0" ctrlrange="-30 30" ctrllimited="true"/>
    <general name="right" site="right" gear="1 0 0 0 0 0" ctrlrange="-30 30" ctrllimited="true"/>
  </actuator>
</mujoco>
"""
DRAG = """{"effect": "quadratic_drag", "target": "hull", "parameters":
  {"surge": 18, "sway": 30, "heave": 40, "roll": 0.5, "pitch": 0.7, "yaw": 0.8}}"""
FIN_DRAG = """{"effect": "linear_drag", "target": "fin", "parameters":
  {"surge": 0.5, "sway": 3, "heave": 1, "roll": 0.01, "pitch": 0.01, "yaw": 0.02}}"""
ADDED_MASS = """{"effect": "added_mass", "target": "hull", "parameters":
  {"surge": 6, "sway": 12, "heave": 18, "roll": 0.12, "pitch": 0.35, "yaw": 0.35}}"""
BUOYANCY = '{"effect": "net_buoyancy", "target": "hull", "parameters": {"force": 250}}'
CURRENT = '{"effect": "current", "target": "hull", "parameters": {"x": 0.2, "y": 0, "z": 0}}'


def fish(**parts):
    """The fish, with parts exchanged."""
    usual = {
        "density": 1000,
        "viscosity": 0.001,
        "wind": "0 0 0",
        "gravcomp": 1,
        "joint": "<freejoint/>",
        "fin": "fin",
        "more": "",
        "actuators": ACTUATORS,
    }
    return FISH.format(**(usual | parts))


def vehicle(*effects, attributes="", option=""):
    """The vehicle with these effects; attributes: name -> value."""
    configs = "".join(f'<config key="{key}" value="{value}"/>' for key, value in dict(attributes or {}).items())
    return VEHICLE.format(effects=", ".join(effects), attributes=configs, option=option)
