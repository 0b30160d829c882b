"""Units and ranges of single signals."""

import math

import numpy as np

from ..model import Model
from ..report import Report
from ..signals import Signals
from ..units import ANGLE, RATE

#: Angles beyond two turns, and rates beyond 2000 deg/s, are in degrees.
LARGEST_ANGLE, LARGEST_RATE = 4 * math.pi, 35.0
#: A command this much beyond an actuator's range is said, as a share of the range; and one that is a pulse's width.
BEYOND, PULSE = 0.02, 800.0


def suspect_values(signals: Signals, model: Model, report: Report) -> None:
    """Say degrees taken for radians, commands out of range, signals that never change."""
    for name, signal in {**signals.sensors, **signals.joints}.items():
        largest = float(np.nanmax(np.abs(signal.values)))
        quantity = signal.source.quantity
        if quantity == ANGLE and largest > LARGEST_ANGLE and not _revolves(signal.values[:, 0]):
            report.suspect(f'`{name}` swings to {largest:.4g} rad: degrees? `unit = "deg"`')
        if quantity == RATE and largest > LARGEST_RATE:
            report.suspect(f'`{name}` reaches {largest:.4g} rad/s: degrees? `unit = "deg/s"`')
        finite = signal.values[np.isfinite(signal.values).all(1)]
        if len(finite) > 10 and not signal.is_attitude and not np.ptp(finite, axis=0).any():
            report.suspect(f"`{name}` never changes: {np.round(finite[0], 6).tolist()} in all {len(finite)} samples")
    for name, signal in signals.actuators.items():
        actuator = model.actuators[name]
        low, high = float(np.nanmin(signal.values)), float(np.nanmax(signal.values))
        if not math.isfinite(actuator.low + actuator.high):
            continue
        slack = BEYOND * (actuator.high - actuator.low)
        if low < actuator.low - slack or high > actuator.high + slack:
            pulse = '; widths of pulses? `unit = "us"`' if low > PULSE else ""
            report.suspect(
                f"commands of `{name}` go from {low:.4g} to {high:.4g}, and the model clips them to "
                f"{actuator.low:g} to {actuator.high:g}{pulse}"
            )


def _revolves(angles: np.ndarray) -> bool:
    """True where an angle only grows, as that of a wheel."""
    angles = angles[np.isfinite(angles)]
    return abs(angles[-1] - angles[0]) > 0.9 * np.abs(np.diff(angles)).sum()
