"""The unsteady lift of vortices that links shed, as narrow-band noise.

A link of width d across a flow of speed U sheds at f = St U / d; its lift, across the flow and the
link, is 1/2 rho C_L A U^2 r(t), with r(t) of unit variance and the spectrum of an oscillator of
frequency f and damping DAMPING that white noise drives. St = 0.2 for rounded bars, 0.12 for a
rectangle of depth 2 (Blevins, Flow-Induced Vibration, 1990, chapter 3). C_L is judgement: far
below the 0.3 of a long circular cylinder, for these bars are short, rough and inclined, and their
vortices do not keep in step along the span.
"""

import numpy as np

from .geometry import Link, frontal

STROUHAL = {"trunk": 0.12}
LEG_STROUHAL = 0.2
LIFT = 0.06
DAMPING = 0.1


def lift(link: Link, direction: np.ndarray, density: float) -> tuple[np.ndarray, float]:
    """Lift [3] N at unit r and 1 m/s, base frame, and the shedding frequency [Hz] at 1 m/s."""
    axis = link.end - link.start
    across = np.cross(axis / link.length, direction)
    height, width = frontal(link, direction)
    strouhal = STROUHAL.get(link.part, LEG_STROUHAL)
    # The cross product fades with the sine of the incidence: a link along the flow sheds nothing to its side.
    return 0.5 * density * LIFT * height * width * across, strouhal / width


def oscillate(rate: np.ndarray, step: float, rng: np.random.Generator) -> np.ndarray:
    """r [T,B] of B oscillators whose angular frequencies [T,B] rad/s may change; unit variance."""
    turn = np.exp((-DAMPING + 1j) * rate * step)
    kick = np.sqrt(np.maximum(1.0 - np.abs(turn) ** 2, 0.0))
    noise = rng.normal(size=(2, len(rate) + 1, rate.shape[1]))
    noise = noise[0] + 1j * noise[1]
    state, out = noise[-1], np.empty(rate.shape)
    for k in range(len(rate)):
        out[k] = state.real
        state = turn[k] * state + kick[k] * noise[k]
    return out
