"""Acoustic channel: what modems send, on its way through the water."""

from dataclasses import dataclass

import mujoco
import numpy as np

from . import sonar_equation
from .arguments import at_least
from .channel import Channel, Epoch, Station, off_axis, place_at
from .packet import Message, Packet, Signal
from .travel import meeting
from .usbl import SOUND

#: Level of a modem's own sound at itself [dB re 1 uPa]: drowns all else.
DEAFENING = 300.0


@dataclass
class AcousticStation(Station):
    """A modem as the channel knows it: what it sends and hears; see `AcousticModem` for the units."""

    source_level: float
    noise_level: float
    threshold: float
    width: float
    cone: tuple[float, float]
    timing_noise: float
    clock: tuple[float, float]

    def hears(self, axes: np.ndarray, towards: np.ndarray) -> bool:
        """Whether a direction in the world lies in the cone of the modem with these axes."""
        return self.cone[0] <= off_axis(axes, towards) <= self.cone[1]

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


class AcousticChannel(Channel[AcousticStation]):
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

    kind, station, own = "acoustic", AcousticStation, DEAFENING

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
        self._frequency = at_least("frequency", frequency, 1, " Hz")
        self._band = 10 * np.log10(at_least("bandwidth", bandwidth, 1, " Hz"))
        self._spreading = at_least("spreading", spreading, 0)
        self._speed = at_least("sound_speed", sound_speed, 1, " m/s")
        super().__init__(model, reach=reach, seed=seed)

    def reset(self) -> None:
        """Forget all packets, under way and arrived."""
        super().reset()
        self._fronts: list[_Front] = []

    def _launch(self, data: mujoco.MjData, packet: Packet, last: Epoch, now: Epoch) -> None:
        """Let a packet leave its sender, where that is in the water."""
        name, mount = packet.sender, self.stations[packet.sender].mount
        origin = place_at(packet.start, name, last, now)
        if mount.water.is_wet(origin, packet.start):
            self._fronts.append(_Front(packet, origin, mount.axes(data), set(self.stations) - {name}))

    def _travel(self, data: mujoco.MjData, last: Epoch, now: Epoch) -> None:
        """Let modems hear the begins of packets that meet them between two epochs."""
        for front in self._fronts:
            for name in list(front.ahead):
                self._meet(data, front, name, last, now)
        self._fronts = [each for each in self._fronts if each.ahead]

    def _meet(self, data: mujoco.MjData, front: _Front, name: str, last: Epoch, now: Epoch) -> None:
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
        if not self._is_open(data, packet.sender, name, front.origin):
            return
        level = sender.source_level - sonar_equation.transmission_loss(distance, self._frequency, self._spreading)
        self._heard.append(Signal(packet, name, time, time + packet.duration, level))

    def _message(self, signal: Signal, noise: list[float], random: np.random.Generator) -> Message | None:
        """What a modem understands of a sound."""
        packet, receiver, sender = signal.packet, self.stations[signal.receiver], self.stations[signal.packet.sender]
        ratio = signal.level - sonar_equation.total(receiver.noise_level + self._band, *noise)
        if random.random() >= sonar_equation.success(ratio, receiver.threshold, receiver.width):
            return None
        sent = sender.stamp(packet.start)
        travel = receiver.stamp(signal.start) + receiver.timing_noise * random.standard_normal() - sent
        return Message(signal.end, sent, packet.sender, packet.payload, float(self._speed * travel), ratio)
