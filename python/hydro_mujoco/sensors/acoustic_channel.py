"""Acoustic channel: what modems send, on its way through the water."""

from dataclasses import dataclass, field

import mujoco
import numpy as np

from ..errors import DataError
from . import sonar_equation
from .acoustic_packet import Message, Packet, Sound
from .arguments import at_least
from .echoes import Rays
from .mount import Mount
from .noise import Noise
from .travel import meeting
from .usbl import SOUND

#: Level of a modem's own sound at itself [dB re 1 uPa]: drowns all else.
DEAFENING = 300.0


@dataclass
class Station:
    """A modem as the channel knows it: where it is, what it sends and hears; see `AcousticModem` for the units."""

    mount: Mount
    source_level: float
    noise_level: float
    threshold: float
    width: float
    cone: tuple[float, float]
    timing_noise: float
    clock: tuple[float, float]
    inbox: list[Message] = field(default_factory=list)
    free: float = -np.inf

    def hears(self, axes: np.ndarray, towards: np.ndarray) -> bool:
        """Whether a direction in the world lies in the cone of the modem with these axes."""
        length = float(np.linalg.norm(towards))
        angle = np.degrees(np.arccos(np.clip(axes[:, 2] @ towards / length, -1, 1))) if length else 90.0
        return bool(self.cone[0] <= angle <= self.cone[1])

    def stamp(self, time: float) -> float:
        """What the modem's clock shows at a time [s]."""
        return time + self.clock[0] + self.clock[1] * time


@dataclass
class _Front:
    """The begin of a packet on its way: from where, with which axes of the sender, and who has not been met by it."""

    packet: Packet
    origin: np.ndarray
    axes: np.ndarray
    ahead: set[str]


@dataclass(frozen=True)
class _Epoch:
    """Places of the modems at a time: positions in the world [m]."""

    time: float
    places: dict[str, np.ndarray]


class AcousticChannel:
    """The water between modems: sound goes straight, with one speed, and fades by spreading and Thorp's absorption.

    SNR = SL - TL - (NL + 10 log10 B) [dB]: source level, transmission loss, noise spectrum level, bandwidth. Packets
    that overlap at a modem are noise to each other (one that is stronger by the threshold survives), and what a modem
    sends drowns what it hears. A packet's begin leaves from where the sender is and arrives where the receiver is
    then; its length is that of the sending (no Doppler). It does not leave a sender or reach a receiver out of the
    water, nor pass what stands between when it arrives, nor go beyond reach. No echoes, no bending.

    The channel remembers what is under way: after a restored state `reset` it. Where time goes back it resets itself.

    Source: R. J. Urick, Principles of Underwater Sound, 3rd ed., McGraw-Hill 1983, chapter 2; M. Stojanovic and J.
    Preisig, IEEE Communications Magazine 47(1), 2009.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        *,
        frequency: float = 25e3,
        bandwidth: float = 4e3,
        spreading: float = 2.0,
        reach: float = 5000.0,
        sound_speed: float = SOUND,
        seed: int = 0,
    ):
        """Fill the water.

        Args:
            model: compiled.
            frequency: of the carrier [Hz]. bandwidth: of receivers [Hz].
            spreading: 2 for spherical, 1 for cylindrical, 1.5 in practice.
            reach: greatest range [m].
            sound_speed: [m/s].
            seed: of all errors.

        Raises:
            DataError: a number is out of bounds.
        """
        Noise(seed, "")
        self.model, self.seed, self.stations = model, seed, dict[str, Station]()
        self._frequency = at_least("frequency", frequency, 1, " Hz")
        self._band = 10 * np.log10(at_least("bandwidth", bandwidth, 1, " Hz"))
        self._spreading = at_least("spreading", spreading, 0)
        self._reach = at_least("reach", reach, 1e-3, " m")
        self._speed = at_least("sound_speed", sound_speed, 1, " m/s")
        self._rays: dict[tuple[str, str], Rays] = {}
        self.reset()

    def reset(self) -> None:
        """Forget all packets, under way and arrived."""
        self._last: _Epoch | None = None
        self._queue: list[Packet] = []
        self._fronts: list[_Front] = []
        self._heard: list[Sound] = []
        self._past: list[Sound] = []
        for station in self.stations.values():
            station.inbox, station.free = [], -np.inf

    def join(self, station: Station) -> None:
        """Add a modem.

        Raises:
            DataError: one of that name is there already.
        """
        name = station.mount.name
        if name in self.stations:
            raise DataError(f"a modem at `{name}` is on the channel already")
        self.stations[name] = station

    def send(self, packet: Packet) -> None:
        """Send a packet at its time."""
        self.stations[packet.sender].free = packet.start + packet.duration
        self._queue.append(packet)

    def update(self, data: mujoco.MjData) -> None:
        """Move sound and modems on to the time of `data`."""
        for station in self.stations.values():
            station.mount.check(data)
        now = _Epoch(data.time, {name: each.mount.position(data) for name, each in self.stations.items()})
        if self._last is not None and now.time < self._last.time:
            self.reset()
        last, self._last = self._last or now, now
        for packet in [each for each in self._queue if each.start <= now.time]:
            self._queue.remove(packet)
            self._launch(data, packet, last, now)
        for front in self._fronts:
            for name in list(front.ahead):
                self._meet(data, front, name, last, now)
        self._fronts = [each for each in self._fronts if each.ahead]
        for sound in sorted((each for each in self._heard if each.end <= now.time), key=lambda each: each.end):
            self._understand(sound)
        self._past += [each for each in self._heard if each.end <= now.time]
        self._heard = [each for each in self._heard if each.end > now.time]
        # What is over is noise only to what began before its end.
        oldest = min([each.start for each in self._heard] + [now.time])
        self._past = [each for each in self._past if each.end > oldest]

    def _launch(self, data: mujoco.MjData, packet: Packet, last: _Epoch, now: _Epoch) -> None:
        """Let a packet leave its sender, where that is in the water."""
        name, mount = packet.sender, self.stations[packet.sender].mount
        share = (packet.start - last.time) / (now.time - last.time) if now.time > last.time else 1.0
        start = last.places.get(name, now.places[name])
        origin = start + share * (now.places[name] - start)
        self._past.append(Sound(packet, name, packet.start, packet.start + packet.duration, DEAFENING))
        if mount.water.is_wet(origin, packet.start):
            self._fronts.append(_Front(packet, origin, mount.axes(data), set(self.stations) - {name}))

    def _meet(self, data: mujoco.MjData, front: _Front, name: str, last: _Epoch, now: _Epoch) -> None:
        """Let a modem hear the begin of a packet, where it has arrived between two epochs and nothing prevents it."""
        packet, after = front.packet, now.places[name]
        before = last.places.get(name, after)
        met = meeting(front.origin, packet.start, self._speed, (last.time, before), (now.time, after))
        if met is None:
            if self._speed * (now.time - packet.start) > self._reach:
                front.ahead.remove(name)
            return
        front.ahead.remove(name)
        time, place = met
        sender, receiver = self.stations[packet.sender], self.stations[name]
        way, mount = place - front.origin, receiver.mount
        distance = float(np.linalg.norm(way))
        in_view = sender.hears(front.axes, way) and receiver.hears(mount.axes(data), -way)
        if distance > self._reach or not in_view or not mount.water.is_wet(place, time):
            return
        if not self._is_open(data, packet.sender, name, front.origin - after):
            return
        level = sender.source_level - sonar_equation.transmission_loss(distance, self._frequency, self._spreading)
        self._heard.append(Sound(packet, name, time, time + packet.duration, level))

    def _is_open(self, data: mujoco.MjData, sender: str, receiver: str, way: np.ndarray) -> bool:
        """Whether nothing stands on the way [m] from a receiver to where a packet was sent."""
        pair, distance = (sender, receiver), float(np.linalg.norm(way))
        if distance < 1e-6:
            return True
        if pair not in self._rays:
            self._rays[pair] = Rays(self.stations[receiver].mount)
            self._rays[pair].pass_tree(self.stations[sender].mount.body)
        return bool(self._rays[pair].cast(data, way[None] / distance, (0.0, distance)).geom[0] < 0)

    def _understand(self, sound: Sound) -> None:
        """Put a packet whose end has arrived into the receiver's inbox, if it is addressed and understood."""
        packet, receiver, sender = sound.packet, self.stations[sound.receiver], self.stations[sound.packet.sender]
        noise = [receiver.noise_level + self._band]
        for other in self._heard + self._past:
            overlaps = other.receiver == sound.receiver and other.start < sound.end and sound.start < other.end
            # Packets of one sender follow each other, whatever its motion does to their lengths.
            if overlaps and other.packet.sender != packet.sender:
                noise.append(other.level)
        ratio = sound.level - sonar_equation.total(*noise)
        random = Noise(self.seed, f"acoustic modem {packet.sender} {sound.receiver}").generator(sound.start)
        understood = random.random() < sonar_equation.success(ratio, receiver.threshold, receiver.width)
        if not understood or packet.receiver not in (None, sound.receiver):
            return
        sent = sender.stamp(packet.start)
        travel = receiver.stamp(sound.start) + receiver.timing_noise * random.standard_normal() - sent
        message = Message(sound.end, sent, packet.sender, packet.payload, float(self._speed * travel), ratio)
        receiver.inbox.append(message)
