"""The systems that cases are made of."""

from .b1 import Swim, Tow
from .base import Drive, Schedule, System
from .leg import Leg
from .vehicle import Vehicle

SYSTEMS: dict[str, type[System]] = {"vehicle": Vehicle, "leg": Leg, "tow": Tow, "swim": Swim}

__all__ = ["SYSTEMS", "Drive", "Schedule", "System"]
