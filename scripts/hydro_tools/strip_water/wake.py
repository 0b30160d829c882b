"""The water that a strip has set in motion: the memory of the drag.

A strip that moves at u drags water along. Along each of its axes that water has a velocity w, and

    F = -1/2 rho K / (1 - SHARE)^2 |r| r,   r = u - w,   dw/dt = (SHARE u - w) |r| / (LENGTH b)

with K the steady coefficient times area and b the width of the strip: a lag of the first order whose time is a width
over a speed. In steady motion w = SHARE u and F is the steady drag. A strip that starts feels 1 / (1 - SHARE)^2 times
as much until it has gone some widths, and one that turns back meets its own wake, as a cylinder in oscillating flow,
whose drag is about twice the steady one at 8 to 12 widths a stroke (T. Sarpkaya, Vortex shedding and resistance in
harmonic flow about smooth and rough circular cylinders at high Reynolds numbers, NPS-59SL76021, 1976). SHARE and
LENGTH are judgement.

No energy is made: with m = 1/2 rho K / (1 - SHARE)^2 LENGTH b / SHARE as the mass of the moving water, 1/2 m w^2 and
the robot's energy never grow together, as long as K changes little with the speed. w is kept along the axes of its
strip and turns with it.
"""

import numpy as np

from .strips import Strips

#: Velocity of the wake over that of the strip, in steady motion.
SHARE = 0.35
#: Length over which the wake follows [widths of the strip].
LENGTH = 2.0
#: Factor on the steady coefficient, since what counts is the flow relative to the wake.
GAIN = 1.0 / (1.0 - SHARE) ** 2


def follow(strips: Strips, wake: np.ndarray, velocity: np.ndarray, pace: np.ndarray, step: float) -> np.ndarray:
    """The wake [m,S,3] m/s a step [s] later, at a held velocity of the strips and pace of the relative flow."""
    gone = np.exp(-pace * (step / (LENGTH * strips.width[:, None])))
    return SHARE * velocity + gone * (wake - SHARE * velocity)
