"""The experiments by name."""

import numpy as np
from scipy.integrate import solve_ivp

from .log import Columns, Experiment, harmonics

G, RHO = 9.81, 998.0


def _solved(slope, seconds: float, start: list[float], period: float) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and states [states, times] of an equation of motion."""
    times = np.arange(0, seconds, period)
    found = solve_ivp(slope, (0, seconds), start, t_eval=times, rtol=1e-8, atol=1e-10, max_step=0.1)
    return times, found.y


def _drag(linear: float, quadratic: float, speed: float) -> float:
    return linear * speed + quadratic * speed * abs(speed)


def surge() -> Experiment:
    """A torpedo of 34 kg on a level slide, its thruster's force commanded."""
    linear, quadratic, added, lag, thrust, step = 6.0, 22.0, 7.0, 0.18, 40.0, 0.01

    def run(_: int, rng: np.random.Generator) -> Columns:
        command = harmonics(rng, 0.05, 0.4)

        def slope(t: float, state: np.ndarray) -> list[float]:
            _, v, arrived = state
            return [v, (thrust * arrived - _drag(linear, quadratic, v)) / (34 + added), (command(t)[0] - arrived) / lag]

        times, (x, v, _) = _solved(slope, 20, [0, 0, 0], 0.02)
        return {
            "time": times,
            "x": x + 0.005 * rng.standard_normal(len(x)),
            "vx": v + 0.004 * rng.standard_normal(len(v)),
            "thrust": np.array([command(t)[0] for t in times + step]),
        }

    nominal = """<mujoco model="surge"><option timestep="0.01" integrator="implicitfast"/><worldbody>
  <body name="hull" pos="0 0 -2" gravcomp="1"><joint name="surge" type="slide" axis="1 0 0"/>
    <geom type="capsule" fromto="-.5 0 0 .5 0 0" size=".1" mass="34"/></body></worldbody>
<actuator><motor name="thrust" joint="surge" gear="40" ctrlrange="-1 1"/></actuator>
<sensor><jointpos name="x" joint="surge" noise="0.005"/>
  <jointvel name="vx" joint="surge" noise="0.004"/></sensor></mujoco>
"""
    truth = {"linear_drag.surge": linear, "quadratic_drag.surge": quadratic, "added_mass.surge": added}
    return Experiment(nominal, step, {**truth, "actuator_lag.time_constant": lag}, run, runs=5)


def boat(current: tuple[float, float] = (0.0, 0.0)) -> Experiment:
    """A model ship of 23.8 kg after CyberShip II (Skjetne et al., Automatica 41(2), 2005): diagonal, no cubic drag."""
    mass, inertia, step = 23.8, 1.76, 0.01
    added, linear, quadratic = np.array([2.0, 10.0, 1.0]), np.array([0.72, 0.89, 1.9]), np.array([1.33, 36.5, 0.75])
    most = np.array([2.0, 2.0, 1.0])
    matrix = np.array([mass, mass, inertia]) + added

    def run(_: int, rng: np.random.Generator) -> Columns:
        command = harmonics(rng, 0.02, 0.15, 3)

        def slope(t: float, state: np.ndarray) -> list[float]:
            heading, r = state[2], state[5]
            turn = np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]])
            u, v = turn.T @ (state[3:5] - current)
            coriolis = np.array([-matrix[1] * v * r, matrix[0] * u * r, (added[1] - added[0]) * u * v])
            nu = np.array([u, v, r])
            change = (most * command(t) - coriolis - linear * nu - quadratic * np.abs(nu) * nu) / matrix
            across = turn @ (change[:2] + r * np.array([-v, u]))
            return [*state[3:6], *across, change[2]]

        times, state = _solved(slope, 40, [0, 0, rng.uniform(-3, 3), 0, 0, 0], 0.05)
        noisy = {"px": (0, 0.01), "py": (1, 0.01), "heading": (2, 0.004), "rate": (5, 0.003)}
        readings = {name: state[row] + sd * rng.standard_normal(len(times)) for name, (row, sd) in noisy.items()}
        commands = np.array([most * command(t) for t in times + step])
        return {"time": times, **readings, **dict(zip(("fx", "fy", "mz"), commands.T))}

    nominal = """<mujoco model="boat"><option timestep="0.01" integrator="implicitfast"/><worldbody>
  <body name="boat"><joint name="x" type="slide" axis="1 0 0"/><joint name="y" type="slide" axis="0 1 0"/>
    <joint name="psi" axis="0 0 1"/><inertial mass="23.8" pos="0 0 0" diaginertia="0.4 1.7 1.76"/>
    <geom type="box" size=".6 .15 .1" mass="0"/><site name="c"/></body></worldbody>
<actuator><motor name="fx" site="c" gear="1 0 0 0 0 0"/><motor name="fy" site="c" gear="0 1 0 0 0 0"/>
  <motor name="mz" site="c" gear="0 0 0 0 0 1"/></actuator>
<sensor><jointpos name="px" joint="x" noise="0.01"/><jointpos name="py" joint="y" noise="0.01"/>
  <jointpos name="heading" joint="psi" noise="0.004"/>
  <jointvel name="rate" joint="psi" noise="0.003"/></sensor></mujoco>
"""
    named = {"added_mass": added, "linear_drag": linear, "quadratic_drag": quadratic}
    truth = {
        f"{name}.{axis}": of for name, values in named.items() for axis, of in zip(("surge", "sway", "yaw"), values)
    }
    if any(current):
        truth |= {"current.x": current[0], "current.y": current[1]}
    return Experiment(nominal, step, truth, run, runs=6)


def heave() -> Experiment:
    """A BlueROV2 in heave (public numbers: 14.57 kg, 5.18 N s/m, 36.99 N s^2/m^2), 11.8 L, its depth alone measured."""
    mass, buoyancy, added, linear, quadratic, thrust, step = 11.5, RHO * 0.0118 * G, 14.57, 5.18, 36.99, 60.0, 0.005

    def run(_: int, rng: np.random.Generator) -> Columns:
        command = harmonics(rng, 0.03, 0.25)

        def slope(t: float, state: np.ndarray) -> list[float]:
            force = thrust * command(t)[0] - _drag(linear, quadratic, state[1]) + buoyancy - mass * G
            return [state[1], force / (mass + added)]

        times, (z, _) = _solved(slope, 30, [-15, 0], 0.1)
        z = z + 0.004 * rng.standard_normal(len(z))
        return {"time": times, "z": z, "thruster": np.array([command(t)[0] for t in times + step])}

    nominal = """<mujoco model="heave"><option timestep="0.005" integrator="implicitfast"/><worldbody>
  <body name="rov"><joint name="heave" type="slide" axis="0 0 1"/>
    <geom type="box" size=".228 .169 .0765" mass="11.5"/></body></worldbody>
<actuator><motor name="thruster" joint="heave" gear="60" ctrlrange="-1 1"/></actuator>
<sensor><jointpos name="z" joint="heave" noise="0.004"/></sensor></mujoco>
"""
    truth = {"linear_drag.heave": linear, "quadratic_drag.heave": quadratic, "added_mass.heave": added}
    return Experiment(nominal, step, {**truth, "net_buoyancy.force": buoyancy}, run, runs=5)


def tank() -> Experiment:
    """A hull of 12 kg swayed by a carriage, the force on it by a load cell."""
    added, linear, quadratic = 15.0, 8.0, 90.0
    motions = [(0.1, 4.0), (0.2, 4.0), (0.2, 8.0), (0.3, 6.0), (0.1, 2.5)]

    def run(number: int, rng: np.random.Generator) -> Columns:
        amplitude, period = motions[number]
        times, omega = np.arange(0, 24, 0.02), 2 * np.pi / period
        y = amplitude * np.sin(omega * times)
        v = omega * amplitude * np.cos(omega * times)
        # What the carriage exerts on the hull.
        force = -(12 + added) * omega**2 * y + linear * v + quadratic * v * np.abs(v)
        return {"time": times, "sway": y, "force[1]": force + 0.3 * rng.standard_normal(len(times))}

    nominal = """<mujoco model="tank"><option timestep="0.005"/><worldbody>
  <body name="carriage" pos="0 0 -1"><joint name="sway" type="slide" axis="0 1 0"/>
    <geom size=".01" mass=".1" contype="0"/>
    <body name="hull"><geom type="ellipsoid" size=".5 .12 .1" mass="12"/><site name="cell"/></body></body></worldbody>
<sensor><force name="force" site="cell" noise="0.3"/></sensor></mujoco>
"""
    truth = {"linear_drag.sway": linear, "quadratic_drag.sway": quadratic, "added_mass.sway": added}
    return Experiment(nominal, 0.005, truth, run, runs=len(motions))


def pendulum() -> Experiment:
    """A ball of 3.5 kg and 80 mm radius on a rod of half a metre, let go at an angle."""
    radius, mass, rod, friction = 0.08, 3.5, 0.5, 0.02
    water = RHO * 4 / 3 * np.pi * radius**3
    drag = 0.5 * RHO * 0.47 * np.pi * radius**2
    inertia = mass * rod**2 + 0.4 * mass * radius**2 + 0.5 * water * rod**2
    angles = [0.8, 1.2, -0.6, 1.5]

    def run(number: int, rng: np.random.Generator) -> Columns:
        def slope(_: float, state: np.ndarray) -> list[float]:
            angle, rate = state
            righting = (mass - water) * G * rod * np.sin(angle)
            torque = -righting - drag * rod**3 * rate * abs(rate) - friction * np.tanh(rate / 0.02)
            return [rate, torque / inertia]

        times, (angle, _) = _solved(slope, 12, [angles[number], 0], 0.02)
        return {"time": times, "angle": angle + 0.002 * rng.standard_normal(len(times))}

    nominal = """<mujoco model="pendulum"><option timestep="0.002" integrator="implicitfast"/><worldbody>
  <body name="bob" pos="0 0 -2"><joint name="pin" axis="0 1 0"/>
    <geom size=".08" pos="0 0 -.5" mass="3.5"/></body></worldbody>
<sensor><jointpos name="angle" joint="pin" noise="0.002"/></sensor></mujoco>
"""
    truth = {"net_buoyancy.force": water * G, "quadratic_drag.surge": drag, "joint_friction.coulomb": friction}
    return Experiment(nominal, 0.002, {**truth, "added_mass.surge": 0.5 * water}, run, runs=len(angles))


EXPERIMENTS = {
    "surge": surge(),
    "boat": boat(),
    "boat_current": boat((0.12, -0.06)),
    "heave": heave(),
    "tank": tank(),
    "pendulum": pendulum(),
}
