"""Packets of modems: as they are sent, as they reach a modem, as they are understood."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Packet:
    """A packet: from whom and to whom (None: all), begin [s] and length [s]."""

    sender: str
    receiver: str | None
    payload: bytes
    start: float
    duration: float


@dataclass(frozen=True)
class Signal:
    """A packet at a modem: begin and end [s]; level: of sound [dB re 1 uPa], or power of light [W]."""

    packet: Packet
    receiver: str
    start: float
    end: float
    level: float


@dataclass(frozen=True)
class Message:
    """A packet that has arrived.

    Attributes:
        time: at which its end was there [s]. sent: at which its begin left, by the sender's clock [s].
        sender: name of the modem. payload: as it was sent.
        range: travel time of its begin by the clocks of both, times the speed of sound [m]; not a number by light.
        snr: signal-to-noise ratio, other packets being noise [dB].
    """

    time: float
    sent: float
    sender: str
    payload: bytes
    range: float
    snr: float
