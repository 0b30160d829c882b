"""Everything that is drawn at random for one trajectory, from (seed, stream, index) and its regime alone.

A trajectory starts before its first sample: a warm-up of 0 to 8 s brings it to the speeds and
attitudes that swimming settles to, so that the data cover both transients and what ten minutes of
free swimming visit.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from . import gait
from .randomness import generator
from .regime import USUAL, Ranges, Regime
from .scene import SAMPLE_PERIOD

#: Fresh water to sea water [kg/m^3].
DENSITY_RANGE = USUAL.ranges.density[0]
#: Condition switches in a trajectory of Task 2.
SWITCHES = 40
#: Seconds of warm-up: a quarter of the trajectories starts (nearly) at once.
WARM_UP, BRIEF_WARM_UP, BRIEF_SHARE = 8.0, 0.3, 0.25
#: Mean time between changes of gait and push, outside Task 2's switches [s].
DWELL = 1.5
#: A switch always changes the density; gait and push with a chance that is drawn a trajectory.
RESTLESSNESS, RESTLESSNESS_SHARES = (1.0, 0.3, 0.05), (0.4, 0.3, 0.3)
#: Ramp of a push on the base [s].
PUSH_RAMP = 0.1
#: A gait blends into the next within [s].
BLEND = (0.1, 0.4)
#: Initial roll and pitch [rad]: mostly small (standard deviation), some large (half-range), some anything.
TILT, WIDE_TILT, TILT_SHARES = 0.35, 1.2, (0.75, 0.15, 0.10)
#: Initial joints: spread about the first target [rad], speed [rad/s].
JOINT_SPREAD, JOINT_SPEED = 0.3, 1.0


class Stream(IntEnum):
    """Independent random streams of a seed."""

    TRAIN = 0
    VAL = 1
    TEST = 2
    PILOT = 3
    ROLLOUT = 4
    NOISE = 100


@dataclass(frozen=True)
class Plan:
    """One trajectory: N = warm_up + samples rows, each held for a sample period.

    qpos [19], qvel [18]; ctrl [N, 12] rad; push [N, 6] force and torque on the base, world frame;
    density [N] kg/m^3; condition [samples], counted from 0.
    """

    warm_up: int
    qpos: np.ndarray
    qvel: np.ndarray
    ctrl: np.ndarray
    push: np.ndarray
    density: np.ndarray
    condition: np.ndarray


def _attitude(rng: np.random.Generator) -> np.ndarray:
    """A random `world_from_base` [4]: yaw anything, roll and pitch a mixture."""
    kind = rng.choice(3, p=TILT_SHARES)
    yaw = rng.uniform(-np.pi, np.pi)
    roll, pitch = rng.normal(0, TILT, 2) if kind == 0 else rng.uniform(-WIDE_TILT, WIDE_TILT, 2)
    anything = rng.normal(size=4)
    if kind == 2:
        return anything / np.sqrt(np.sum(anything**2))
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll / 2, pitch / 2, yaw / 2]), np.sin([roll / 2, pitch / 2, yaw / 2])
    return np.array(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ]
    )


def _bounded(vector: np.ndarray, least: float, most: float) -> np.ndarray:
    """The vector with a norm of no less and no more."""
    norm = max(np.sqrt(np.sum(vector**2)), 1e-12)
    return vector * max(min(1.0, most / norm), least / norm)


def _push(rng: np.random.Generator, ranges: Ranges) -> np.ndarray:
    """A wrench on the base [6]: usually nothing, more often than not."""
    wrench = np.concatenate((rng.normal(0, ranges.push_force, 3), rng.normal(0, ranges.push_torque, 3)))
    return wrench if rng.random() < ranges.push_share else np.zeros(6)


def _densities(rng: np.random.Generator, bands: tuple[tuple[float, float], ...], count: int) -> np.ndarray:
    """Densities [count] in any of the bands, as if these lay side by side [kg/m^3]."""
    drawn = rng.uniform(bands[0][0], bands[0][0] + sum(high - low for low, high in bands), count)
    for (_, end), (start, _) in zip(bands, bands[1:]):
        drawn[drawn >= end] += start - end
    return drawn


def _dwell(rng: np.random.Generator, start: int, end: int) -> list[int]:
    """Instants of change in (start, end), DWELL seconds apart in the mean [samples]."""
    instants, at = [], start
    while True:
        at += max(1, round(rng.exponential(DWELL) / SAMPLE_PERIOD))
        if at >= end:
            return instants
        instants.append(at)


def _draw(
    rng: np.random.Generator,
    ranges: Ranges,
    *,
    warm_up: int,
    rows: int,
    changes: list[int],
    density: np.ndarray,
    condition: np.ndarray,
    joint_range: np.ndarray,
) -> Plan:
    """Initial state, and the tracks of targets and pushes that change at `changes` [samples]."""
    t = np.arange(rows) * SAMPLE_PERIOD
    first = gait.draw(rng, ranges)
    posture = gait.within(first.targets(t[:1])[0] + rng.normal(0, JOINT_SPREAD, 12), joint_range)
    qpos = np.concatenate((np.zeros(3), _attitude(rng), posture))
    qvel = np.concatenate(
        (
            _bounded(rng.normal(0, ranges.start_speed, 3), *ranges.speed_norm),
            _bounded(rng.normal(0, ranges.start_rate, 3), *ranges.rate_norm),
            rng.normal(0, JOINT_SPEED, 12),
        )
    )
    ctrl = gait.hold(posture).targets(t)
    push = np.zeros((rows, 6))
    ramp = round(PUSH_RAMP / SAMPLE_PERIOD)
    for number, at in enumerate([0, *changes]):
        step = first if number == 0 else gait.draw(rng, ranges)
        blend = round(rng.uniform(*BLEND) / SAMPLE_PERIOD)
        gait.crossfade(ctrl, step.targets(t[at:]), at, blend)
        gait.crossfade(push, np.broadcast_to(_push(rng, ranges), (rows - at, 6)), at, ramp)
    return Plan(warm_up, qpos, qvel, gait.within(ctrl, joint_range), push, density, condition)


def _warm_up(rng: np.random.Generator) -> int:
    """Samples of warm-up."""
    longest = BRIEF_WARM_UP if rng.random() < BRIEF_SHARE else WARM_UP
    return round(rng.uniform(0, longest) / SAMPLE_PERIOD)


def task2(seed: int, stream: int, index: int, *, samples: int, joint_range: np.ndarray, regime: Regime = USUAL) -> Plan:
    """A trajectory of Task 2: SWITCHES switches at random instants after its first sample."""
    rng = generator(seed, stream, index, *regime.key)
    warm_up = _warm_up(rng)
    switches = np.sort(rng.choice(np.arange(1, samples), min(SWITCHES, samples - 1), replace=False))
    condition = np.searchsorted(switches, np.arange(samples), side="right")
    densities = _densities(rng, regime.ranges.density, len(switches) + 1)
    density = np.concatenate((np.full(warm_up, densities[0]), densities[condition]))
    restless = rng.choice(RESTLESSNESS, p=RESTLESSNESS_SHARES)
    during = [warm_up + int(at) for at in switches if rng.random() < restless]
    return _draw(
        rng,
        regime.ranges,
        warm_up=warm_up,
        rows=warm_up + samples,
        changes=_dwell(rng, 0, warm_up) + during,
        density=density,
        condition=condition,
        joint_range=joint_range,
    )


def rollout(
    seed: int, index: int, *, samples: int, density_range: tuple[float, float], joint_range: np.ndarray
) -> Plan:
    """A run for closed-loop comparison: one density, gait and push changing every DWELL seconds or so.

    Its stream is disjoint from every stream of Task 2, so no run was ever trained on.
    """
    rng = generator(seed, Stream.ROLLOUT, index)
    warm_up = _warm_up(rng)
    rows = warm_up + samples
    return _draw(
        rng,
        USUAL.ranges,
        warm_up=warm_up,
        rows=rows,
        changes=_dwell(rng, 0, rows),
        density=np.full(rows, rng.uniform(*density_range)),
        condition=np.zeros(samples, int),
        joint_range=joint_range,
    )
