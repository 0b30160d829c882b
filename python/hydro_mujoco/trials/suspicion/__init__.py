"""What looks wrong with the signals of a log.

values.py     units and ranges of single signals
gravity.py    which way is up: accelerometer, attitude, height
motion.py     signals of one motion: gyro and attitude, velocity and position, compass and yaw, thrust and heave
"""

from ..model import Model
from ..report import Report
from ..signals import Signals
from .gravity import suspect_up
from .motion import suspect_motion
from .values import suspect_values


def suspect(signals: Signals, model: Model, report: Report) -> None:
    """Put into the report what looks wrong."""
    suspect_values(signals, model, report)
    suspect_up(signals, model, report)
    suspect_motion(signals, model, report)
