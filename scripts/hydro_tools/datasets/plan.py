"""Everything that is drawn at random for one trajectory, from (seed, stream, index) and its regime alone."""

from dataclasses import replace

import numpy as np

from hydro_mujoco.recording.plan import (
    BLEND,
    PUSH_RAMP,
    Plan,
    Schedule,
    Stream,
    attitude,
    bounded,
    crossfade,
    dwell,
    switching,
    warm_up,
)
from hydro_mujoco.recording.randomness import generator

from . import gait
from .regime import USUAL, Ranges, Regime
from .scene import SAMPLE_PERIOD

#: Fresh water to sea water [kg/m^3].
DENSITY_RANGE = USUAL.ranges.density[0]
#: Condition switches in a trajectory of Task 2.
SWITCHES = 40
#: What a switch changes beside the density: gait and push with a chance that belongs to the trajectory, or both always.
MIXED, ALL = "mixed", "all"
SWITCHING = (MIXED, ALL)
#: Initial joints: spread about the first target [rad], speed [rad/s].
JOINT_SPREAD, JOINT_SPEED = 0.3, 1.0


def _push(rng: np.random.Generator, ranges: Ranges) -> np.ndarray:
    """A wrench on the base [6]: usually nothing, more often than not."""
    wrench = np.concatenate((rng.normal(0, ranges.push_force, 3), rng.normal(0, ranges.push_torque, 3)))
    return wrench if rng.random() < ranges.push_share else np.zeros(6)


def _draw(rng: np.random.Generator, ranges: Ranges, schedule: Schedule, joint_range: np.ndarray) -> Plan:
    """Initial state, and the tracks of targets and pushes that change as the schedule says."""
    rows = len(schedule.density)
    t = np.arange(rows) * SAMPLE_PERIOD
    first = gait.draw(rng, ranges)
    posture = gait.within(first.targets(t[:1])[0] + rng.normal(0, JOINT_SPREAD, 12), joint_range)
    qpos = np.concatenate((np.zeros(3), attitude(rng), posture))
    qvel = np.concatenate(
        (
            bounded(rng.normal(0, ranges.start_speed, 3), *ranges.speed_norm),
            bounded(rng.normal(0, ranges.start_rate, 3), *ranges.rate_norm),
            rng.normal(0, JOINT_SPEED, 12),
        )
    )
    ctrl = gait.hold(posture).targets(t)
    push = np.zeros((rows, 6))
    ramp = round(PUSH_RAMP / SAMPLE_PERIOD)
    for number, at in enumerate([0, *schedule.changes]):
        step = first if number == 0 else gait.draw(rng, ranges)
        blend = round(rng.uniform(*BLEND) / SAMPLE_PERIOD)
        crossfade(ctrl, step.targets(t[at:]), at, blend)
        crossfade(push, np.broadcast_to(_push(rng, ranges), (rows - at, 6)), at, ramp)
    return Plan(
        schedule.warm_up, qpos, qvel, gait.within(ctrl, joint_range), push, schedule.density, schedule.condition
    )


def task2(
    seed: int,
    stream: int,
    index: int,
    *,
    samples: int,
    joint_range: np.ndarray,
    regime: Regime = USUAL,
    switch: str = MIXED,
) -> Plan:
    """A trajectory of Task 2: SWITCHES switches at random instants after its first sample.

    With `ALL` every switch draws a new density, gait, command and push, and no push is none.
    """
    rng = generator(seed, stream, index, *regime.key)
    ranges = regime.ranges if switch == MIXED else replace(regime.ranges, push_share=1.0)
    schedule = switching(
        rng,
        samples=samples,
        period=SAMPLE_PERIOD,
        switches=SWITCHES,
        bands=ranges.density,
        restlessness=None if switch == MIXED else 1.0,
    )
    return _draw(rng, ranges, schedule, joint_range)


def rollout(
    seed: int, index: int, *, samples: int, density_range: tuple[float, float], joint_range: np.ndarray
) -> Plan:
    """A run for closed-loop comparison: one density, gait and push changing every DWELL seconds or so.

    Its stream is disjoint from every stream of Task 2, so no run was ever trained on.
    """
    rng = generator(seed, Stream.ROLLOUT, index)
    before = warm_up(rng, SAMPLE_PERIOD)
    rows = before + samples
    schedule = Schedule(
        warm_up=before,
        changes=dwell(rng, 0, rows, SAMPLE_PERIOD),
        density=np.full(rows, rng.uniform(*density_range)),
        condition=np.zeros(samples, int),
    )
    return _draw(rng, USUAL.ranges, schedule, joint_range)
