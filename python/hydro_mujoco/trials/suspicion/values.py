"""Units and ranges of single signals."""

import math

import numpy as np

from ..model import Model
from ..report import Report
from ..scratch import blocks
from ..signals import Signals
from ..units import ANGLE, RATE

#: Angles beyond two turns, and rates beyond 2000 deg/s, are in degrees.
LARGEST_ANGLE, LARGEST_RATE = 4 * math.pi, 35.0
#: A command this much beyond an actuator's range is said, as a share of the range; and one that is a pulse's width.
BEYOND, PULSE = 0.02, 800.0


def suspect_values(signals: Signals, model: Model, report: Report) -> None:
    """Say degrees taken for radians, commands out of range, signals that never change."""
    for name, signal in {**signals.sensors, **signals.joints}.items():
        least, most = signal.range
        largest = float(np.nanmax(np.abs([least, most])))
        quantity = signal.source.quantity
        if quantity == ANGLE and largest > LARGEST_ANGLE and not _revolves(signal.values):
            report.suspect(f'`{name}` swings to {largest:.4g} rad: degrees? `unit = "deg"`')
        if quantity == RATE and largest > LARGEST_RATE:
            report.suspect(f'`{name}` reaches {largest:.4g} rad/s: degrees? `unit = "deg/s"`')
        count = len(signal.values)
        if count > 10 and not signal.is_attitude and not (most - least).any():
            report.suspect(f"`{name}` never changes: {np.round(least, 6).tolist()} in all {count} samples")
    for name, signal in signals.actuators.items():
        actuator = model.actuators[name]
        low, high = (float(bound[0]) for bound in signal.range)
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
    """True where an angle (n, 1) only grows, as that of a wheel."""
    way = sum(float(np.abs(np.diff(angles[b.start : b.stop + 1, 0])).sum()) for b in blocks(len(angles)))
    return bool(abs(angles[-1, 0] - angles[0, 0]) > 0.9 * way)
