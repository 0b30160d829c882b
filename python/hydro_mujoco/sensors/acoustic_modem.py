"""Acoustic modem: packets of bytes through the water, and ranges by their travel time."""

import mujoco
import numpy as np

from ..errors import DataError
from .acoustic_channel import AcousticChannel, Station
from .acoustic_packet import Message, Packet
from .arguments import at_least, span, whole
from .mount import Mount
from .noise import Noise


class AcousticModem:
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
            channel: that it joins. name: of a site, or of a body; with water about it, or about the channel's first.
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
        first = next(iter(channel.stations.values()), None)
        mount = Mount(channel.model, name, first.mount.water if first else None)
        self._channel, self._name = channel, name
        self._rate, self._preamble = (
            at_least("bit_rate", bit_rate, 1e-3, " bit/s"),
            at_least("preamble", preamble, 0, " s"),
        )
        self._longest = whole("longest", longest, 1)
        cone = span("cone", cone, " degrees")
        if cone[1] > 180:
            raise DataError(f"cone is {cone[0]:g} to {cone[1]:g} degrees; expected 180 at most")
        offset = at_least("clock_offset", clock_offset, 0, " s")
        drift = at_least("clock_drift", clock_drift, 0)
        turned_on = Noise(channel.seed, f"acoustic modem {name}").constant(2)
        self._station = Station(
            mount,
            _level("source_level", source_level),
            _level("noise_level", noise_level),
            _level("threshold", threshold),
            at_least("width", width, 0, " dB"),
            cone,
            at_least("timing_noise", timing_noise, 0, " s"),
            (offset * float(turned_on[0]), drift * float(turned_on[1])),
        )
        channel.join(self._station)

    def duration(self, size: int) -> float:
        """Time that a packet of so many bytes lasts [s]."""
        return self._preamble + 8 * size / self._rate

    def send(self, data: mujoco.MjData, payload: bytes, *, to: str | None = None) -> float:
        """Send a packet, when those before it have been sent; returns when its end will have left [s].

        Args:
            data: state at which it is given to the modem, after `mj_forward` or `mj_step`.
            payload: bytes, as many as `longest` at most.
            to: name of the modem that it is for; None: all.

        Raises:
            DataError: the payload is no bytes or too long, or there is no such modem.
        """
        if not isinstance(payload, bytes | bytearray) or len(payload) > self._longest:
            size = f"{len(payload)} bytes" if isinstance(payload, bytes | bytearray) else repr(payload)
            raise DataError(f"payload is {size}; expected bytes, {self._longest} at most")
        others = [name for name in self._channel.stations if name != self._name]
        if to is not None and to not in others:
            there = ", ".join(f"`{name}`" for name in others) or "none"
            raise DataError(f"no other modem at `{to}` is on the channel; there are: {there}")
        self._channel.update(data)
        start, duration = max(data.time, self._station.free), self.duration(len(payload))
        self._channel.send(Packet(self._name, to, bytes(payload), start, duration))
        return self._station.free

    def poll(self, data: mujoco.MjData) -> list[Message]:
        """Messages whose end has arrived since the last call, in that order.

        To be called once a step or a few, by one modem of the channel at least: each call is one line of the motion of
        all.
        """
        self._channel.update(data)
        messages, self._station.inbox = self._station.inbox, []
        return messages


def _level(name: str, level: float) -> float:
    if not np.isfinite(level):
        raise DataError(f"{name} is {level} dB; expected a finite number")
    return float(level)
