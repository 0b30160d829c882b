"""Sensors of underwater vehicles, read from a simulation: `sensor = Dvl(model, "dvl"); reading = sensor.read(data)`.

dvl.py       `Dvl`: velocity over the bottom and through the water, by four beams
pressure.py  `Pressure`: pressure and depth, with that of the waves
gps.py       `Gps`: latitude, longitude, height, above the surface only
sonar.py     `Multibeam`: ranges of a fan of beams; `ImagingSonar`: a picture by range and bearing
usbl.py      `Usbl`: range, bearing and elevation of a transponder, late by the sound's way
echoes.py    rays that sound takes
mount.py     where an instrument is
noise.py     errors as functions of a seed and of time

A sensor sits at a site, or at the origin of a body, in that frame: x forward, y left, z up. It reads the poses and
velocities that `data` holds: the present ones after `mj_forward`, those of the step's start after `mj_step`, as
MuJoCo's own sensors do. Errors depend on the seed and the time alone: the same state gives the same reading, in copies
and restored states too; two sensors of other names have other errors. Whoever wants a rate reads at that rate.
"""

from .dvl import Dvl, DvlReading
from .gps import Gps, GpsReading
from .pressure import Pressure, PressureReading
from .sonar import ImagingSonar, Multibeam, MultibeamReading, SonarImage
from .usbl import Usbl, UsblFix

__all__ = [
    "Dvl",
    "DvlReading",
    "Gps",
    "GpsReading",
    "ImagingSonar",
    "Multibeam",
    "MultibeamReading",
    "Pressure",
    "PressureReading",
    "SonarImage",
    "Usbl",
    "UsblFix",
]
