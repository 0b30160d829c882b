"""A vehicle over a bottom, with water about it, that the tests of sensors read."""

import mujoco

import hydro_mujoco as hydro

#: A box with an instrument at its nose, a fin on a hinge, a translucent marker; a bottom that slides along x and turns about z.
SCENE = """<mujoco><option timestep="0.01"/><worldbody>
  <body name="bottom"><joint name="slide" type="slide" axis="1 0 0"/><joint name="turn"/>
    <geom name="bottom" type="box" size="{half} {half} 0.5" pos="0 0 {top}" mass="1000"/></body>
  {more}
  <body name="rov"><freejoint name="free"/>
    <geom type="box" size="0.3 0.2 0.15" mass="30"/>
    <site name="nose" pos="0.25 0.05 -0.1" quat="{mounted}"/>
    <body name="fin" pos="0.2 0 -0.3"><joint name="fin"/><geom type="box" size="0.15 0.15 0.02" mass="1"/></body></body>
  <body name="beacon" mocap="true" pos="0 0 -20"><geom size="0.1" mass="1"/><site name="beacon"/></body>
  <body name="buoy" pos="0 0 90"><freejoint/><geom size="0.1"/></body>
  <geom name="marker" type="plane" size="0 0 1" pos="0 0 -2.5" rgba="0 1 0 0.5" contype="0" conaffinity="0"/>
</worldbody></mujoco>"""
#: A plane and a wall, each with a site on it that looks off it.
ON_THE_WORLD = """<geom type="plane" size="0 0 1" pos="0 0 -9"/><site name="floor" pos="3 2 -9"/>
  <geom type="box" size="0.5 9 9" pos="6.5 0 0"/><site name="wall" pos="6 1 -3" zaxis="-1 0 0"/>"""
DRAG = dict.fromkeys(("surge", "sway", "heave", "roll", "pitch", "yaw"), 1.0)


def scene(depth=10.0, *, half=200.0, more="", mounted="1 0 0 0", waterline=0.0, two=False, **water):
    """Model and data of the vehicle at 2 m of depth, at rest; the bottom is at `depth` [m]; `two`: bodies have water."""
    text = SCENE.format(half=half, top=-depth - 0.5, more=more, mounted=mounted)
    spec = mujoco.MjSpec.from_string(text)
    effects = {"linear_drag": DRAG}
    hydro.add_water(spec, body="rov", effects=effects, waterline=waterline, **water)
    if two:
        hydro.add_water(spec, body="buoy", effects=effects, waterline=waterline, **water)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.joint("free").qpos[2] = -2.0
    mujoco.mj_forward(model, data)
    return model, data


def move(model, data, *, place=None, quat=None, velocity=None, rate=None, bottom=0.0, turn=0.0, time=None):
    """Set the vehicle's pose and velocity (world; rate along its axes), the bottom's speed and rate of turn, the time."""
    free = data.joint("free")
    if place is not None:
        free.qpos[:3] = place
    if quat is not None:
        free.qpos[3:] = quat
        mujoco.mju_normalize4(free.qpos[3:])
    if velocity is not None:
        free.qvel[:3] = velocity
    if rate is not None:
        free.qvel[3:] = rate
    data.joint("slide").qvel[0], data.joint("turn").qvel[0] = bottom, turn
    if time is not None:
        data.time = time
    mujoco.mj_forward(model, data)
    return data


#: Two vehicles in waters of their own, and a mast without one.
TWO_WATERS = """<mujoco><worldbody>
  <body name="low" pos="0 0 -2"><freejoint/><geom size="0.1"/></body>
  <body name="high" pos="0 0 {height}"{turn}><freejoint/><geom size="0.1"/></body>
  <body name="mast" pos="3 0 -2" mocap="true"><geom size="0.1"/></body>
</worldbody></mujoco>"""


def two_waters(height, turn=""):
    """Model and data of two vehicles, the waterlines at 0 and 5 m."""
    spec = mujoco.MjSpec.from_string(TWO_WATERS.format(height=height, turn=turn))
    for body, waterline in (("low", 0.0), ("high", 5.0)):
        hydro.add_water(spec, body=body, effects={"linear_drag": DRAG}, waterline=waterline)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data
