"""A recorder for any robot, and how far it is driven: sizes that follow from the robot's own."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from ..errors import DataError
from ..recording.features import FreeBase
from ..recording.kinematics import below
from ..recording.plan import Plan, Stream
from ..recording.randomness import generator
from ..recording.simulation import Recording, simulate
from ..recording.system import Bounds, System
from . import excitation
from .excitation import Robot, Scales
from .scene import listed

#: Initial speed by the robot's length [1/s]; time in which a push gives it [s].
LENGTHS, PUSH_TIME = 0.6, 0.6
#: Rate of a robot of 1 m [rad/s]; frequencies of it [Hz]; both fall with the root of its length, between factors.
RATE, FREQUENCY, FACTORS = 0.8, (0.2, 1.5), (0.4, 3.0)
#: Initial speed of the joints, and of each of more than so many [rad/s].
JOINT_SPEED, MANY_JOINTS = 1.0, 12
#: Weight that the water may leave before it is held now and then, as a share of the weight.
AFLOAT = 0.02
#: A base that is quicker has exploded: lengths a second, and [m/s]; turns and joints [rad/s].
TOO_FAST, TOO_FAST_ANYWAY, TOO_MANY_TURNS = 100.0, 10.0, 500.0
#: Trajectories of the pilot, and the share of them that may be unstable.
PILOT, UNSTABLE = 16, 0.25
#: Sample periods in which drag may stop the robot at the earliest.
SLOW = 3.0
#: A component of the wrench that varies less, relative to the others or to the weight, is no output.
CONSTANT, WEIGHTLESS = 1e-6, 1e-9


@dataclass(frozen=True)
class AnyRobot:
    """Makes the plans of a data set; a `recording.shards.Recorder`."""

    system: System
    robot: Robot
    scales: Scales
    seed: int
    samples: int
    density: tuple[float, float]

    #: Draws of a trajectory at most.
    attempts = 8

    def plan(self, stream: int, index: int, attempt: int) -> Plan:
        """What happens in a trajectory."""
        return excitation.plan(
            self.robot,
            self.scales,
            (stream, index, attempt),
            seed=self.seed,
            samples=self.samples,
            period=self.system.sample_period,
            density=self.density,
        )

    def noise(self, stream: int, index: int) -> np.random.Generator:
        """Random numbers of its noise."""
        return generator(self.seed, Stream.NOISE, stream, index)

    def simulate(self, plans: Sequence[Plan]) -> Recording:
        """What the plans lead to, in MuJoCo's own water and the plugin's."""
        return simulate(self.system, plans)


def length(model: mujoco.MjModel, base: int) -> float:
    """Length of the robot in its own posture: the longest side of the box round its geoms' bounding spheres [m]."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    tree = below(model, base)
    geoms = [g for g in range(model.ngeom) if model.geom_bodyid[g] in tree and model.geom_rbound[g] > 0]
    if geoms:
        radius = model.geom_rbound[geoms, None]
        ends = data.geom_xpos[geoms]
        return float(np.max((ends + radius).max(axis=0) - (ends - radius).min(axis=0)))
    mass = model.body_subtreemass[base]
    return float(3 * np.sqrt(model.body_inertia[tree].max() / mass)) if mass > 0 else 1.0


def bounds(size: float) -> Bounds:
    """When a robot of that length has exploded."""
    return Bounds(TOO_FAST * size + TOO_FAST_ANYWAY, TOO_MANY_TURNS)


def scales(
    system: System, robot: Robot, density: float, *, effort: float, frequency: tuple[float, float] | None
) -> tuple[Scales, list[str]]:
    """Sizes of what is drawn, from the robot's length, inertia and drag; and what these say of a checkpoint."""
    model, base = system.model, system.base
    size = length(model, base)
    by_size = float(np.clip(1 / np.sqrt(size), *FACTORS))
    speed, rate = LENGTHS * size, RATE * by_size
    low, high = frequency or (by_size * FREQUENCY[0], by_size * FREQUENCY[1])
    # A cycle has ten samples at least.
    band = (min(low, 0.05 / system.sample_period), min(high, 0.1 / system.sample_period))

    data = mujoco.MjData(model)
    data.qpos[:] = robot.qpos0
    mujoco.mj_forward(model, data)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    mass = float(model.body_subtreemass[base])
    turning = mass * size**2 / 12
    trim = (0.0, 0.0, 0.0)
    if isinstance(system.layout.base, FreeBase):
        dof = system.layout.base.velocity
        turning = float(np.mean(np.diag(inertia)[dof + 3 : dof + 6]))
        left = data.qfrc_passive[dof : dof + 3] - data.qfrc_bias[dof : dof + 3]
        if np.linalg.norm(left) > AFLOAT * mass * max(float(np.linalg.norm(model.opt.gravity)), 1e-9):
            trim = (-float(left[0]), -float(left[1]), -float(left[2]))
    force, torque = _drag(system, robot, density, speed, rate)
    drawn = Scales(
        speed=speed,
        rate=rate,
        joint_speed=JOINT_SPEED * min(1.0, MANY_JOINTS / max(1, len(robot.joints))),
        force=effort * max(mass * speed / PUSH_TIME, force),
        torque=effort * max(turning * rate / PUSH_TIME, torque),
        frequency=band,
        effort=effort,
        trim=trim,
    )
    return drawn, says(system, drawn, force, mass)


def says(system: System, scales: Scales, drag: float, mass: float) -> list[str]:
    """Notes on what a checkpoint of this robot cannot do where it is loaded."""
    notes = []
    if system.layout.joints:
        notes.append(
            "the label is the wrench on the base alone: joints that the model's water damps feel none of it where the "
            "checkpoint is loaded"
        )
    stops = mass * scales.speed / drag if drag > 0 else np.inf
    if stops < SLOW * system.sample_period:
        notes.append(
            f"the water stops this robot within {stops:.2g} s, so a force that is held for {system.sample_period:g} s "
            "may shake it where the checkpoint is loaded: record with a smaller --sample-period, and timestep"
        )
    return notes


def _drag(system: System, robot: Robot, density: float, speed: float, rate: float) -> tuple[float, float]:
    """Force and torque of the water on the base at a speed and a rate, less those at rest; means over the axes."""
    base = system.layout.base
    if not isinstance(base, FreeBase):
        return 0.0, 0.0
    still = Plan(
        0,
        robot.qpos0,
        np.zeros(robot.nv),
        np.zeros((1, robot.nu)),
        np.zeros((1, 6)),
        np.full(1, density),
        np.zeros(1, int),
    )
    plans = [still]
    for axis in range(6):
        qvel = np.zeros(robot.nv)
        qvel[base.velocity + axis] = speed if axis < 3 else rate
        plans.append(replace(still, qvel=qvel))
    wrench = simulate(system, plans).wrench[:, 0]
    moved = np.abs(wrench[1:] - wrench[0])
    drag = float(np.mean(np.max(moved[:3, :3], axis=1))), float(np.mean(np.max(moved[3:, 3:], axis=1)))
    return drag if np.all(np.isfinite(drag)) else (0.0, 0.0)


def pilot(recorder: AnyRobot) -> Recording:
    """Trajectories that are in no split, to learn the size of the wrench; refuses a robot that is often unstable."""
    recording = simulate(recorder.system, [recorder.plan(Stream.PILOT, i, 0) for i in range(PILOT)])
    bad = np.flatnonzero(recording.fault)
    if bad.size > UNSTABLE * PILOT:
        reasons = sorted(set(recording.fault[bad]))
        raise DataError(
            f"{bad.size} of {PILOT} trial trajectories are unstable ({'; '.join(reasons)}): give the model a smaller "
            "timestep or integrator implicitfast, or drive it less hard (--effort 0.3)"
        )
    good = np.flatnonzero(recording.fault == "")
    parts = {name: getattr(recording, name)[good] for name in ("qpos", "qvel", "x", "wrench", "hydrostatic", "fault")}
    return Recording(**parts)


def outputs(
    recording: Recording, felt: tuple[int, ...], size: float, weight: float
) -> tuple[tuple[int, ...], np.ndarray]:
    """Components of the wrench that vary, of those that are felt, and the standard deviation [6] of all."""
    std = recording.wrench.reshape(-1, 6).std(axis=0)
    force = CONSTANT * std[:3].max()
    torque = max(CONSTANT * std[3:].max(), force * size)
    least = [max(force, WEIGHTLESS * weight)] * 3 + [max(torque, WEIGHTLESS * weight * size)] * 3
    varies = [i for i in felt if std[i] > least[i]]
    if not varies:
        raise DataError(
            "the water's wrench on the body is zero or constant in every trial trajectory: no water acts on it"
        )
    return tuple(varies), std


def warn_of_guesses(names: list[str]) -> str:
    """What is said of actuators without a range."""
    return f"actuators without ctrlrange are driven from -1 to 1: {listed(names)}"
