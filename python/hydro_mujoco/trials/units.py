"""Units of logs: quantity and factor to SI of each."""

import math

from ..errors import DataError
from .words import nearest

ANGLE, RATE = "angle", "angular velocity"
LENGTH, VELOCITY, ACCELERATION = "length", "velocity", "acceleration"
FORCE, TORQUE, PRESSURE, FIELD = "force", "torque", "pressure", "magnetic field"
RATIO, PULSE = "ratio", "pulse width"
#: Has no unit: a quaternion, or roll, pitch and yaw.
ATTITUDE = "attitude"

#: Standard gravity [m/s^2] and the foot [m].
_G, _FOOT = 9.80665, 0.3048
_DEG = math.pi / 180

#: Unit -> quantity, factor to SI; of angles, radians.
UNITS: dict[str, tuple[str, float]] = {
    "rad": (ANGLE, 1.0),
    "mrad": (ANGLE, 1e-3),
    "deg": (ANGLE, _DEG),
    "cdeg": (ANGLE, 0.01 * _DEG),
    "degE7": (ANGLE, 1e-7 * _DEG),
    "turn": (ANGLE, 2 * math.pi),
    "rad/s": (RATE, 1.0),
    "mrad/s": (RATE, 1e-3),
    "deg/s": (RATE, _DEG),
    "rpm": (RATE, 2 * math.pi / 60),
    "m": (LENGTH, 1.0),
    "cm": (LENGTH, 1e-2),
    "mm": (LENGTH, 1e-3),
    "km": (LENGTH, 1e3),
    "ft": (LENGTH, _FOOT),
    "m/s": (VELOCITY, 1.0),
    "cm/s": (VELOCITY, 1e-2),
    "mm/s": (VELOCITY, 1e-3),
    "km/h": (VELOCITY, 1 / 3.6),
    "kn": (VELOCITY, 1852 / 3600),
    "m/s^2": (ACCELERATION, 1.0),
    "cm/s^2": (ACCELERATION, 1e-2),
    "mm/s^2": (ACCELERATION, 1e-3),
    "g": (ACCELERATION, _G),
    "mg": (ACCELERATION, 1e-3 * _G),
    "Pa": (PRESSURE, 1.0),
    "hPa": (PRESSURE, 1e2),
    "mbar": (PRESSURE, 1e2),
    "kPa": (PRESSURE, 1e3),
    "dbar": (PRESSURE, 1e4),
    "bar": (PRESSURE, 1e5),
    "psi": (PRESSURE, 6894.757293168),
    "N": (FORCE, 1.0),
    "kN": (FORCE, 1e3),
    "kgf": (FORCE, _G),
    "lbf": (FORCE, 4.4482216152605),
    "N m": (TORQUE, 1.0),
    "kgf m": (TORQUE, _G),
    "T": (FIELD, 1.0),
    "uT": (FIELD, 1e-6),
    "G": (FIELD, 1e-4),
    "mG": (FIELD, 1e-7),
    "1": (RATIO, 1.0),
    "%": (RATIO, 1e-2),
    "permille": (RATIO, 1e-3),
    "us": (PULSE, 1.0),
}

#: Unit of time -> seconds.
TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}


def quantity(unit: str, where: str) -> str:
    """What a unit measures. where: begins the error of an unknown one."""
    if unit not in UNITS:
        raise DataError(f"{where}: unit `{unit}` is not known{nearest(unit, UNITS)}; there are: {', '.join(UNITS)}")
    return UNITS[unit][0]


def units_of(measured: str) -> list[str]:
    """The units of a quantity."""
    return [unit for unit, (what, _) in UNITS.items() if what == measured]
