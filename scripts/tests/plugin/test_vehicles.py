"""Parts of vehicles in a plain MJCF against closed forms: fins, propellers, thrust curves, currents, united hulls."""

import json
import math
import unittest

import mujoco
import numpy as np
from scene import LIBRARY

RHO = 1000.0
TAU = 2 * math.pi
SIX = ("surge", "sway", "heave", "roll", "pitch", "yaw")
assert LIBRARY


def scene(effects, bodies, more="", timestep=0.002, gravity=0.0, **attributes):
    """The compiled scene of bodies, of which the first carries the water, and a data of it."""
    text = json.dumps({"schema": "hydro-effects/1", "effects": effects})
    given = {"effects": text, **attributes}
    config = "".join(
        f'<config key="{key}" value="{value.replace(chr(34), "&quot;")}"/>' for key, value in given.items()
    )
    model = mujoco.MjModel.from_xml_string(f"""
<mujoco>
  <option timestep="{timestep}" gravity="0 0 {-gravity}" integrator="implicitfast"/>
  <extension><plugin plugin="hydro.wrench"><instance name="water">{config}</instance></plugin></extension>
  <worldbody>{bodies}</worldbody>{more}
</mujoco>""")
    return model, mujoco.MjData(model)


def effect(name, target, **parameters):
    """One entry of an effects.json."""
    return {"effect": name, "target": target, "parameters": parameters}


def plate_or_foil(alpha, slope, stall, drag, induced):
    """Coefficients of lift and drag by R. W. Beard and T. W. McLain (2012), equations 4.9 and 4.10, with a plate of 1.2."""
    m, near = 50.0, stall
    blend = (1 + np.exp(-m * (alpha - near)) + np.exp(m * (alpha + near))) / (
        (1 + np.exp(-m * (alpha - near))) * (1 + np.exp(m * (alpha + near)))
    )
    plate = 1.2 * np.sign(alpha) * np.sin(alpha) ** 2 * np.cos(alpha)
    lift = (1 - blend) * slope * alpha + blend * plate
    resistance = drag + (1 - blend) * induced * (slope * alpha) ** 2 + blend * 1.2 * abs(np.sin(alpha)) ** 3
    return lift, resistance


class Fins(unittest.TestCase):
    NUMBERS = {"area": 0.03, "lift_slope": 3.4, "stall": 0.35, "drag": 0.013, "induced": 0.16}
    BODIES = """
      <body name="hull"><freejoint/><plugin plugin="hydro.wrench" instance="water"/>
        <geom type="capsule" size="0.1" fromto="-0.5 0 0 0.5 0 0" mass="30"/>
        <body name="elevator" pos="-0.6 0 0"><joint name="stock" axis="0 1 0"/>
          <geom type="box" size="0.05 0.15 0.004" mass="0.3"/></body>
      </body>"""

    def test_an_elevator_at_every_angle(self):
        model, data = scene([effect("fin", "elevator", **self.NUMBERS)], self.BODIES)
        speed = 1.7
        for angle in np.radians([-170, -90, -40, -25, -10, -2, 0, 3, 15, 21, 35, 90, 135, 180]):
            mujoco.mj_resetData(model, data)
            data.qvel[0] = speed
            data.joint("stock").qpos = angle
            mujoco.mj_forward(model, data)
            # Turned by `angle` about y its leading edge points down: it moves along its own x and z.
            alpha = math.atan2(math.sin(angle), math.cos(angle))
            lift, drag = plate_or_foil(
                alpha, *(self.NUMBERS[name] for name in ("lift_slope", "stall", "drag", "induced"))
            )
            pressure = 0.5 * RHO * self.NUMBERS["area"] * speed**2
            force = data.qfrc_passive
            np.testing.assert_allclose(force[0], -pressure * drag, atol=1e-6 * pressure)
            np.testing.assert_allclose(force[2], -pressure * lift, atol=1e-6 * pressure)
            # It acts at the stock: no moment there, the lever of the tail at the hull.
            np.testing.assert_allclose(data.joint("stock").qfrc_passive, 0, atol=1e-9)
            np.testing.assert_allclose(force[4], 0.6 * force[2], atol=1e-6 * pressure)

    def test_a_weather_vane_turns_into_the_flow(self):
        behind = effect("fin", "elevator", **self.NUMBERS, x=-0.04)
        model, data = scene([behind], self.BODIES, current="-1.5 0 0")
        data.joint("stock").qpos = 0.6
        weld = model.body("hull").dofadr[0]
        for _ in range(4000):
            data.qvel[weld : weld + 6] = 0
            mujoco.mj_step(model, data)
        self.assertLess(abs(data.joint("stock").qpos[0]), 1e-3)


class Propellers(unittest.TestCase):
    NUMBERS = {"diameter": 0.2, "thrust": 0.36, "thrust_slope": 0.41, "torque": 0.045, "torque_slope": 0.038}

    def scene(self, hull, motor, **attributes):
        """A propeller on the shaft of a hull."""
        bodies = f"""
          <body name="hull">{hull}<plugin plugin="hydro.wrench" instance="water"/>
            <geom type="box" size="0.5 0.2 0.2" mass="80"/>
            <body name="screw" pos="-0.6 0 0"><joint name="shaft" axis="1 0 0" armature="0.02"/>
              <geom type="cylinder" size="0.1 0.02" euler="0 90 0" mass="0.5"/></body>
          </body>"""
        actuator = f'<actuator><general joint="shaft" {motor}/></actuator>'
        numbers = {**self.NUMBERS, **attributes}
        return scene([effect("propeller", "screw", **numbers)], bodies, actuator, timestep=0.001)

    def test_at_bollard_pull_the_motor_turns_it_as_fast_as_its_torque_allows(self):
        model, data = self.scene('<joint name="rail" type="slide" axis="1 0 0"/>', 'gainprm="1"')
        torque = 2.0
        data.ctrl[0] = torque
        rail = model.joint("rail").dofadr[0]
        for _ in range(8000):
            data.qvel[rail] = 0
            mujoco.mj_step(model, data)
        spin = data.joint("shaft").qvel[0] / TAU
        self.assertAlmostEqual(RHO * self.NUMBERS["torque"] * spin**2 * 0.2**5, torque, delta=1e-3 * torque)
        thrust = RHO * self.NUMBERS["thrust"] * spin**2 * 0.2**4
        self.assertAlmostEqual(data.qfrc_passive[rail], thrust, delta=1e-6 * thrust)

    def test_the_hull_feels_the_reaction_of_the_motor(self):
        model, data = self.scene("<freejoint/>", 'gainprm="1"')
        data.ctrl[0] = 1.5
        mujoco.mj_forward(model, data)
        # At rest the screw has no torque of the water yet: motor and reaction cancel on the whole.
        whole = np.zeros((6, model.nv))
        mujoco.mj_jacBody(model, data, whole[:3], whole[3:], model.body("hull").id)
        np.testing.assert_allclose(data.qacc[3] < 0 < data.qacc[6], True)
        inertia = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, inertia)
        self.assertAlmostEqual(float((inertia @ data.qacc)[3]), 0.0, places=9)
        self.assertAlmostEqual(float((inertia @ data.qacc)[6]), 1.5, places=9)

    def test_ahead_it_settles_where_thrust_is_drag_and_a_left_handed_one_mirrors_it(self):
        finals = []
        for sign in (1, -1):
            hull = '<joint name="rail" type="slide" axis="1 0 0" damping="30"/>'
            model, data = self.scene(hull, 'gainprm="1"', thrust=sign * 0.36)
            data.ctrl[0] = sign * 3.0
            for _ in range(20000):
                mujoco.mj_step(model, data)
            speed, spin = data.joint("rail").qvel[0], data.joint("shaft").qvel[0] / TAU
            finals.append((speed, sign * spin))
            advance = speed / (sign * spin * 0.2)
            thrust = RHO * spin**2 * 0.2**4 * (0.36 - 0.41 * advance)
            self.assertAlmostEqual(thrust, 30 * speed, delta=1e-3 * thrust)
            torque = RHO * spin**2 * 0.2**5 * (0.045 - 0.038 * advance)
            self.assertAlmostEqual(torque, 3.0, delta=1e-3 * torque)
        np.testing.assert_allclose(finals[0], finals[1], rtol=1e-9)


class ThrustCurves(unittest.TestCase):
    T200 = {"forward": 51.5, "reverse": 40.2, "width": 0.075}
    BODIES = """
      <body name="hull"><freejoint/><plugin plugin="hydro.wrench" instance="water"/>
        <geom type="box" size="0.3 0.2 0.1" mass="12"/><site name="port" pos="-0.2 0.15 0" euler="0 0 30"/></body>"""

    def scene(self, motor="", effects=()):
        """A hull with one thruster."""
        actuator = (
            f'<actuator><general name="port" site="port" gear="1 0 0 0 0 0" ctrlrange="-1 1" {motor}/></actuator>'
        )
        return scene([effect("thrust_curve", "port", **self.T200), *effects], self.BODIES, actuator)

    @classmethod
    def thrust(cls, command):
        """Thrust by the data sheet."""
        share = (max(abs(command) - 0.075, 0) / 0.925) ** 2
        return cls.T200["forward"] * share if command > 0 else -cls.T200["reverse"] * share

    def test_it_pushes_as_the_data_sheet_says_within_the_limits_of_the_command(self):
        model, data = self.scene()
        along = np.array([math.cos(math.pi / 6), math.sin(math.pi / 6), 0])
        for command in (-3, -1, -0.4, -0.05, 0, 0.07, 0.3, 1, 2):
            data.ctrl[0] = command
            mujoco.mj_forward(model, data)
            whole = data.qfrc_passive + data.qfrc_actuator
            np.testing.assert_allclose(whole[:3], self.thrust(np.clip(command, -1, 1)) * along, atol=1e-9)

    def test_it_follows_an_activation(self):
        model, data = self.scene('dyntype="filterexact" dynprm="0.15"')
        data.ctrl[0] = 1.0
        for _ in range(100):
            mujoco.mj_step(model, data)
        mujoco.mj_forward(model, data)
        speed = 1 - math.exp(-0.2 / 0.15)
        self.assertAlmostEqual(data.act[0], speed, places=6)
        whole = np.linalg.norm((data.qfrc_passive + data.qfrc_actuator)[:3])
        self.assertAlmostEqual(whole, self.thrust(speed), places=4)

    def test_it_loses_thrust_with_inflow(self):
        model, data = self.scene(effects=[effect("inflow_thrust_loss", "port", slope=0.3)])
        data.ctrl[0] = 1.0
        data.qvel[:3] = [math.cos(math.pi / 6), math.sin(math.pi / 6), 0]
        mujoco.mj_forward(model, data)
        whole = np.linalg.norm((data.qfrc_passive + data.qfrc_actuator)[:3])
        self.assertAlmostEqual(whole, 0.7 * 51.5, places=9)


class CurrentOnAGrid(unittest.TestCase):
    def test_a_float_drifts_with_the_water_where_and_when_it_is(self):
        grid = {
            "x": [0, 10],
            "time": [0, 100],
            "velocity": [[0.1, 0, 0], [0.5, 0, 0], [0.2, 0.2, 0], [0.6, 0.2, 0]],
        }
        current = json.dumps({"schema": "hydro-current/1", "grid": grid})
        bodies = """<body name="hull"><freejoint/><plugin plugin="hydro.wrench" instance="water"/>
                    <geom size="0.1" mass="4"/></body>"""
        axes = dict.fromkeys(SIX, 50.0)
        model, data = scene([effect("linear_drag", "hull", **axes)], bodies, current=current)
        for x, time in ((0, 0), (4, 30), (10, 100), (-5, 250), (25, 50)):
            data.qpos[0], data.time, data.qvel[:] = x, time, 0
            mujoco.mj_forward(model, data)
            along, when = np.clip(x / 10, 0, 1), np.clip(time / 100, 0, 1)
            water = [0.1 + 0.4 * along + 0.1 * when, 0.2 * when, 0]
            np.testing.assert_allclose(data.qfrc_passive[:3], 50 * np.array(water), atol=1e-12)


class HullsThatOverlap(unittest.TestCase):
    def lift(self, depth):
        """Buoyancy of two balls of 0.3 m that are 0.3 m apart [N]."""
        bodies = """<body name="hull" pos="0 0 0"><freejoint/><plugin plugin="hydro.wrench" instance="water"/>
          <geom size="0.3" pos="-0.15 0 0" mass="50"/><geom size="0.3" pos="0.15 0 0" mass="50"/></body>"""
        model, data = scene([effect("hydrostatics", "hull")], bodies, gravity=10, waterline="0")
        data.qpos[2] = -depth
        mujoco.mj_forward(model, data)
        return data.qfrc_passive[2]

    def test_they_displace_what_they_share_once(self):
        r, d = 0.3, 0.3
        lens = math.pi * (2 * r - d) ** 2 * (d * d + 4 * d * r) / (12 * d)
        union = 2 * 4 / 3 * math.pi * r**3 - lens
        for depth, part in ((1.0, 1.0), (0.0, 0.5), (-1.0, 0.0)):
            self.assertAlmostEqual(self.lift(depth), part * union * RHO * 10, delta=0.004 * union * RHO * 10)


class Windage(unittest.TestCase):
    def test_it_acts_on_what_is_out_of_the_water(self):
        bodies = """<body name="hull"><freejoint/><plugin plugin="hydro.wrench" instance="water"/>
          <geom type="box" size="1 0.4 0.3" mass="400"/></body>"""
        wind = effect("windage", "hull", x=0, y=9, z=0, surge=0.3, sway=1.1, heave=0, height=0.2, density=1.25)
        model, data = scene([wind], bodies, waterline="0", current="0.5 0 0")
        for height, dry in ((5, 1), (0.15, 0.75), (0, 0.5), (-0.3, 0), (-5, 0)):
            data.qpos[2], data.qvel[:] = height, 0
            mujoco.mj_forward(model, data)
            force = dry * 0.5 * 1.25 * 1.1 * 81
            np.testing.assert_allclose(data.qfrc_passive[[0, 1, 3]], [0, force, -0.2 * force], atol=1e-9)
            data.qvel[1] = 9
            mujoco.mj_forward(model, data)
            np.testing.assert_allclose(data.qfrc_passive, 0, atol=1e-9)


class WhatMujocoDoes(unittest.TestCase):
    """Parts that docs/water-without-a-network.md builds of MuJoCo's own elements."""

    def test_a_ballast_tank_lifts_by_its_volume_at_any_attitude(self):
        bodies = """<site name="still"/>
          <body name="hull"><freejoint/><plugin plugin="hydro.wrench" instance="water"/>
            <geom type="box" size="0.5 0.2 0.2" mass="80"/><site name="tank" pos="0.3 0 0"/></body>"""
        tank = """<actuator><general name="tank" site="tank" refsite="still" gear="0 0 1 0 0 0" dyntype="integrator"
          gainprm="9810" actlimited="true" actrange="-.002 .002"/></actuator>"""
        model, data = scene([effect("linear_drag", "hull", **dict.fromkeys(SIX, 0.0))], bodies, tank)
        data.ctrl[0] = 1e-4
        for _ in range(5000):
            mujoco.mj_step(model, data)
        self.assertAlmostEqual(data.act[0], 1e-3, places=6)
        mujoco.mju_euler2Quat(data.qpos[3:7], [0.4, -0.7, 1.0], "XYZ")
        mujoco.mj_forward(model, data)
        lift = 9810 * data.act[0]
        np.testing.assert_allclose(data.qfrc_actuator[:3], [0, 0, lift], atol=1e-9)
        arm = data.site("tank").xpos - data.body("hull").xpos
        torque = data.body("hull").xmat.reshape(3, 3).T @ np.cross(arm, [0, 0, lift])
        np.testing.assert_allclose(data.qfrc_actuator[3:], torque, atol=1e-9)

    def test_a_towed_cable_hangs_straight_where_drag_across_it_holds_its_weight(self):
        current, drag, mass, length, radius = 0.4, 1.1, 0.05, 0.2, 0.006
        links = [f"link_{n}" for n in range(12)]
        chain = ""
        for link in reversed(links):
            chain = f"""<body name="{link}" pos="0 0 {0 if link == links[0] else -length}">
              <joint type="ball" damping="0.001"/>
              <geom type="capsule" size="{radius}" fromto="0 0 0 0 0 {-length}" mass="{mass}"/>{chain}</body>"""
        bodies = f"""<body name="ship"><plugin plugin="hydro.wrench" instance="water"/>
          <joint type="slide" axis="1 0 0" range="-1e-9 1e-9" limited="true"/><geom size="0.1" mass="100"/>{chain}</body>"""
        effects = [effect("cross_flow_drag", link, surge=drag, sway=drag) for link in links]
        model, data = scene(effects, bodies, gravity=9.81, current=f"{current} 0 0")
        for _ in range(10000):
            mujoco.mj_step(model, data)
        self.assertLess(abs(data.qvel).max(), 1e-3)
        # Constant load along it, none at its end: straight, at the angle from the vertical where 1/2 rho C d L (U cos)^2 = m g sin.
        ends = np.array([data.body(link).xpos for link in links])
        along = np.diff(ends, axis=0)
        angles = np.arctan2(along[:, 0], -along[:, 2])
        load = 0.5 * RHO * drag * 2 * radius * (length + 2 * radius) * current**2
        weight = mass * 9.81
        sine = (-weight + math.sqrt(weight**2 + 4 * load**2)) / (2 * load)
        np.testing.assert_allclose(np.sin(angles), sine, rtol=0.02)


if __name__ == "__main__":
    unittest.main()
