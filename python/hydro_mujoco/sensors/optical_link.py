"""Budget of an optical link: power that arrives, ratio to the noise, share of packets that arrive."""

from math import erfc, sqrt

import numpy as np


def received_power(
    power: float, distance: float, attenuation: float, half_angle: float, area: float, incidence: float
) -> float:
    """Power that a receiver collects [W]: P exp(-c d) A cos(incidence) / (2 pi d^2 (1 - cos half_angle)).

    Beer-Lambert attenuation, and spreading over the part of a sphere that the sender lights evenly. Near the sender the
    receiver has all of the light at most.

    Args:
        power: P, sent [W]. distance: d [m]. attenuation: c of the water or air [1/m].
        half_angle: of the sender's cone [rad]. area: A of the receiver [m^2].
        incidence: angle between the receiver's normal and the way to the sender [rad], at most pi / 2.

    Source: S. Arnon, Underwater optical wireless communication network, Optical Engineering 49(1), 2010, 015001.
    """
    lit = 2 * np.pi * distance**2 * (1 - np.cos(half_angle))
    facing = area * np.cos(incidence)
    share = facing / lit if facing < lit else 1.0
    return float(power * np.exp(-attenuation * distance) * share)


def quality(power: float, noise: float, *others: float) -> float:
    """Q: mean power [W] by the standard deviation of noise [W] and of other light that is switched on and off [W]."""
    return power / sqrt(noise**2 + sum(other**2 for other in others))


def success(ratio: float, bits: float) -> float:
    """Probability that all bits of a packet are right at a Q: (1 - p)^bits with p = erfc(Q / sqrt 2) / 2.

    Source: G. P. Agrawal, Fiber-Optic Communication Systems, 4th ed., Wiley 2010, chapter 4 (on-off keying with the
    threshold midway, noise of the same power for both bits).
    """
    return float(np.exp(bits * np.log1p(-0.5 * erfc(ratio / sqrt(2)))))
