"""Sensors of underwater vehicles, read from a simulation: `sensor = Dvl(model, "dvl"); reading = sensor.read(data)`.

dvl.py               `Dvl`: velocity over the bottom and through the water, by four beams
pressure.py          `Pressure`: pressure and depth, with that of the waves
gps.py               `Gps`: latitude, longitude, height, above the surface only
multibeam.py         `Multibeam`: ranges of a fan of beams
imaging_sonar.py     `ImagingSonar`: a picture by range and bearing
scanning_sonar.py    `ScanningSonar`: one beam, turned step by step
side_scan.py         `SideScan`: a line of intensities by range to each side
camera.py            `UnderwaterCamera`: a camera whose light the water absorbs and scatters
light.py             `WaterLight`: that change of light
usbl.py              `Usbl`: range, bearing and elevation of a transponder, late by the sound's way
acoustic_modem.py    `AcousticModem`: packets of bytes, and ranges by their travel time
acoustic_channel.py  `AcousticChannel`: the water between modems
optical_modem.py     `OpticalModem`: packets of bytes by light
optical_channel.py   `OpticalChannel`: the water between such modems
packet.py            `Message`: a packet that has arrived
modem.py             what modems share
channel.py           what channels share
sonar_equation.py    loss and noise on an acoustic link
optical_link.py      power and errors on an optical link
travel.py            when sound meets what moves
ins.py               `Ins`: inertial navigation, aided by DVL, pressure, GPS and fixes
error_state.py       its Kalman filter
aids.py              what its aids measure
imu.py               its gyros and accelerometers
backscatter.py       what sonars share
echoes.py            rays that sound takes
mount.py             where an instrument is
noise.py             errors as functions of a seed and of time
arguments.py         arguments, checked

A sensor sits at a site, or at the origin of a body, in that frame: x forward, y left, z up. It reads the poses and
velocities that `data` holds: the present ones after `mj_forward`, those of the step's start after `mj_step`, as
MuJoCo's own sensors do. Errors depend on the seed and the time alone: the same state gives the same reading, in copies
and restored states too; two sensors of other names have other errors. Whoever wants a rate reads at that rate.
"""

from .acoustic_channel import AcousticChannel
from .acoustic_modem import AcousticModem
from .camera import UnderwaterCamera
from .dvl import Dvl, DvlReading
from .gps import Gps, GpsReading
from .imaging_sonar import ImagingSonar, SonarImage
from .imu import Imu
from .ins import Ins, InsReading
from .light import WaterLight
from .multibeam import Multibeam, MultibeamReading
from .optical_channel import OpticalChannel
from .optical_modem import OpticalModem
from .packet import Message
from .pressure import Pressure, PressureReading
from .scanning_sonar import ScanBeam, ScanningSonar, ScanSweep
from .side_scan import SideScan, SideScanLine
from .usbl import Usbl, UsblFix

__all__ = [
    "AcousticChannel",
    "AcousticModem",
    "Dvl",
    "DvlReading",
    "Gps",
    "GpsReading",
    "ImagingSonar",
    "Imu",
    "Ins",
    "InsReading",
    "Message",
    "Multibeam",
    "MultibeamReading",
    "OpticalChannel",
    "OpticalModem",
    "Pressure",
    "PressureReading",
    "ScanBeam",
    "ScanSweep",
    "ScanningSonar",
    "SideScan",
    "SideScanLine",
    "SonarImage",
    "UnderwaterCamera",
    "Usbl",
    "UsblFix",
    "WaterLight",
]
