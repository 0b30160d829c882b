"""The MJCF that a tool gets: dry, or with any parts of the water.

Dry is what a user has who built the vehicle from its CAD: mass, inertia, thrusters, sensors, and gravity compensated
on the hull (`gravcomp="1"`), since a vehicle without water would fall. With water, the buoyancy is a weightless child
at the centre of buoyancy whose gravity compensation lifts it; everything else stands in `effects` of `hydro.wrench`.
"""

import json

import numpy as np

from . import numbers
from .parts import Part

#: Noise of the sensors: standard deviations [m], [rad], [rad/s], [m/s], [m/s^2], [gauss].
NOISE = {"position": 0.01, "attitude": 0.005, "gyro": 0.005, "dvl": 0.01, "accelerometer": 0.08, "compass": 0.003}
#: Sensors of a suite. `dvl`: a DVL, a gyro, a compass (the earth's field), and of the position the depth alone.
SUITES = {
    "full": ("position", "attitude", "gyro", "dvl", "accelerometer"),
    "dvl": ("position", "gyro", "dvl", "compass"),
}
#: Components of a sensor that a suite logs, where not all.
LOGGED = {"full": {}, "dvl": {"position": (2,)}}
#: Columns of fossen.Motion.readings.
COLUMNS = {
    "position": slice(0, 3),
    "attitude": slice(3, 7),
    "gyro": slice(7, 10),
    "dvl": slice(10, 13),
    "accelerometer": slice(13, 16),
    "compass": slice(16, 19),
}
STEP = 0.004
#: Mass of the child that carries the buoyancy [kg].
_SPECK = 1e-6
_AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")


def mjcf(parts: frozenset[Part], suite: str, noise: float = 1.0, configuration: str = "heavy") -> str:
    """The nominal with these parts of the water; noise of every sensor times `noise`."""
    dry = not parts
    hull = f"""<inertial pos="0 0 0" mass="{numbers.MASS}" diaginertia="{_row(numbers.INERTIA)}"/>
      <geom name="hull" type="box" size="{_row(numbers.EXTENTS / 2)}" rgba="0.2 0.4 0.8 1"/>
      <site name="imu" pos="{_row(numbers.IMU)}" size="0.01"/>
      <site name="dvl" pos="{_row(numbers.DVL)}" size="0.01"/>"""
    places, axes = numbers.PLACES[configuration], numbers.AXES[configuration]
    for i, (place, axis) in enumerate(zip(places, axes), 1):
        hull += f'\n      <site name="thruster_{i}" pos="{_row(place)}" zaxis="{_row(axis)}" size="0.03"/>'
    extension = ""
    if not dry:
        lift = numbers.DENSITY * numbers.VOLUME if Part.NET_BUOYANCY in parts else numbers.MASS
        centre = numbers.BUOYANCY_CENTRE if Part.BUOYANCY_OFFSET in parts else np.zeros(3)
        speck = f'<inertial pos="0 0 0" mass="{_SPECK}" diaginertia="1e-14 1e-14 1e-14"/>'
        hull += f"""
      <body name="hull_buoyancy" pos="{_row(centre)}" gravcomp="{lift / _SPECK:.10g}">{speck}</body>"""
        water = effects(parts)
        if water:
            hull += '\n      <plugin plugin="hydro.wrench" instance="water"/>'
            text = json.dumps({"schema": "hydro-effects/1", "effects": water})
            extension = f"""
  <extension>
    <plugin plugin="hydro.wrench">
      <instance name="water">
        <config key="effects" value='{text}'/>
      </instance>
    </plugin>
  </extension>"""
    motors = "\n    ".join(
        f'<motor name="thruster_{i}" site="thruster_{i}" gear="0 0 {numbers.THRUST:g} 0 0 0" ctrlrange="-1 1"/>'
        for i in range(1, len(places) + 1)
    )
    lines = {
        "position": '<framepos name="position" objtype="xbody" objname="hull" noise="{}"/>',
        "attitude": '<framequat name="attitude" objtype="xbody" objname="hull" noise="{}"/>',
        "gyro": '<gyro name="gyro" site="imu" noise="{}"/>',
        "dvl": '<velocimeter name="dvl" site="dvl" noise="{}"/>',
        "accelerometer": '<accelerometer name="accelerometer" site="imu" noise="{}"/>',
        "compass": '<magnetometer name="compass" site="imu" noise="{}"/>',
    }
    sensors = "\n    ".join(lines[name].format(f"{NOISE[name] * noise:.6g}") for name in SUITES[suite])
    return f"""<mujoco model="bluerov2">
  <compiler angle="radian" autolimits="true" inertiafromgeom="false"/>
  <option timestep="{STEP}" integrator="RK4" magnetic="{_row(numbers.FIELD)}"/>{extension}
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    <body name="hull" pos="0 0 -2"{' gravcomp="1"' if dry else ""}>
      <freejoint name="base"/>
      {hull}
    </body>
  </worldbody>
  <actuator>
    {motors}
  </actuator>
  <sensor>
    {sensors}
  </sensor>
</mujoco>
"""


def effects(parts: frozenset[Part]) -> list[dict]:
    """Entries of `hydro.wrench` of these parts."""
    out = []
    for part, values in (
        (Part.ADDED_MASS, numbers.ADDED_MASS),
        (Part.LINEAR_DRAG, numbers.LINEAR_DRAG),
        (Part.QUADRATIC_DRAG, numbers.QUADRATIC_DRAG),
    ):
        if part in parts:
            parameters = {axis: float(value) for axis, value in zip(_AXES, values)}
            out.append({"effect": part.value, "target": "hull", "parameters": parameters})
    return out


def _row(values) -> str:
    return " ".join(f"{value:.8g}" for value in values)
