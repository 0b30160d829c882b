"""The force of the water on the robot along a prescribed motion: strips, wakes, lags, added mass.

At every row a strip moves through water that upstream links have set in motion (`wake`). Of the drag
of that flow a share acts at once; the share LAGGING belongs to the strip's own wake, which needs some
diameters of travel to form, and follows with a lag of the first order, LAG breadths at the tow speed.
That bluff bodies started from rest reach their steady drag after some diameters is known (T. Sarpkaya,
J. Applied Mechanics 33, 1966); an exponential, its length and the share are judgement. The added mass acts
at once.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from . import shedding
from .conditions import Stance
from .drag import Strips
from .geometry import body
from .motion import Motion
from .wake import CAP, Wakes, wakes

#: Share of the drag that builds up, over how many breadths of a strip, and the speed [m/s] below which time
#: no longer stretches.
LAGGING, LAG, LAG_SPEED = 0.5, 2.0, 0.2
#: The tank's own stirring carries wakes away where the robot rests [m/s]; judgement.
STIRRING = 0.02


@dataclass(frozen=True)
class Forces:
    """On the robot, base frame, [T,3] N: drag with its lag, added mass, vortices."""

    drag: np.ndarray
    added: np.ndarray
    vortices: np.ndarray

    @property
    def total(self) -> np.ndarray:
        """[T,3] N"""
        return self.drag + self.added + self.vortices


@lru_cache(maxsize=64)
def prepared(stance: Stance) -> tuple[Strips, Wakes]:
    """Strips and wakes of a stance, which many motions share."""
    strips = Strips(body(stance.thigh, stance.calf))
    return strips, wakes(strips, stance.unit)


def developed(stance: Stance, speed: float) -> np.ndarray:
    """Mean force [3] N of a tow that has lasted for ever, base frame."""
    strips, wake = prepared(stance)
    share = np.minimum(np.sqrt(np.sum(wake.share**2, axis=1)), CAP)
    return strips.drag(speed * (1.0 - share)[:, None] * stance.unit).sum(axis=0)


def _path(motion: Motion) -> np.ndarray:
    """Way gone through the water [T] m; it always grows, since the tank stirs."""
    pace = np.sqrt(motion.speed**2 + STIRRING**2) * motion.step
    return np.concatenate(([0.0], np.cumsum(0.5 * (pace[1:] + pace[:-1]))))


def _steady(motion: Motion) -> np.ndarray:
    """Drag [T,S,3] N that every strip would have, had its flow been what it is for long."""
    path, velocity = _path(motion), motion.speed[:, None] * motion.directions
    out = None
    for number, stance in enumerate(motion.stances):
        rows = np.flatnonzero(motion.stance == number)
        strips, wake = prepared(stance)
        # What of the former motion lay along the present direction.
        toward = np.maximum(np.sum(velocity * stance.unit, axis=1), 0.0)
        squares = np.zeros((len(rows), len(wake.share)))
        for link in range(wake.share.shape[1]):
            felt = wake.share[:, link] > 0
            passed = np.interp(path[rows, None] - wake.travel[felt, link], path, toward)
            squares[:, felt] += (wake.share[felt, link] * passed) ** 2
        speed = motion.speed[rows, None]
        water = np.minimum(np.sqrt(squares), CAP * speed)
        steady = strips.drag((speed - water)[..., None] * stance.unit)
        if out is None:
            out = np.empty((len(motion.speed), *steady.shape[1:]))
        out[rows] = steady
    return out


def _lagged(motion: Motion, steady: np.ndarray) -> np.ndarray:
    """Drag [T,3] N of all strips, a share of each behind its steady value."""
    breadth = np.sqrt(np.prod(prepared(motion.stances[0])[0].body.breadth, axis=1))
    pace = np.maximum(motion.speed, LAG_SPEED)
    # Exact for a steady value that is held over a step.
    keep = np.exp(-motion.step * pace[:, None] / (LAG * breadth))[..., None]
    state, out = steady[0].copy(), np.empty((len(steady), 3))
    if not motion.underway:
        state[:] = 0.0
    for k in range(len(steady)):
        out[k] = (LAGGING * state + (1.0 - LAGGING) * steady[k]).sum(axis=0)
        state = steady[k] + keep[k] * (state - steady[k])
    return out


def _added(motion: Motion) -> np.ndarray:
    """[T,3] N"""
    masses = np.array([prepared(stance)[0].added_mass() for stance in motion.stances])[motion.stance]
    return -np.einsum("tij,tj->ti", masses, motion.acceleration[:, None] * motion.directions)


def _vortices(motion: Motion, rng: np.random.Generator) -> np.ndarray:
    """[T,3] N"""
    tables = [
        [shedding.lift(link, stance.unit, prepared(stance)[0].density) for link in prepared(stance)[0].body.links]
        for stance in motion.stances
    ]
    lifts = np.array([[force for force, _ in row] for row in tables])[motion.stance]
    frequencies = np.array([[hertz for _, hertz in row] for row in tables])[motion.stance]
    phase = shedding.oscillate(2 * np.pi * frequencies * motion.speed[:, None], motion.step, rng)
    return np.einsum("tb,tbi->ti", phase * motion.speed[:, None] ** 2, lifts)


def along(motion: Motion, rng: np.random.Generator | None) -> Forces:
    """Forces at every row; without `rng` no vortices."""
    drag = _lagged(motion, _steady(motion))
    vortices = np.zeros_like(drag) if rng is None else _vortices(motion, rng)
    return Forces(drag, _added(motion), vortices)
