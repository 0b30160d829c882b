"""Optical channel: light from modem to modem."""

from dataclasses import dataclass
from math import inf, log10
from typing import Literal

import mujoco
import numpy as np

from ..errors import DataError
from . import optical_link
from .arguments import at_least
from .channel import Channel, Epoch, Station, off_axis, place_at
from .light import WaterLight
from .packet import Message, Packet, Signal

#: Columns of `WaterLight`.
COLOURS = ("red", "green", "blue")


@dataclass
class OpticalStation(Station):
    """A modem as the channel knows it: what it sends and sees; see `OpticalModem` for the units."""

    bit_rate: float
    power: float
    beam: float
    area: float
    view: float
    noise: float
    daylight_noise: float


class OpticalChannel(Channel[OpticalStation]):
    """The water or the air between optical modems: light goes straight, at once, and fades on its way.

    The power that arrives is P exp(-c d) A cos(incidence) / (2 pi d^2 (1 - cos beam)), with c the beam attenuation of
    the light in the water, or in the air where both modems are above it, whatever lies between: what is scattered is
    lost. None arrives outside the sender's beam or the receiver's view, where something stands between, from the water
    into the air or back, or beyond reach; that is judged at a packet's begin. Noise is that of the receiver and that of
    daylight, whose variance falls with depth as daylight does, exp(-K depth), whichever way the receiver looks. Packets
    that overlap at a modem are noise to each other, and what a modem sends drowns what it sees (half duplex).

    The channel remembers what is under way: after a restored state `reset` it. Where time goes back it resets itself.

    Source: S. Arnon, Underwater optical wireless communication network, Optical Engineering 49(1), 2010, 015001;
    J. W. Giles and I. N. Bankman, Underwater optical communications systems, part 2, MILCOM 2005 (daylight);
    W. E. K. Middleton, Vision through the Atmosphere, University of Toronto Press 1952 (meteorological range).
    """

    kind, station, own = "optical", OpticalStation, inf

    def __init__(
        self,
        model: mujoco.MjModel,
        *,
        light: WaterLight | None = None,
        colour: Literal["red", "green", "blue"] = "blue",
        air: float = 1e-4,
        reach: float = 200.0,
        seed: int = 0,
    ):
        """Fill the water, and the air above it.

        Args:
            model: compiled.
            light: of the water; `WaterLight()` by default. Give the numbers of the modems' own colour, where known.
            colour: of the modems; which numbers of `light` hold.
            air: beam attenuation of the air [1/m]; 3.9 / meteorological range (39 km by default: clear; 1 km: haze).
            reach: greatest range [m].
            seed: of all errors.

        Raises:
            DataError: a number is out of bounds, or there is no such colour.
        """
        if colour not in COLOURS:
            raise DataError(f"colour is {colour!r}; expected one of {', '.join(COLOURS)}")
        if light is not None and not isinstance(light, WaterLight):
            raise DataError(f"light is {light!r}; expected a WaterLight")
        light = light or WaterLight()
        column = COLOURS.index(colour)
        self._attenuation, self._daylight = float(light.attenuation[column]), float(light.daylight[column])
        self._air = at_least("air", air, 0, " 1/m")
        super().__init__(model, reach=reach, seed=seed)

    def power(self, data: mujoco.MjData, sender: str, receiver: str, origin: np.ndarray, place: np.ndarray) -> float:
        """Power that arrives at a receiver at a place from a sender at an origin, in the world [m]; 0 of none [W].

        Axes, waves and what stands between are those of `data`.
        """
        source, eye = self.stations[sender], self.stations[receiver]
        way = place - origin
        distance = float(np.linalg.norm(way))
        incidence = off_axis(eye.mount.axes(data), -way)
        if distance > self._reach or incidence > eye.view or off_axis(source.mount.axes(data), way) > source.beam:
            return 0.0
        is_wet = bool(source.mount.water.is_wet(origin, data.time))
        if is_wet != bool(eye.mount.water.is_wet(place, data.time)):
            return 0.0
        if not self._is_open(data, sender, receiver, origin):
            return 0.0
        angles = np.radians([source.beam, incidence])
        attenuation = self._attenuation if is_wet else self._air
        return optical_link.received_power(source.power, distance, attenuation, angles[0], eye.area, angles[1])

    def _launch(self, data: mujoco.MjData, packet: Packet, last: Epoch, now: Epoch) -> None:
        """Let all modems that see a packet have it."""
        origin, end = place_at(packet.start, packet.sender, last, now), packet.start + packet.duration
        for name in [each for each in self.stations if each != packet.sender]:
            power = self.power(data, packet.sender, name, origin, place_at(packet.start, name, last, now))
            if power > 0:
                self._heard.append(Signal(packet, name, packet.start, end, power))

    def _message(self, signal: Signal, noise: list[float], random: np.random.Generator) -> Message | None:
        """What a modem understands of a light."""
        packet, rate = signal.packet, self.stations[signal.packet.sender].bit_rate
        ratio = optical_link.quality(signal.level, self._noise(signal.receiver, rate), *noise)
        if ratio == 0 or random.random() >= optical_link.success(ratio, packet.duration * rate):
            return None
        return Message(signal.end, packet.start, packet.sender, packet.payload, np.nan, 20 * log10(ratio))

    def _noise(self, name: str, rate: float) -> float:
        """Standard deviation of noise at a modem in the band of a bit rate [bit/s], half of it [W]."""
        eye, last = self.stations[name], self._last
        assert last is not None
        depth = max((eye.mount.water.waterline or 0.0) - float(last.places[name][2]), 0.0)
        density = eye.noise**2 + eye.daylight_noise**2 * np.exp(-self._daylight * depth)
        return float(np.sqrt(density * rate / 2))
