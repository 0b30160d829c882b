"""Acoustic modem: packets of bytes through the water, and ranges by their travel time."""

import numpy as np

from ..errors import DataError
from .acoustic_channel import AcousticChannel, AcousticStation
from .arguments import at_least, real, span
from .modem import Modem
from .noise import Noise


class AcousticModem(Modem):
    """A modem at a site, on a channel with others.

    A packet lasts preamble + 8 bits a byte / bit rate. The modem sends one at a time, in turn, and hears nothing while
    it sends (half duplex). A packet arrives with the probability 1 / (1 + exp(-(SNR - threshold) / width)); see
    `AcousticChannel` for the signal-to-noise ratio. One-way ranging: clocks that were set at time 0 show t + offset +
    drift t; the range is the difference of the stamps of sending and hearing times the speed of sound.

    Source: L. Freitag et al., The WHOI Micro-Modem, OCEANS 2005 (25 kHz, 80 to 5400 bit/s, about 185 dB); R. M. Eustice
    et al., Synchronous-clock one-way-travel-time acoustic navigation, J. Field Robotics 28(1), 2011 (clocks).
    """

    def __init__(
        self,
        channel: AcousticChannel,
        name: str,
        *,
        bit_rate: float = 1000.0,
        preamble: float = 0.1,
        longest: int = 1024,
        source_level: float = 185.0,
        noise_level: float = 50.0,
        threshold: float = 10.0,
        width: float = 1.0,
        cone: tuple[float, float] = (0.0, 180.0),
        clock_offset: float = 0.0,
        clock_drift: float = 2e-8,
        timing_noise: float = 1e-4,
    ):
        """Mount the modem.

        Args:
            channel: that it joins. name: of a site, or of a body; with water about it, else about the channel's first.
            bit_rate: [bit/s]. preamble: of a packet [s]. longest: payload [bytes].
            source_level: [dB re 1 uPa at 1 m].
            noise_level: spectrum level of the sea and of the vehicle where it listens [dB re 1 uPa^2/Hz].
            threshold: signal-to-noise ratio at which half of the packets arrive [dB]. width: of that curve [dB].
            cone: least and greatest angle from its z at which it sends and hears [degrees].
            clock_offset: standard deviation of its clock at time 0 [s], constant for a seed.
            clock_drift: standard deviation of its clock's rate [1], likewise.
            timing_noise: standard deviation of the time at which it hears a packet [s].

        Raises:
            DataError: there is no such place, no water about it, another modem there, or a number is out of bounds.
        """
        mount = channel.mount(name)
        super().__init__(channel, name, bit_rate=bit_rate, preamble=preamble, longest=longest)
        cone = span("cone", cone, " degrees")
        if cone[1] > 180:
            raise DataError(f"cone is {cone[0]:g} to {cone[1]:g} degrees; expected 180 at most")
        offset = at_least("clock_offset", clock_offset, 0, " s")
        drift = at_least("clock_drift", clock_drift, 0)
        turned_on = Noise(channel.seed, f"acoustic modem {name}").constant(2)
        channel.join(
            AcousticStation(
                mount,
                _level("source_level", source_level),
                _level("noise_level", noise_level),
                _level("threshold", threshold),
                at_least("width", width, 0, " dB"),
                cone,
                at_least("timing_noise", timing_noise, 0, " s"),
                (offset * float(turned_on[0]), drift * float(turned_on[1])),
            )
        )


def _level(name: str, level: float) -> float:
    found = real(level)
    if not np.isfinite(found):
        raise DataError(f"{name} is {level} dB; expected a finite number")
    return found
