"""Modem: packets of bytes, sent in turn and given out when they have arrived."""

import mujoco

from ..errors import DataError
from .arguments import at_least, whole
from .channel import Channel
from .packet import Message, Packet


class Modem:
    """A modem at a site, on a channel with others; `AcousticModem`, `OpticalModem`."""

    def __init__(self, channel: Channel, name: str, *, bit_rate: float, preamble: float, longest: int):
        """Note how it sends; who makes it joins it to the channel.

        Args:
            channel: that it is on. name: of its site or body.
            bit_rate: [bit/s]. preamble: of a packet [s]. longest: payload [bytes].

        Raises:
            DataError: a number is out of bounds.
        """
        self._channel, self._name = channel, name
        self._rate = at_least("bit_rate", bit_rate, 1e-3, " bit/s")
        self._preamble = at_least("preamble", preamble, 0, " s")
        self._longest = whole("longest", longest, 1)

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
        if to is not None:
            self._other(to)
        self._channel.update(data)
        station = self._channel.stations[self._name]
        start, duration = max(data.time, station.free), self.duration(len(payload))
        self._channel.send(Packet(self._name, to, bytes(payload), start, duration))
        return float(station.free)

    def poll(self, data: mujoco.MjData) -> list[Message]:
        """Messages whose end has arrived since the last call, in that order.

        To be called once a step or a few, by one modem of the channel at least: each call is one line of the motion of
        all.
        """
        self._channel.update(data)
        station = self._channel.stations[self._name]
        messages, station.inbox = station.inbox, []
        return messages

    def _other(self, name: str) -> str:
        """Name of another modem of the channel.

        Raises:
            DataError: there is none.
        """
        others = [each for each in self._channel.stations if each != self._name]
        if name not in others:
            there = ", ".join(f"`{each}`" for each in others) or "none"
            raise DataError(f"no other modem at `{name}` is on the channel; there are: {there}")
        return name
