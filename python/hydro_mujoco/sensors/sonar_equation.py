"""Passive sonar equation of an acoustic link: loss on the way, signal-to-noise ratio, share of packets that arrive.

Levels in dB: sources re 1 uPa at 1 m, noise re 1 uPa, spectra of noise re 1 uPa^2/Hz.
"""

import numpy as np

#: Distance at which source levels hold [m].
REFERENCE = 1.0


def absorption(frequency: float) -> float:
    """Absorption of sea water at a frequency [Hz], by Thorp's formula [dB/m]; 4 C, 35 psu, pH 8, about 1 km deep.

    Source: W. H. Thorp, J. Acoust. Soc. Am. 42, 1967, p. 270, with the terms for low and high frequencies of F. B.
    Jensen et al., Computational Ocean Acoustics, 2nd ed., Springer 2011, eq. 1.47.
    """
    square = (frequency / 1000) ** 2
    return 1e-3 * (3.3e-3 + 0.11 * square / (1 + square) + 44 * square / (4100 + square) + 3.0e-4 * square)


def transmission_loss(distance: float, frequency: float, spreading: float) -> float:
    """Loss of level from 1 m to a distance [m], by spreading and absorption [dB].

    10 k log10(r / 1 m) + a r, with k = 2 for spherical spreading, 1 for cylindrical, 1.5 in practice.

    Source: R. J. Urick, Principles of Underwater Sound, 3rd ed., McGraw-Hill 1983, chapters 2 and 5.
    """
    distance = max(distance, REFERENCE)
    return float(10 * spreading * np.log10(distance / REFERENCE) + absorption(frequency) * distance)


def total(*levels: float) -> float:
    """Level of sounds that add by power [dB]."""
    return float(10 * np.log10(np.sum(10 ** (np.array(levels) / 10))))


def success(ratio: float, threshold: float, width: float) -> float:
    """Probability that a packet is understood at a signal-to-noise ratio [dB], 0 to 1.

    1 / (1 + exp(-(ratio - threshold) / width)): a half at the threshold [dB], 0.95 at three widths [dB] above; a step
    where the width is 0.
    """
    above = ratio - threshold
    if width == 0:
        return float(above >= 0)
    return float(1 / (1 + np.exp(np.clip(-above / width, -700, 700))))
