"""Which way is up: accelerometers, attitudes and heights of a vehicle that is mostly upright."""

import mujoco
import numpy as np

from ..frames import matrices
from ..model import Model
from ..report import Report
from ..signals import Signals

#: Share of gravity that is clearly upside down, and lengths of a mean reading that no gravity explains.
UPSIDE_DOWN, LEAST, MOST = -0.5, 0.4, 2.5
#: Gravity's size in other units, by the factor that a reading is off.
UNITS = {1 / 9.80665: "g", 1000 / 9.80665: "mg", 1000.0: "mm/s^2", 100.0: "cm/s^2"}
#: Heights above this are above water [m].
ABOVE = 0.2


def suspect_up(signals: Signals, model: Model, report: Report) -> None:
    """Say where a signal has up and down exchanged, or gravity in another unit."""
    compiled = model.compiled
    data = mujoco.MjData(compiled)
    mujoco.mj_forward(compiled, data)
    gravity = float(np.linalg.norm(compiled.opt.gravity)) or 9.81
    for name, signal in signals.sensors.items():
        kind, place = model.sensors[name].type, int(compiled.sensor(name).objid[0])
        if kind == "accelerometer":
            up = data.site_xmat[place].reshape(3, 3)[2]
            _accelerometer(name, np.nanmean(signal.some(), axis=0), up, gravity, report)
        elif kind == "framequat":
            quaternions = signal.some()
            finite = quaternions[np.isfinite(quaternions).all(1)]
            up = float(np.median(matrices(finite)[:, 2, 2]))
            if up < UPSIDE_DOWN:
                report.suspect(
                    f"by `{name}` the vehicle is upside down most of the time (its z axis points {up:.2f} up): "
                    "NED/FRD taken for ENU/FLU, xyzw for wxyz, or one of the two frames alone"
                )
        elif kind == "framepos" and np.isfinite(signal.range[0][2]):
            start = data.xpos[1:, 2].min(initial=0.0)
            low, high = (float(bound[2]) for bound in signal.range)
            if start < -ABOVE and low > ABOVE:
                report.suspect(
                    f"by `{name}` the vehicle is {low:.2f} to {high:.2f} m above z = 0, and the model starts at "
                    f"{start:.2f} m: a "
                    'depth taken for a height? `frame = "NED"`, or `scale = -1`'
                )


def _accelerometer(name: str, mean: np.ndarray, up: np.ndarray, gravity: float, report: Report) -> None:
    if not np.isfinite(mean).all():
        return
    size = float(np.linalg.norm(mean))
    if LEAST * gravity <= size <= MOST * gravity:
        if mean @ up / size < UPSIDE_DOWN:
            report.suspect(
                f"at rest `{name}` reads {size:.3g} m/s^2 downwards, and gravity is felt upwards: FRD taken for "
                "FLU (NED for "
                'ENU)? `frame = "FRD"`'
            )
        return
    unit = next((unit for factor, unit in UNITS.items() if 0.9 < size / (factor * gravity) < 1.1), None)
    if unit:
        report.suspect(f'`{name}` reads {size:.4g} m/s^2 at rest, not {gravity:.3g}: `unit = "{unit}"`?')
    elif size < LEAST * gravity:
        report.suspect(
            f"`{name}` reads {size:.3g} m/s^2 at rest: gravity was taken out of it, and MuJoCo's accelerometer "
            "feels it; map the raw one"
        )
    else:
        report.suspect(f"`{name}` reads {size:.4g} m/s^2 on average, which no gravity explains")
