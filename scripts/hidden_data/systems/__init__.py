"""The systems that cases are made of."""

from .base import Drive, Schedule, System
from .vehicle import Vehicle

SYSTEMS: dict[str, type[System]] = {"vehicle": Vehicle}

__all__ = ["SYSTEMS", "Drive", "Schedule", "System"]
