"""Acoustic positioning: range, bearing and elevation of a transponder by an ultra-short baseline."""

from dataclasses import dataclass
from typing import Literal

import mujoco
import numpy as np

from ..errors import DataError
from .arguments import at_least, real
from .echoes import Rays
from .mount import Mount
from .noise import Noise
from .travel import meeting

#: Speed of sound in sea water [m/s].
SOUND = 1500.0


@dataclass(frozen=True)
class UsblFix:
    """A reply.

    Attributes:
        time: at which it is there [s]. sent: at which its ping went out [s].
        range: half the sound's way and back [m].
        bearing: of the transponder from the transceiver's x towards its y, elevation: above its x-y plane [rad].
        position: of the transponder by these, along the transceiver's axes [m], shape (3,).
    """

    time: float
    sent: float
    range: float
    bearing: float
    elevation: float
    position: np.ndarray


@dataclass(frozen=True)
class _Epoch:
    """Places at a time: positions in the world [m]."""

    time: float
    transceiver: np.ndarray
    transponder: np.ndarray
    axes: np.ndarray


@dataclass(frozen=True)
class _Arrival:
    """Sound that has arrived: where and when, and the transceiver's axes then."""

    time: float
    position: np.ndarray
    axes: np.ndarray


class Usbl:
    """A transceiver that asks a transponder, and what it learns from the reply.

    The ping travels from where the transceiver was to where the transponder is when it arrives, the reply from there to
    where the transceiver is then: range is half of both ways, direction that of the reply's arrival. So a fix is late
    by the sound's way and wrong by what moved meanwhile, as at sea. One speed of sound, straight rays; no reply where
    something stands between, where one of the two is out of the water, or beyond reach. Between two calls of `poll`
    both move in straight lines.

    The sensor remembers the ping under way: after a restored state `reset` it. Where time goes back it resets itself.

    Source: P. H. Milne, Underwater Acoustic Positioning Systems, E. & F. N. Spon 1983; X. Lurton, An Introduction to
    Underwater Acoustics, 2nd ed., Springer 2010.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        transceiver: str,
        transponder: str,
        *,
        period: float = 2.0,
        reach: float = 1000.0,
        sound_speed: float = SOUND,
        turnaround: float = 0.0,
        range_noise: float = 0.05,
        angle_noise: float = 0.25,
        dropout: float = 0.0,
        seed: int = 0,
    ):
        """Mount both.

        Args:
            model: compiled. transceiver, transponder: names of sites, or of bodies; water about the first.
            period: from ping to ping [s]; the next waits until the reply is there or lost.
            reach: greatest range [m].
            sound_speed: [m/s].
            turnaround: time that the transponder takes, known and taken off [s].
            range_noise: standard deviation of a range [m].
            angle_noise: standard deviation of bearing and of elevation [degrees].
            dropout: probability that a reply is lost, 0 to 1.
            seed: of all errors.

        Raises:
            DataError: there is no such place, no water about it, or a number is out of bounds.
        """
        if not 0 <= real(dropout) <= 1:
            raise DataError(f"dropout is {dropout}; expected 0 to 1")
        self._transceiver = Mount(model, transceiver)
        self._transponder = Mount(model, transponder, self._transceiver.water)
        self._noise = Noise(seed, f"usbl {transceiver} {transponder}")
        self._rays = Rays(self._transceiver)
        self._rays.pass_tree(self._transponder.body)
        self._period = at_least("period", period, 0, " s")
        self._reach = at_least("reach", reach, 1e-3, " m")
        self._speed = at_least("sound_speed", sound_speed, 1, " m/s")
        self._turnaround = at_least("turnaround", turnaround, 0, " s")
        self._range_noise = at_least("range_noise", range_noise, 0, " m")
        self._angle_noise = np.radians(at_least("angle_noise", angle_noise, 0, " degrees"))
        self._dropout = real(dropout)
        self.reset()

    def reset(self) -> None:
        """Forget the ping under way; the next `poll` sends one."""
        self._last: _Epoch | None = None
        self._ping: _Epoch | None = None
        self._heard: _Arrival | None = None
        self._next = -np.inf

    def poll(self, data: mujoco.MjData) -> UsblFix | None:
        """Send what is due; returns the reply that has arrived since the last call, if one has.

        To be called once a step or a few: each call is one line of the motion of both.
        """
        self._transceiver.check(data)
        now = _Epoch(
            data.time,
            self._transceiver.position(data),
            self._transponder.position(data),
            self._transceiver.axes(data),
        )
        if self._last is not None and now.time < self._last.time:
            self.reset()
        last, self._last = self._last or now, now
        fix = None
        if self._ping is not None:
            fix = self._listen(data, last, now, self._ping)
        if self._ping is None and now.time >= self._next and self._is_wet(self._transceiver, data):
            self._ping, self._heard, self._next = now, None, now.time + self._period
        return fix

    def _listen(self, data: mujoco.MjData, last: _Epoch, now: _Epoch, ping: _Epoch) -> UsblFix | None:
        """The reply to a ping, where it has arrived between two epochs; forgets a ping that is lost."""
        if self._heard is None:
            heard = self._arrival(last, now, "transponder", ping.transceiver, ping.time)
            if heard is not None:
                if not self._is_open(data, now):
                    self._ping = None
                    return None
                self._heard = heard
        reply = None
        if self._heard is not None:
            leaves = self._heard.time + self._turnaround
            reply = self._arrival(last, now, "transceiver", self._heard.position, leaves)
        if reply is not None and self._heard is not None:
            self._ping = None
            return self._fix(ping, self._heard, reply) if self._is_wet(self._transceiver, data) else None
        if now.time - ping.time > 2 * self._reach / self._speed + self._turnaround:
            self._ping = None
        return None

    def _arrival(
        self,
        last: _Epoch,
        now: _Epoch,
        which: Literal["transceiver", "transponder"],
        origin: np.ndarray,
        sent: float,
    ) -> _Arrival | None:
        """Where sound from an origin [m], sent at a time [s], meets one of the two, if it has by now."""
        met = meeting(origin, sent, self._speed, (last.time, getattr(last, which)), (now.time, getattr(now, which)))
        return None if met is None else _Arrival(*met, now.axes)

    def _fix(self, ping: _Epoch, heard: _Arrival, reply: _Arrival) -> UsblFix | None:
        random = self._noise.generator(reply.time)
        errors, lost = random.standard_normal(3), random.random() < self._dropout
        distance = 0.5 * self._speed * (reply.time - ping.time - self._turnaround)
        if lost or distance > self._reach:
            return None
        x, y, z = reply.axes.T @ (heard.position - reply.position)
        distance += self._range_noise * errors[0]
        bearing, elevation = (
            np.array([np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))]) + self._angle_noise * errors[1:]
        )
        flat = np.cos(elevation)
        towards = np.array([flat * np.cos(bearing), flat * np.sin(bearing), np.sin(elevation)])
        return UsblFix(reply.time, ping.time, float(distance), float(bearing), float(elevation), distance * towards)

    def _is_open(self, data: mujoco.MjData, now: _Epoch) -> bool:
        """Whether both are in the water and nothing stands between."""
        if not (self._is_wet(self._transponder, data) and self._is_wet(self._transceiver, data)):
            return False
        return self._rays.is_open(data, now.transponder)

    @staticmethod
    def _is_wet(mount: Mount, data: mujoco.MjData) -> bool:
        return bool(mount.water.is_wet(mount.position(data), data.time))
