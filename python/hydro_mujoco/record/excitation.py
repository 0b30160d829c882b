"""How a robot is made to move: commands of its actuators, pushes, initial states; all drawn at random.

Position servos follow gaits: sinusoids with a common frequency, as a wave along the list of joints or with phases of
their own. Motors and thrusters get the same, smooth random commands, chirps, constants, or nothing. The base is pushed
now and then. All of it changes at the switches of a trajectory, from one draw to the next within 0.1 to 0.4 s.
"""

from dataclasses import asdict, dataclass

import numpy as np

from ..recording.features import Carriage, FreeBase, Joint
from ..recording.plan import BLEND, PUSH_RAMP, Plan, attitude, bounded, crossfade, switching
from ..recording.randomness import generator
from .drives import FURTHEST, Drive

#: A switch a tenth of a second in the mean.
SWITCH_EVERY = 0.1
#: Ways of driving motors and thrusters, and their shares.
MODES, MODE_SHARES = ("gait", "smooth", "chirp", "constant", "off"), (0.3, 0.3, 0.15, 0.15, 0.1)
#: Chance that a gait is a wave along the joints; that servos hold a posture.
WAVE_SHARE, HOLD_SHARE = 0.5, 0.1
#: Sinusoids in a smooth random command; length of a chirp [s].
WAVES, CHIRP = 3, (2.0, 5.0)
#: Chance of a push; of a push on a robot that has nothing else.
PUSH_SHARE, LONE_PUSH_SHARE = 0.35, 0.7
#: Chance of a trajectory in which the weight that the water leaves is held.
TRIM_SHARE = 0.5
#: Initial joints: distance from the first posture at most, as a share of the range, and [rad].
JOINT_SHARE, JOINT_SPREAD = 0.25, 0.3
#: Largest initial speed and rate, in standard deviations of a component.
MOST = 2.5


@dataclass(frozen=True)
class Scales:
    """Sizes of what is drawn; standard deviations of a component, SI. A manifest holds them.

    speed, rate: of the initial velocity of the base. joint_speed: of the joints [rad/s]. force, torque: of a push.
    frequency: lowest and highest [Hz]. effort: share of the actuators' ranges. trim: force that holds the robot in the
    water at rest [N, world], or 0.
    """

    speed: float
    rate: float
    joint_speed: float
    force: float
    torque: float
    frequency: tuple[float, float]
    effort: float
    trim: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def recorded(self) -> dict:
        """Its entry in a manifest."""
        return {key: list(value) if isinstance(value, tuple) else value for key, value in asdict(self).items()}


@dataclass(frozen=True)
class Robot:
    """What is drawn for. qpos0 [nq]; ranges [nj, 2] of the joints, infinite where they have none.

    is_closed: joints are tied to each other, so the posture is not drawn.
    """

    base: FreeBase | Carriage
    joints: tuple[Joint, ...]
    drives: tuple[Drive, ...]
    ranges: np.ndarray
    qpos0: np.ndarray
    nv: int
    nu: int
    is_closed: bool


def plan(
    robot: Robot,
    scales: Scales,
    key: tuple[int, ...],
    *,
    seed: int,
    samples: int,
    period: float,
    density: tuple[float, float],
) -> Plan:
    """A trajectory; `key` and `seed` are all that its random numbers depend on."""
    rng = generator(seed, *key)
    switches = max(1, round(samples * period / SWITCH_EVERY))
    schedule = switching(rng, samples=samples, period=period, switches=switches, bands=(density,))
    rows = len(schedule.density)
    t = np.arange(rows) * period
    commands = np.zeros((rows, robot.nu))
    push = np.zeros((rows, 6))
    ramp = max(1, round(PUSH_RAMP / period))
    for number, at in enumerate([0, *schedule.changes]):
        blend = 0 if number == 0 else max(1, round(rng.uniform(*BLEND) / period))
        crossfade(commands, _commands(rng, robot, scales, t[at:]), at, blend)
        crossfade(push, np.broadcast_to(_push(rng, robot, scales), (rows - at, 6)), at, 0 if number == 0 else ramp)
    qpos, qvel = _start(rng, robot, scales, commands[0])
    if rng.random() < TRIM_SHARE:
        push[:, :3] += np.array(scales.trim)
    return Plan(schedule.warm_up, qpos, qvel, commands, push, schedule.density, schedule.condition)


def _commands(rng: np.random.Generator, robot: Robot, scales: Scales, t: np.ndarray) -> np.ndarray:
    """Commands [N, nu] at times t [N] s: one draw."""
    out = np.zeros((len(t), robot.nu))
    servos = [drive for drive in robot.drives if drive.is_servo]
    others = [drive for drive in robot.drives if not drive.is_servo]
    for drives, track in ((servos, _gait(rng, servos, scales, t)), (others, _driven(rng, others, scales, t))):
        for i, drive in enumerate(drives):
            out[:, drive.actuator] = np.clip(track[:, i], drive.low, drive.high)
    return out


def _sinusoids(rng: np.random.Generator, count: int, scales: Scales, t: np.ndarray) -> np.ndarray:
    """Sinusoids [N, count] of amplitude 1, one frequency for all; power and recovery strokes differ."""
    phase: np.ndarray = rng.uniform(0, 2 * np.pi, count)
    along = rng.uniform(0, 2 * np.pi) + rng.uniform(-np.pi, np.pi) * np.arange(count)
    if rng.random() < WAVE_SHARE:
        phase = along
    angle = 2 * np.pi * _frequency(rng, scales) * t[:, None] + phase
    return np.sin(angle) + rng.uniform(0.0, 0.3) * np.sin(2 * angle)


def _frequency(rng: np.random.Generator, scales: Scales, shape: tuple[int, ...] = ()) -> np.ndarray:
    """Frequencies, evenly in their logarithm [Hz]."""
    low, high = np.log(scales.frequency)
    return np.exp(rng.uniform(low, high, shape))


def _gait(rng: np.random.Generator, drives: list[Drive], scales: Scales, t: np.ndarray) -> np.ndarray:
    """Targets [N, drives] of position servos."""
    count = len(drives)
    low, high, rest = (np.array([getattr(drive, name) for drive in drives]) for name in ("low", "high", "rest"))
    reach = np.array([_reach(drive) for drive in drives])
    half = (high - low) / 2
    # The middle of the motion is near the posture of the model, and inside the range.
    middle = np.clip(rest, low + half / 2, high - half / 2)
    centre = middle + rng.uniform(-1, 1, count) * 0.4 * reach
    amplitude = rng.uniform(0, 0.5) * reach * rng.uniform(0.6, 1.0, count)
    wave = _sinusoids(rng, count, scales, t)
    if rng.random() < HOLD_SHARE:
        amplitude = np.zeros(count)
    return middle + scales.effort * (centre - middle + amplitude * wave)


def _reach(drive: Drive) -> float:
    """Distance that a servo may go from its middle [control]."""
    half = (drive.high - drive.low) / 2
    return half if drive.joint is None else min(half, FURTHEST * abs(drive.gear))


def _driven(rng: np.random.Generator, drives: list[Drive], scales: Scales, t: np.ndarray) -> np.ndarray:
    """Commands [N, drives] of motors and thrusters."""
    count = len(drives)
    mode = rng.choice(MODES, p=MODE_SHARES)
    level = rng.uniform(0, 1) * rng.uniform(0.3, 1.0, count)
    offset = rng.uniform(-1, 1, count)
    if mode == "gait":
        shape = _sinusoids(rng, count, scales, t) + 0.3 * offset
    elif mode == "smooth":
        turns = _frequency(rng, scales, (WAVES, count))
        phases = rng.uniform(0, 2 * np.pi, (WAVES, count))
        shape = np.sum(np.sin(2 * np.pi * turns * t[:, None, None] + phases), axis=1) / np.sqrt(WAVES) + 0.5 * offset
    elif mode == "chirp":
        length, (first, last) = rng.uniform(*CHIRP), _frequency(rng, scales, (2,))
        tau = np.mod(t, length)[:, None]
        turned = first * tau + (last - first) * tau**2 / (2 * length)
        shape = np.sin(2 * np.pi * turned + rng.uniform(0, 2 * np.pi, count))
    else:
        shape = np.broadcast_to(offset, (len(t), count)) * (mode == "constant")
    low, high, rest = (np.array([getattr(drive, name) for drive in drives]) for name in ("low", "high", "rest"))
    along = scales.effort * level * np.clip(shape, -1, 1)
    return rest + np.where(along > 0, along * (high - rest), along * (rest - low))


def _push(rng: np.random.Generator, robot: Robot, scales: Scales) -> np.ndarray:
    """A wrench on the base [6]: usually nothing."""
    wrench = np.concatenate((rng.normal(0, scales.force, 3), rng.normal(0, scales.torque, 3)))
    share = PUSH_SHARE if robot.drives else LONE_PUSH_SHARE
    return wrench if rng.random() < share else np.zeros(6)


def _start(
    rng: np.random.Generator, robot: Robot, scales: Scales, commands: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Initial qpos [nq] and qvel [nv]."""
    qpos, qvel = robot.qpos0.copy(), np.zeros(robot.nv)
    spread, speeds = rng.uniform(-1, 1, len(robot.joints)), rng.normal(0, 1, len(robot.joints))
    if not robot.is_closed:
        first = {
            drive.joint: commands[drive.actuator] / drive.gear for drive in robot.drives if drive.joint is not None
        }
        for i, (joint, (low, high)) in enumerate(zip(robot.joints, robot.ranges)):
            limited = np.isfinite(high - low)
            width = min(JOINT_SPREAD, JOINT_SHARE * (high - low)) if limited else JOINT_SPREAD
            if joint.is_slide and not limited:
                width = 0.0
            middle = first.get(i, float(qpos[joint.position]))
            qpos[joint.position] = np.clip(middle + spread[i] * width, low, high)
            qvel[joint.velocity] = speeds[i] * (width if joint.is_slide else scales.joint_speed)
    linear = bounded(rng.normal(0, scales.speed, 3), 0.0, MOST * scales.speed)
    angular = bounded(rng.normal(0, scales.rate, 3), 0.0, MOST * scales.rate)
    turned = attitude(rng)
    base = robot.base
    if isinstance(base, FreeBase):
        qpos[base.position + 3 : base.position + 7] = turned
        qvel[base.velocity : base.velocity + 6] = np.concatenate((linear, angular))
    else:
        for dof, speed in zip(base.dofs, linear):
            qvel[dof] = speed
    return qpos, qvel
