"""The library in the MuJoCo wheel, and scenes: a fish in water that it makes, a trunk on a load cell.

Needs HYDRO_TEST_LIBRARY (libhydro_plugin.so) and HYDRO_TEST_CHECKPOINTS (a folder with the test checkpoints
lively, memoryless, constant, towing and b1, and with kinds, a folder of one of every kind of model);
`cargo test --test plugin python::` sets both and runs every file here.
"""

import os
import pathlib
import unittest

import mujoco
import numpy as np

if "HYDRO_TEST_LIBRARY" not in os.environ:
    raise unittest.SkipTest("run by cargo test --test plugin python::, which makes the checkpoints")
LIBRARY = os.environ["HYDRO_TEST_LIBRARY"]
CHECKPOINTS = pathlib.Path(os.environ["HYDRO_TEST_CHECKPOINTS"])
KINDS = sorted((CHECKPOINTS / "kinds").iterdir())

mujoco.mj_loadPluginLibrary(LIBRARY)

FISH = """
<mujoco>
  <option timestep="{timestep}" gravity="0 0 0" integrator="{integrator}" {option}/>
  <size memory="4M"/>
  <extension>
    <plugin plugin="hydro.wrench"><instance name="water">{config}</instance></plugin>
  </extension>
  <worldbody>
    <body name="hull">{joint}
      <plugin plugin="hydro.wrench" instance="water"/>
      <geom type="ellipsoid" size="0.3 0.1 0.12" mass="12"/>
      <body name="fin" pos="-0.3 0 0">
        <joint name="{fin}" axis="0 0 1" damping="0.1"/>
        <geom type="capsule" size="0.02" fromto="0 0 0 -0.2 0 0" mass="1"/>
        {more}
      </body>
    </body>
    {bodies}
  </worldbody>
  <actuator><motor name="fin" joint="{fin}"/></actuator>
  <sensor><plugin name="water" plugin="hydro.wrench" instance="water"/></sensor>
</mujoco>
"""


# A trunk held on a gantry, welded below the cell, with a swinging leg.
TANK = """
<mujoco>
  <option timestep="0.002" {fluid}/>
  <extension>
    {wrench}
    <plugin plugin="hydro.load_cell"/>
  </extension>
  <worldbody>
    <body name="carriage" pos="0 0 2"><joint name="rail" type="slide" axis="1 0 0"/>
      <joint name="cross" type="slide" axis="0 1 0"/>
      <geom size="0.1" mass="5"/>
      <body name="beam" pos="0.1 0.2 -0.5" euler="20 -10 35">
        <site name="cell" pos="0.05 0.02 0.1" euler="10 20 30"/>
        <geom type="box" size="0.05 0.04 0.3" mass="1" {coefficients}/>
        <body name="trunk" pos="0 0 -0.4" {gravcomp}>{carried}
          <geom type="ellipsoid" size="0.4 0.15 0.1" mass="20" {coefficients}/>
          <body name="leg" pos="0.3 0 0"><joint name="thigh" axis="0 1 0" damping="1"/>
            <geom type="capsule" size="0.03" fromto="0 0 0 0 0 -0.35" mass="2"/>
            <body name="shin" pos="0 0 -0.35"><joint name="calf" axis="0 1 0" damping="1"/>
              <geom type="capsule" size="0.02" fromto="0 0 0 0 0 -0.35" mass="1"/>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <sensor>
    <force name="plain force" site="cell"/><torque name="plain torque" site="cell"/>
    <plugin name="force" plugin="hydro.load_cell"><config key="site" value="cell"/>{include}</plugin>
    <plugin name="torque" plugin="hydro.load_cell"><config key="site" value="cell"/>
      <config key="quantity" value="torque"/>{include}</plugin>
    {water}
  </sensor>
</mujoco>
"""


def fish_xml(attributes=None, **parts):
    attributes = {"checkpoint": str(CHECKPOINTS / "lively"), **(attributes or {})}
    config = "".join(f'<config key="{k}" value="{v}"/>' for k, v in attributes.items() if v is not None)
    defaults = dict(timestep=0.002, integrator="Euler", option="", joint="<freejoint/>", fin="fin", more="", bodies="")
    return FISH.format(config=config, **{**defaults, **parts})


def fish(attributes=None, **parts):
    return mujoco.MjModel.from_xml_string(fish_xml(attributes, **parts))


def start(model, seed=0, control=0.2):
    """A simulation in a random state of motion, with a control (or one an actuator)."""
    data = mujoco.MjData(model)
    random = np.random.default_rng(seed)
    data.qvel[:] = 0.3 * random.standard_normal(model.nv)
    quaternion = random.standard_normal(4)
    data.qpos[3:7] = quaternion / np.linalg.norm(quaternion)
    data.ctrl[:] = control
    return data


def state_of(model, data):
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, state, kind)
    return state


def steps(model, data, count):
    """Steps, and returns everything that must repeat bit for bit."""
    rows = []
    for _ in range(count):
        mujoco.mj_step(model, data)
        rows.append(np.concatenate([data.qpos, data.qvel, data.sensordata, data.plugin_state]))
    return np.array(rows)


class Warnings:
    """Collects MuJoCo's warnings."""

    def __enter__(self):
        self.texts = []
        mujoco.set_mju_user_warning(self.texts.append)
        return self.texts

    def __exit__(self, *_):
        mujoco.set_mju_user_warning(None)
