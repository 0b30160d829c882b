"""What happens in one trajectory, and draws that the plans of all recorders share.

A trajectory starts before its first sample: a warm-up of 0 to 8 s brings it to the speeds and
attitudes that swimming settles to, so that the data cover both transients and what ten minutes of
free swimming visit.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

#: Seconds of warm-up: a quarter of the trajectories starts (nearly) at once.
WARM_UP, BRIEF_WARM_UP, BRIEF_SHARE = 8.0, 0.3, 0.25
#: A switch always changes the density; all else with a chance that is drawn a trajectory.
RESTLESSNESS, RESTLESSNESS_SHARES = (1.0, 0.3, 0.05), (0.4, 0.3, 0.3)
#: Mean time between changes during the warm-up [s].
DWELL = 1.5
#: Ramp of a push on the base [s].
PUSH_RAMP = 0.1
#: A way of moving blends into the next within [s].
BLEND = (0.1, 0.4)
#: Initial roll and pitch [rad]: mostly small (standard deviation), some large (half-range), some anything.
TILT, WIDE_TILT, TILT_SHARES = 0.35, 1.2, (0.75, 0.15, 0.10)


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

    qpos [nq], qvel [nv]; ctrl [N, nu]; push [N, 6] force and torque on the base, world frame;
    density [N] kg/m^3; condition [samples], counted from 0.
    """

    warm_up: int
    qpos: np.ndarray
    qvel: np.ndarray
    ctrl: np.ndarray
    push: np.ndarray
    density: np.ndarray
    condition: np.ndarray


@dataclass(frozen=True)
class Schedule:
    """When what changes: N = warm_up + samples rows.

    changes: rows at which the way of moving and the push change; density [N] kg/m^3; condition [samples], from 0.
    """

    warm_up: int
    changes: list[int]
    density: np.ndarray
    condition: np.ndarray


def attitude(rng: np.random.Generator) -> np.ndarray:
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


def bounded(vector: np.ndarray, least: float, most: float) -> np.ndarray:
    """The vector with a norm of no less and no more."""
    norm = max(np.sqrt(np.sum(vector**2)), 1e-12)
    return vector * max(min(1.0, most / norm), least / norm)


def densities(rng: np.random.Generator, bands: tuple[tuple[float, float], ...], count: int) -> np.ndarray:
    """Densities [count] in any of the bands, as if these lay side by side [kg/m^3]."""
    drawn = rng.uniform(bands[0][0], bands[0][0] + sum(high - low for low, high in bands), count)
    for (_, end), (start, _) in zip(bands, bands[1:]):
        drawn[drawn >= end] += start - end
    return drawn


def warm_up(rng: np.random.Generator, period: float) -> int:
    """Samples of warm-up, `period` s apart."""
    longest = BRIEF_WARM_UP if rng.random() < BRIEF_SHARE else WARM_UP
    return round(rng.uniform(0, longest) / period)


def dwell(rng: np.random.Generator, start: int, end: int, period: float) -> list[int]:
    """Instants of change in (start, end), DWELL seconds apart in the mean [samples of `period` s]."""
    instants: list[int] = []
    at = start
    while True:
        at += max(1, round(rng.exponential(DWELL) / period))
        if at >= end:
            return instants
        instants.append(at)


def switching(
    rng: np.random.Generator,
    *,
    samples: int,
    period: float,
    switches: int,
    bands: tuple[tuple[float, float], ...],
    restlessness: float | None = None,
) -> Schedule:
    """A trajectory with `switches` switches at random instants after its first sample, densities from `bands`.

    restlessness: chance that a switch changes more than the density, None to draw one for the trajectory.
    Where the only band is a single density, a switch that changes nothing begins no condition.
    """
    before = warm_up(rng, period)
    instants = np.sort(rng.choice(np.arange(1, samples), min(switches, samples - 1), replace=False))
    condition = np.searchsorted(instants, np.arange(samples), side="right")
    drawn = densities(rng, bands, len(instants) + 1)
    density = np.concatenate((np.full(before, drawn[0]), drawn[condition]))
    drawn_restless = float(rng.choice(RESTLESSNESS, p=RESTLESSNESS_SHARES))
    restless = drawn_restless if restlessness is None else restlessness
    during = [int(at) for at in instants if rng.random() < restless]
    if bands == ((bands[0][0], bands[0][0]),):
        condition = np.searchsorted(during, np.arange(samples), side="right")
    changes = dwell(rng, 0, before, period) + [before + at for at in during]
    return Schedule(before, changes, density, condition)


def crossfade(track: np.ndarray, new: np.ndarray, start: int, length: int) -> None:
    """Let `track` [N, k] become `new` [N - start, k] from sample `start` on, over `length` samples (smoothstep)."""
    u = np.clip((np.arange(len(track) - start) + 1) / max(length, 1), 0.0, 1.0)
    weight = (u * u * (3 - 2 * u))[:, None]
    track[start:] = (1 - weight) * track[start:] + weight * new
