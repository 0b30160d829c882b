"""Optical modem: packets of bytes by light."""

import mujoco

from ..errors import DataError
from .arguments import at_least, real, whole
from .modem import Modem
from .optical_channel import OpticalChannel, OpticalStation


class OpticalModem(Modem):
    """A modem at a site that sends and sees light about its z, on a channel with others.

    A packet lasts 8 bits a byte of header and payload / bit rate. The modem sends one at a time, in turn, and sees
    nothing while it sends (half duplex). A packet arrives where all of its bits are right: (1 - erfc(Q / sqrt 2) /
    2)^bits, with Q the power that arrives by the standard deviation of the noise in half the bit rate; see
    `OpticalChannel` for the power. In a message `snr` is 20 log10 Q, and there is no range.

    Source: S. Arnon, Underwater optical wireless communication network, Optical Engineering 49(1), 2010, 015001;
    H. Kaushal and G. Kaddoum, Underwater Optical Wireless Communication, IEEE Access 4, 2016 (1 to 10 Mbit/s over tens
    of metres).
    """

    _channel: OpticalChannel

    def __init__(
        self,
        channel: OpticalChannel,
        name: str,
        *,
        bit_rate: float = 1e7,
        header: int = 16,
        longest: int = 65536,
        power: float = 1.0,
        beam: float = 30.0,
        view: float = 60.0,
        area: float = 1e-3,
        noise: float = 1e-13,
        daylight_noise: float = 3e-11,
    ):
        """Mount the modem.

        Args:
            channel: that it joins. name: of a site, or of a body; with water about it, else about the channel's first.
            bit_rate: [bit/s]. header: of a packet, with its checksum [bytes]. longest: payload [bytes].
            power: of its light, on average [W].
            beam: half angle of the cone that it lights evenly [degrees], above 0 and at most 180.
            view: half angle of the cone that it sees [degrees], above 0 and at most 90.
            area: that collects light [m^2].
            noise: of the receiver in the dark, as power of light [W/sqrt(Hz)].
            daylight_noise: of daylight at the surface, likewise [W/sqrt(Hz)]; 0 at night.

        Raises:
            DataError: there is no such place, no water about it, another modem there, or a number is out of bounds.
        """
        mount = channel.mount(name)
        super().__init__(channel, name, bit_rate=bit_rate, preamble=0.0, longest=longest)
        self._preamble = 8 * whole("header", header, 1) / self._rate
        channel.join(
            OpticalStation(
                mount,
                self._rate,
                at_least("power", power, 0, " W"),
                _half_angle("beam", beam, 180),
                at_least("area", area, 1e-9, " m^2"),
                _half_angle("view", view, 90),
                at_least("noise", noise, 1e-18, " W/sqrt(Hz)"),
                at_least("daylight_noise", daylight_noise, 0, " W/sqrt(Hz)"),
            )
        )

    def power(self, data: mujoco.MjData, sender: str) -> float:
        """Power that arrives from another modem at the state of `data`, whether it sends or not [W]; 0 of none.

        Raises:
            DataError: there is no such modem, or the data are of another model.
        """
        stations = self._channel.stations
        ends = [stations[each].mount for each in (self._other(sender), self._name)]
        ends[1].check(data)
        return self._channel.power(data, sender, self._name, *(each.position(data) for each in ends))


def _half_angle(name: str, angle: float, most: float) -> float:
    if not 0 < real(angle) <= most:
        raise DataError(f"{name} is {angle} degrees; expected above 0 and at most {most:g}")
    return float(angle)
