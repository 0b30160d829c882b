"""The robots. Each says what of its MJCF was changed and why, and how it is driven.

Their files load in MuJoCo 4.0.0 as they stand, but for the swimmer, which its package completes in Python. Integrators:
where the original steps by Euler's rule, whose error at its step is more than the sensors' noise here, the nominal is
given Runge-Kutta (or a finer step): that error is another gap than those that are hidden.
"""

from collections.abc import Callable

import mujoco
import numpy as np

from ..hidden_cases.effects import Effect
from ..hidden_cases.systems.generic import Generic, Robot
from . import mend
from .wheels import Wheels

SENSOR = mujoco.mjtSensor
RK4 = mujoco.mjtIntegrator.mjINT_RK4
_JOINTS = ("joint_friction", "joint_damping", "joint_stiffness", "actuator_gain")


def _finish(spec: mujoco.MjSpec, name: str, base: str, qpos=None, **how) -> Robot:
    """The robot of a mended spec: commands and start in the middle of what is allowed, where not given."""
    xml = spec.to_xml()
    model = mujoco.MjModel.from_xml_string(xml)
    for what in ("middle", "reach"):
        how[what] = np.broadcast_to(np.asarray(how[what], float), (model.nu,)).copy()
    start = model.qpos0.copy() if qpos is None else np.asarray(qpos, float)
    return Robot(name=name, xml=xml, base=base, qpos=start, **how)


def cartpole(wheels: Wheels) -> Robot:
    """Cart and pole of dm-control, the pole hanging (upright it falls, and a tenth of a second decides where)."""
    spec = mend.bare(mend.load(wheels.path("dm_control/suite/cartpole.xml")))
    mend.encoders(spec, 1e-3, 1e-2)
    return _finish(
        spec, "cartpole", "cart", [0.0, np.pi], middle=0.0, reach=0.25, period=0.02, band=(0.2, 1.2),
        hold={0: ("slider", 0.3, 0.1)}, spread=0.2, com=0.001, effects=(*_JOINTS, "payload", "actuator_delay"),
    )  # fmt: skip


def acrobot(wheels: Wheels) -> Robot:
    """Two links of dm-control with a motor at the elbow, hanging."""
    spec = mend.bare(mend.load(wheels.path("dm_control/suite/acrobot.xml")))
    mend.encoders(spec, 1e-3, 1e-2)
    return _finish(
        spec, "acrobot", "lower_arm", [np.pi, 0.0], middle=0.0, reach=0.35, period=0.02, band=(0.2, 1.0),
        spread=0.3, com=0.002, effects=(*_JOINTS, "payload"),
    )  # fmt: skip


def swimmer(wheels: Wheels) -> Robot:
    """Three links in MuJoCo's fluid by inertia boxes; the links are added as dm-control does it in Python."""
    spec = mend.load(wheels.path("dm_control/suite/swimmer.xml"))
    parent, default = spec.body("head"), spec.find_default("swimmer")
    inertial, visual = spec.find_default("inertial"), spec.find_default("visual")
    for i in range(2):
        parent = parent.add_body(name=f"segment_{i}", pos=[0, 0.1, 0])
        parent.add_geom(inertial, name=f"inertial_{i}")
        parent.add_geom(visual, name=f"visual_{i}")
        parent.add_joint(default, name=f"joint_{i}", range=[-120, 120])
        parent.add_site(default, name=f"site_{i}")
        motor = spec.add_actuator(name=f"motor_{i}", target=f"joint_{i}")
        motor.trntype, motor.gear[0] = mujoco.mjtTrn.mjTRN_JOINT, 5e-4
        motor.ctrllimited, motor.ctrlrange = True, [-1, 1]
    mend.bare(spec)
    mend.own_sensors(spec, {SENSOR.mjSENS_GYRO: 0.02, SENSOR.mjSENS_VELOCIMETER: 0.003})
    mend.encoders(spec, 2e-3, 0.02)
    spec.option.integrator = RK4
    return _finish(
        spec, "swimmer", "head", middle=0.0, reach=0.4, period=0.02, band=(0.4, 1.5), com=2e-4, spread=0.1,
        hold={0: ("joint_0", 0.25, 0.02), 1: ("joint_1", 0.25, 0.02)},
        effects=(*_JOINTS, "current", "payload"),
    )  # fmt: skip


def fish(wheels: Wheels) -> Robot:
    """A fish with a tail and two fins; dm-control's own IMU, a camera system, encoders. Its gravity is off."""
    spec = mend.bare(mend.load(wheels.path("dm_control/suite/fish.xml")))
    mend.own_sensors(spec, {SENSOR.mjSENS_GYRO: 0.01, SENSOR.mjSENS_VELOCIMETER: 0.003})
    mend.tracked(spec, "torso", 1e-3, 4e-3)
    mend.encoders(spec, 2e-3, None)
    spec.option.integrator = RK4
    return _finish(
        spec, "fish", "torso", middle=0.0, reach=[0.7, 0.3, 0.5, 0.4, 0.4], period=0.02, band=(0.5, 2.0), com=2e-4,
        effects=(*_JOINTS, "current", "constant_force", "actuator_delay"),
    )  # fmt: skip


def fish_dry(wheels: Wheels) -> Robot:
    """The same fish in a nominal without any water, the truth in that of the file."""
    robot = fish(wheels)
    spec = mujoco.MjSpec.from_string(robot.xml)
    spec.option.density = 0.0
    robot.name, robot.xml = "fish_dry", spec.to_xml()
    return robot


def quadruped(wheels: Wheels) -> Robot:
    """Twelve filtered servos on joints and tendons, the torso on a stand, without the ball on the floor."""
    spec = mend.load(wheels.path("dm_control/suite/quadruped.xml"))
    mend.on_a_stand(spec, "ball")
    mend.bare(spec)
    mend.own_sensors(spec, {})
    mend.encoders(spec, 1e-3, 1e-2)
    spec.option.timestep, spec.option.integrator = 0.0025, RK4
    return _finish(
        spec, "quadruped", "toe_front_left", middle=0.0, spread=0.0, reach=0.18, period=0.02, band=(0.2, 1.2),
        effects=("joint_friction", "joint_damping", "joint_stiffness", "actuator_gain", "payload"),
    )  # fmt: skip


def dog(wheels: Wheels) -> Robot:
    """A dog of 38 filtered muscles and 79 joints, the torso on a stand; springs stand for its stops.

    Too stiff for Runge-Kutta: `implicitfast` at 1 ms, whose error is the largest of all (`stepping` in its answers).
    """
    spec = mend.load(wheels.path("dm_control/suite/dog.xml"))
    for name in [body.name for body in spec.worldbody.bodies if body.name not in ("torso",)]:
        spec.delete(spec.body(name))
    mend.on_a_stand(spec)
    mend.springs_for_stops(spec, 0.3)
    mend.bare(spec)
    mend.own_sensors(spec, {})
    mend.encoders(spec, 5e-3, None)
    spec.option.timestep, spec.option.integrator = 0.001, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    middle = spec.compile().qpos_spring
    return _finish(
        spec, "dog", "torso", middle, middle=0.0, reach=0.3, period=0.03, band=(0.2, 1.0),
        runge_kutta=False, spread=0.02, effects=("joint_friction", "joint_damping", "joint_stiffness", "actuator_gain"),
    )  # fmt: skip


def _arm(spec: mujoco.MjSpec, name: str, joints: list[str], q: list[float]) -> Robot:
    base = spec.joint(joints[-1]).parent.name
    mend.bare(spec)
    spec.option.timestep, spec.option.integrator = 0.002, RK4
    mend.servos(spec, joints, np.array(q))
    mend.encoders(spec, 2e-4, 5e-3)
    return _finish(
        spec, name, base, q, middle=q, reach=0.45, period=0.02, band=(0.15, 0.7), spread=0.01,
        effects=(*_JOINTS, "joint_armature", "payload", "joint_backlash", "actuator_delay"),
    )  # fmt: skip


def panda(wheels: Wheels) -> Robot:
    """Panda of robosuite; its torque motors are driven by a servo in software there, by MuJoCo's here."""
    spec = mend.load(wheels.path("robosuite/models/assets/robots/panda/robot.xml"))
    joints = [f"joint{i}" for i in range(1, 8)]
    return _arm(spec, "panda", joints, [0, 0.3, 0, -1.8, 0, 2.0, 0.5])


def iiwa(wheels: Wheels) -> Robot:
    """IIWA of robosuite, changed as the Panda."""
    spec = mend.load(wheels.path("robosuite/models/assets/robots/iiwa/robot.xml"))
    joints = [f"joint_{i}" for i in range(1, 8)]
    return _arm(spec, "iiwa", joints, [0, 0.4, 0, -1.2, 0, 0.9, 0.0])


def sawyer(wheels: Wheels) -> Robot:
    """Sawyer of robosuite, changed as the Panda."""
    spec = mend.load(wheels.path("robosuite/models/assets/robots/sawyer/robot.xml"))
    joints = [f"right_j{i}" for i in range(7)]
    return _arm(spec, "sawyer", joints, [0, -0.8, 0, 1.6, 0, 0.6, 0.5])


def fetch(wheels: Wheels) -> Robot:
    """Fetch of gymnasium-robotics: base, torso, head and fingers welded (their damping of 1e3 to 1e11 did that); servos
    in place of the mocap body that pulls the gripper there.
    """
    spec = mend.load(wheels.path("gymnasium_robotics/envs/assets/fetch/reach.xml"))
    for equality in list(spec.equalities):
        spec.delete(equality)
    for name in ("floor0", "table0", "robot0:mocap"):
        if spec.body(name) is not None:
            spec.delete(spec.body(name))
    mend.held(
        spec,
        *[j.name for j in spec.joints if any(w in j.name for w in ("slide", "torso", "head", "finger"))],
    )
    joints = [j.name for j in spec.joints]
    return _arm(spec, "fetch", joints, [0.0, 0.2, 0.3, 0.8, 0.0, 0.7, 0.0])


def hand(wheels: Wheels) -> Robot:
    """Shadow hand of gymnasium-robotics with its own servos and joint sensors. Its stops are left away, and the four
    distal joints, that only stops hold, are welded.
    """
    spec = mend.load(wheels.path("gymnasium_robotics/envs/assets/hand/reach.xml"))
    for body in list(spec.worldbody.bodies):
        if "floor" in body.name:
            spec.delete(body)
    for tendon in list(spec.tendons):
        spec.delete(tendon)
    mend.without_limits(spec)
    gone = {f"robot0:{finger}J0" for finger in ("FF", "MF", "RF", "LF")}
    for sensor in list(spec.sensors):
        if sensor.objname in gone:
            spec.delete(sensor)
    mend.held(spec, *sorted(gone))
    mend.bare(spec)
    mend.own_sensors(spec, {SENSOR.mjSENS_JOINTPOS: 2e-3})
    mend.encoders(spec, 2e-3, 0.05)
    spec.option.timestep, spec.option.integrator = 0.002, RK4
    ranges = np.array([actuator.ctrlrange for actuator in spec.actuators])
    return _finish(
        spec, "hand", spec.body(spec.joint("robot0:FFJ1").parent.name).name,
        middle=ranges.mean(1), reach=0.35 * (ranges[:, 1] - ranges[:, 0]), period=0.02, band=(0.2, 1.0),
        com=1e-3, spread=0.02, effects=(*_JOINTS, "joint_backlash"),
    )  # fmt: skip


#: Joints of a UR5e: torque about the middle [N m], rotor inertia [kg m^2], noise of the torque's log [N m].
_UR5E = {
    "shoulder_pan_joint": (12.0, 0.1, 0.15),
    "elbow_joint": (10.0, 0.1, 0.15),
    "wrist_1_joint": (0.8, 0.02, 0.045),
}


def _one_joint(wheels: Wheels, name: str, joint: str) -> Robot:
    """One joint of a UR5e of robosuite, driven by torque, the others welded; the torque is logged with noise.

    The file has no rotor inertia; there is one here. Its dry friction of 0.01 N m is left away: MuJoCo's constraint
    differs with the step. Encoders of 17 bits, rows at 125 Hz, as that robot has them. The torque's noise, not the
    encoders', is what hides an effect: friction and damping are 5 to 50 % of the inertial torque.
    """
    reach, rotor, noise = _UR5E[joint]
    spec = mend.load(wheels.path("robosuite/models/assets/robots/ur5e/robot.xml"))
    for actuator in list(spec.actuators):
        if actuator.target != joint:
            spec.delete(actuator)
    mend.held(spec, *[j.name for j in spec.joints if j.name != joint])
    spec.joint(joint).armature, spec.joint(joint).frictionloss = rotor, 0.0
    base = spec.joint(joint).parent.name
    mend.bare(spec)
    spec.option.timestep, spec.option.integrator = 0.002, RK4
    mend.encoders(spec, 2 * np.pi / 2**17, 2e-3)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:] = 0.5
    mujoco.mj_forward(model, data)
    inertia = np.zeros((1, 1))
    mujoco.mj_fullM(model, data, inertia)
    pace = 4.0
    return _finish(
        spec, name, base, [0.5], middle=data.qfrc_bias, reach=reach, period=0.008, band=(0.15, 0.7), spread=0.05,
        hold={0: (joint, inertia[0, 0] * pace**2, inertia[0, 0] * pace)}, command_noise=noise, factors=(0.5, 5.0),
        seconds=(12.0, 12.0), effects=(*_JOINTS, "joint_armature", "payload"),
    )  # fmt: skip


def ur5e_pan(wheels: Wheels) -> Robot:
    """The first joint of a UR5e, about the vertical."""
    return _one_joint(wheels, "ur5e_pan", "shoulder_pan_joint")


def ur5e_elbow(wheels: Wheels) -> Robot:
    """The elbow of a UR5e."""
    return _one_joint(wheels, "ur5e_elbow", "elbow_joint")


def ur5e_wrist(wheels: Wheels) -> Robot:
    """The first wrist joint of a UR5e."""
    return _one_joint(wheels, "ur5e_wrist", "wrist_1_joint")


ROBOTS: dict[str, Callable[[Wheels], Robot]] = {
    maker.__name__: maker
    for maker in (
        cartpole,
        acrobot,
        swimmer,
        fish,
        fish_dry,
        quadruped,
        dog,
        fetch,
        hand,
        panda,
        iiwa,
        sawyer,
        ur5e_pan,
        ur5e_elbow,
        ur5e_wrist,
    )
}


class FishWater(Effect):
    """The file's own water: MuJoCo's fluid by inertia boxes, drag with the square of the speed on every body."""

    kind = "quadratic_drag"
    most = 1.0

    def __init__(self, target: str, density: float):
        super().__init__(target, {}, comparable=False)
        self.density = density

    def begin(self, plant):
        plant.batch.expand("opt.density")[...] = (self.density * self.scale).reshape(-1)


class DryFish(Generic):
    """A system of which one thing can be hidden: all of the water."""

    def singles(self, model):
        return {"quadratic_drag": lambda rng: FishWater("all", 5000.0)}


def system(name: str, wheels: Wheels) -> Generic:
    """A robot as a system of the benchmark."""
    return (DryFish if name == "fish_dry" else Generic)(ROBOTS[name](wheels))
