"""Channel: the water between modems; what they send in turn, what reaches them, what they understand."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Generic, TypeVar

import mujoco
import numpy as np

from ..errors import DataError
from .arguments import at_least
from .echoes import Rays
from .mount import Mount
from .noise import Noise
from .packet import Message, Packet, Signal


@dataclass
class Station:
    """A modem as its channel knows it: where it is, messages not yet given out, when all will have been sent [s]."""

    mount: Mount
    inbox: list[Message] = field(default_factory=list, init=False)
    free: float = field(default=-np.inf, init=False)


StationKind = TypeVar("StationKind", bound=Station)


@dataclass(frozen=True)
class Epoch:
    """Places of the modems at a time [s]: positions in the world [m]."""

    time: float
    places: dict[str, np.ndarray]


def off_axis(axes: np.ndarray, towards: np.ndarray) -> float:
    """Angle between the z of a modem with these axes and a direction in the world [degrees]; 90 of none."""
    length = float(np.linalg.norm(towards))
    return float(np.degrees(np.arccos(np.clip(axes[:, 2] @ towards / length, -1, 1)))) if length else 90.0


class Channel(ABC, Generic[StationKind]):
    """The water between modems, for one way of sending.

    A modem sends one packet at a time and hears nothing meanwhile (half duplex). Packets that overlap at a modem are
    noise to each other. Between two calls of `update` all move in straight lines.
    """

    #: Way of sending: with it errors are of their own.
    kind: str
    #: Class of its stations.
    station: type[StationKind]
    #: Level of what a modem sends itself, as its receiver has it: drowns all else.
    own: float

    def __init__(self, model: mujoco.MjModel, *, reach: float, seed: int):
        """Fill the water.

        Args:
            model: compiled. reach: greatest range [m]. seed: of all errors.

        Raises:
            DataError: a number is out of bounds.
        """
        Noise(seed, "")
        self.model, self.seed, self.stations = model, seed, dict[str, StationKind]()
        self._reach = at_least("reach", reach, 1e-3, " m")
        self._rays: dict[tuple[str, str], Rays] = {}
        self.reset()

    def reset(self) -> None:
        """Forget all packets, under way and arrived."""
        self._last: Epoch | None = None
        self._queue: list[Packet] = []
        self._heard: list[Signal] = []
        self._past: list[Signal] = []
        for station in self.stations.values():
            station.inbox, station.free = [], -np.inf

    def mount(self, name: str) -> Mount:
        """Place of a modem to be, in its own water, else in that of the channel's first.

        Raises:
            DataError: there is no such place, or no water.
        """
        try:
            return Mount(self.model, name)
        except DataError:
            if not self.stations:
                raise
            first = next(iter(self.stations.values()))
            return Mount(self.model, name, first.mount.water)

    def join(self, station: StationKind) -> None:
        """Add a modem.

        Raises:
            DataError: one of that name is there already, or the modem is of another kind.
        """
        if not isinstance(station, self.station):
            raise DataError(f"the modem at `{station.mount.name}` does not fit the channel, which is {self.kind}")
        name = station.mount.name
        if name in self.stations:
            raise DataError(f"a modem at `{name}` is on the channel already")
        self.stations[name] = station

    def send(self, packet: Packet) -> None:
        """Send a packet at its time."""
        self.stations[packet.sender].free = packet.start + packet.duration
        self._queue.append(packet)

    def update(self, data: mujoco.MjData) -> None:
        """Move packets and modems on to the time of `data`."""
        for station in self.stations.values():
            station.mount.check(data)
        now = Epoch(data.time, {name: each.mount.position(data) for name, each in self.stations.items()})
        if self._last is not None and now.time < self._last.time:
            self.reset()
        last, self._last = self._last or now, now
        for packet in [each for each in self._queue if each.start <= now.time]:
            self._queue.remove(packet)
            end = packet.start + packet.duration
            self._past.append(Signal(packet, packet.sender, packet.start, end, self.own))
            self._launch(data, packet, last, now)
        self._travel(data, last, now)
        over = [each for each in self._heard if each.end <= now.time]
        for signal in sorted(over, key=lambda each: each.end):
            self._understand(signal)
        self._past += over
        self._heard = [each for each in self._heard if each.end > now.time]
        # A packet that is over is noise only to those that began before its end.
        oldest = min([each.start for each in self._heard] + [now.time])
        self._past = [each for each in self._past if each.end > oldest]

    @abstractmethod
    def _launch(self, data: mujoco.MjData, packet: Packet, last: Epoch, now: Epoch) -> None:
        """Let a packet leave its sender between two epochs."""

    def _travel(self, data: mujoco.MjData, last: Epoch, now: Epoch) -> None:
        """Move what is under way from one epoch to another; nothing is, where packets arrive at once."""

    @abstractmethod
    def _message(self, signal: Signal, noise: list[float], random: np.random.Generator) -> Message | None:
        """What a modem understands of a signal, given levels of other packets that overlap it; None: nothing."""

    def _understand(self, signal: Signal) -> None:
        """Put a packet whose end has arrived into the receiver's inbox, if it is addressed and understood."""
        sender, name = signal.packet.sender, signal.receiver
        noise = []
        for other in self._heard + self._past:
            overlaps = other.receiver == name and other.start < signal.end and signal.start < other.end
            # Packets of one sender follow each other, whatever its motion does to their lengths.
            if overlaps and other.packet.sender != sender:
                noise.append(other.level)
        random = Noise(self.seed, f"{self.kind} modem {sender} {name}").generator(signal.start)
        message = self._message(signal, noise, random)
        if message is not None and signal.packet.receiver in (None, name):
            self.stations[name].inbox.append(message)

    def _is_open(self, data: mujoco.MjData, sender: str, receiver: str, origin: np.ndarray) -> bool:
        """Whether nothing stands between a receiver and where a packet was sent, in the world [m]."""
        pair = sender, receiver
        if pair not in self._rays:
            self._rays[pair] = Rays(self.stations[receiver].mount)
            self._rays[pair].pass_tree(self.stations[sender].mount.body)
        return self._rays[pair].is_open(data, origin)


def place_at(time: float, name: str, last: Epoch, now: Epoch) -> np.ndarray:
    """Where a modem was at a time [s] between two epochs, in the world [m]."""
    share = (time - last.time) / (now.time - last.time) if now.time > last.time else 1.0
    start = last.places.get(name, now.places[name])
    return start + share * (now.places[name] - start)
